//! The model of a head: its mass, its linkage, its rest.

use super::actuated::Actuated;
use super::body::Body;
use super::carrier;
use super::error::DynamicsError;
use super::modes::{LinearModel, Mode};
use super::push::Instant;
use super::site::{Manner, Mount, Site};
use super::spec::{HeadSpec, LinkageSpec};
use super::sprung::{Bearing, Sprung};
use super::statics::Unrest;
use crate::elasticity::stack;
use crate::geometry::{Kinematics, Pose, gravity_in_world};
use crate::spec::{Source, SpecError};

/// A head and its linkage, valid by construction: its parts are a rigid body, and it stands or hangs.
#[derive(Debug, Clone)]
pub struct HeadModel {
    pub(super) body: Body,
    pub(super) linkage: Linkage,
    head_from_laser: Pose,
    head_from_imu: Pose,
}

/// What holds the head on the base.
#[derive(Debug, Clone)]
pub(super) enum Linkage {
    /// Nothing gives.
    Rigid { base_from_head: Pose },
    /// A motor turns the head.
    Actuated(Box<Actuated>),
    /// One spring, or several elements.
    Sprung(Box<Sprung>),
}

impl HeadModel {
    /// The model of the head that `spec`, read from `source`, describes.
    ///
    /// # Errors
    /// When its numbers are no head's, or it finds no rest in its linkage; the error says why.
    pub fn new(spec: &HeadSpec, source: &Source) -> Result<Self, DynamicsError> {
        Self::build(spec, source, |site, unrest, source| site.explain(unrest, source))
    }

    /// As [`HeadModel::new`], but says of a head that cannot stand only that: a search meets thousands of them.
    ///
    /// # Errors
    /// When its numbers are no head's, or it finds no rest in its linkage.
    pub fn attempt(spec: &HeadSpec, source: &Source) -> Result<Self, DynamicsError> {
        Self::build(spec, source, |site, unrest, source| SpecError::about(source, site.key(), unrest.to_string()))
    }

    fn build(spec: &HeadSpec, source: &Source, explain: Explain) -> Result<Self, DynamicsError> {
        let body = Body::of(spec, source)?;
        let linkage = Linkage::new(&spec.linkage, &body, source, explain)?;
        let (head_from_laser, head_from_imu) = (spec.head_from_laser.pose(), spec.head_from_imu.pose());
        let model = Self { body, linkage, head_from_laser, head_from_imu };
        let base_from_laser = model.rest_pose_base_from_head() * head_from_laser;
        carrier::check(spec, &base_from_laser.translation.vector, source)?;
        Ok(model)
    }

    /// Pose of the lidar in the head.
    pub fn head_from_laser(&self) -> &Pose {
        &self.head_from_laser
    }

    /// Pose of the IMU in the head.
    pub fn head_from_imu(&self) -> &Pose {
        &self.head_from_imu
    }

    /// Mass properties of the head.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Pose of the head in the base when both rest, the base upright; of one that a motor turns, before that starts.
    pub fn rest_pose_base_from_head(&self) -> &Pose {
        match &self.linkage {
            Linkage::Rigid { base_from_head } => base_from_head,
            Linkage::Actuated(actuated) => &actuated.start,
            Linkage::Sprung(sprung) => &sprung.rest,
        }
    }

    /// Why a head that gives nowhere has nothing to characterise; `None` for one that swings.
    pub fn unyielding(&self) -> Option<&'static str> {
        match &self.linkage {
            Linkage::Rigid { .. } => {
                Some("it is screwed to its base: there is no spring, hence nothing to characterise")
            }
            Linkage::Actuated(_) => {
                Some("a motor turns it, whatever its base does: there is no spring, hence nothing to characterise")
            }
            Linkage::Sprung(_) => None,
        }
    }

    /// The head's small motions about its rest; `None` for one that gives nowhere.
    pub fn linear(&self) -> Option<&LinearModel> {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => None,
            Linkage::Sprung(sprung) => Some(&sprung.linear),
        }
    }

    /// The head's modes about its rest, slowest first; none for one that gives nowhere.
    pub fn linear_modes(&self) -> &[Mode] {
        self.linear().map_or(&[], |linear| &linear.modes)
    }

    /// What each element of the linkage bears with head and base at rest; nothing for one that gives nowhere.
    pub fn bearings(&self) -> Vec<Bearing> {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => Vec::new(),
            Linkage::Sprung(sprung) => sprung.bearings(),
        }
    }

    /// An upper bound on how fast the head oscillates, held by a hand and at its end stop, Hz; zero for one that does
    /// not.
    pub(super) fn fastest_hz(&self) -> f64 {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => 0.0,
            Linkage::Sprung(sprung) => sprung.fastest_hz(&self.body),
        }
    }

    /// Energy of the head: of its motion, its height above the world's zero, and its linkage, J. Masses that move
    /// along, of wire and fluid, count by their motion relative to the base.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium there.
    pub fn energy_j(&self, world_from_base: &Pose, head: &Kinematics) -> Result<f64, DynamicsError> {
        let centre = head.of_frame(&Pose::from_parts(self.body.centre_of_mass_in_head.into(), Default::default()));
        let turning = centre.angular_velocity_in_body();
        let moving = 0.5 * self.body.mass_kg * centre.velocity_in_world.norm_squared()
            + 0.5 * turning.dot(&(self.body.inertia_in_head * turning));
        let height = -self.body.mass_kg * gravity_in_world().dot(&centre.world_from_body.translation.vector);
        let Linkage::Sprung(sprung) = &self.linkage else { return Ok(moving + height) };
        let base_from_head = world_from_base.inv_mul(&head.world_from_body);
        let in_linkage = sprung.law.potential_j(world_from_base, &base_from_head, &gravity_in_world())?;
        let twist = stack(&centre.velocity_in_world, &centre.angular_velocity_in_world);
        let now = Instant {
            base: &Kinematics::at_rest(*world_from_base),
            world_from_head: &head.world_from_body,
            twist: &twist,
            body: &self.body,
            hold: 0.0,
            gravity_in_world: gravity_in_world(),
        };
        let inertia = sprung.law.forces(&mut sprung.law.state(), &now)?.inertia;
        Ok(moving + height + in_linkage + 0.5 * twist.dot(&(inertia * twist)))
    }
}

/// Why a head does not stand, as a sentence.
type Explain = fn(&Site<'_>, &Unrest, &Source) -> SpecError;

impl Site<'_> {
    /// The spec's word for what holds the head.
    fn key(&self) -> &'static str {
        if self.is_one_spring() { "spring" } else { "elements" }
    }

    /// The head's fall as a sentence: why, and how much the linkage would carry.
    fn explain(&self, unrest: &Unrest, source: &Source) -> SpecError {
        let (mut stands, mut falls) = (0.0, 1.0);
        for _ in 0..24 {
            let middle = 0.5 * (stands + falls);
            if self.at_rest(middle).is_ok() { stands = middle } else { falls = middle }
        }
        let mass_kg = self.body().mass_kg;
        let on = if self.is_one_spring() { "its spring" } else { "its elements" };
        if stands < 1e-3 {
            let message = if self.is_one_spring() {
                unrest.to_string()
            } else {
                format!("the head cannot stand or hang on {on}: {unrest}")
            };
            return SpecError::about(source, self.key(), message);
        }
        let carrier = if self.is_one_spring() { "the spring carries" } else { "they carry" };
        let message = format!(
            "the head cannot stand on {on}: {unrest}; mounted so, {carrier} at most {:.3} kg, and the head has \
             {mass_kg:.3} kg",
            stands * mass_kg
        );
        let help = if self.is_one_spring() {
            "a thicker wire, fewer coils or a shorter spring are stiffer; a lighter or lower head asks for less"
        } else {
            "more, stiffer or wider-set elements hold it; a lighter or lower head asks for less"
        };
        SpecError::about(source, self.key(), message).with_help(help)
    }
}

impl Linkage {
    fn new(spec: &LinkageSpec, body: &Body, source: &Source, explain: Explain) -> Result<Self, DynamicsError> {
        let site = match Mount::of(spec, body, source)? {
            Mount::Rigid(base_from_head) => return Ok(Linkage::Rigid { base_from_head }),
            Mount::Actuated(actuated) => return Ok(Linkage::Actuated(Box::new(actuated))),
            Mount::Gives(site) => site,
        };
        let found = site.at_rest(1.0).map_err(|unrest| explain(&site, &unrest, source))?;
        let Manner { damping_ratio, end_stop, hold } = site.manner();
        let mut sprung = Sprung::linearised(found, body, &damping_ratio, hold.as_ref())
            .ok_or_else(|| SpecError::about(source, "parts", "the head's mass has no inverse"))?;
        if let Some(stop) = &end_stop {
            sprung.stop(stop, body, source)?;
        }
        Ok(Linkage::Sprung(Box::new(sprung)))
    }
}
