//! The model of a head: its mass, its linkage, its rest.

use super::actuated::Actuated;
use super::body::Body;
use super::carrier;
use super::error::DynamicsError;
use super::law::{EndStop, Hold, Law};
use super::modes::{LinearModel, Mode, modal_damping, modes};
use super::spec::{DampingSpec, EndStopSpec, HeadSpec, HoldSpec, LinkageSpec};
use super::statics::{Statics, Unrest};
use crate::elasticity::{Matrix6, SpringDesign, Vector6, blocks, split};
use crate::geometry::{Kinematics, Matrix, Pose, gravity_in_world, skew};
use crate::spec::{Source, SpecError};
use std::f64::consts::TAU;

/// A head and its linkage, valid by construction: its parts are a rigid body, and it stands.
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
    /// One spring.
    Spring(Box<Sprung>),
}

/// A head on its spring.
#[derive(Debug, Clone)]
pub(super) struct Sprung {
    pub law: Law,
    /// `base_from_head` at rest, the base upright and still.
    pub rest: Pose,
    pub linear: LinearModel,
}

impl HeadModel {
    /// The model of the head that `spec`, read from `source`, describes.
    ///
    /// # Errors
    /// When its numbers are no head's, or it cannot stand on its spring; the error says by how much.
    pub fn new(spec: &HeadSpec, source: &Source) -> Result<Self, DynamicsError> {
        Self::build(spec, source, |site, unrest, source| site.explain(unrest, source))
    }

    /// As [`HeadModel::new`], but says of a head that cannot stand only that: a search meets thousands of them.
    ///
    /// # Errors
    /// When its numbers are no head's, or it cannot stand on its spring.
    pub fn attempt(spec: &HeadSpec, source: &Source) -> Result<Self, DynamicsError> {
        Self::build(spec, source, |_, unrest, source| SpecError::about(source, "spring", unrest.to_string()))
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
            Linkage::Spring(sprung) => &sprung.rest,
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
            Linkage::Spring(_) => None,
        }
    }

    /// The head's small motions about its rest; `None` for one that gives nowhere.
    pub fn linear(&self) -> Option<&LinearModel> {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => None,
            Linkage::Spring(sprung) => Some(&sprung.linear),
        }
    }

    /// The head's modes about its rest, slowest first; none for one that gives nowhere.
    pub fn linear_modes(&self) -> &[Mode] {
        self.linear().map_or(&[], |linear| &linear.modes)
    }

    /// An upper bound on how fast the head oscillates, held by a hand and at its end stop, Hz; zero for one that does not.
    pub(super) fn fastest_hz(&self) -> f64 {
        let Linkage::Spring(sprung) = &self.linkage else { return 0.0 };
        let of_modes = sprung.linear.modes.iter().map(|mode| mode.frequency_hz).fold(0.0, f64::max);
        let lightest = self.body.inertia_in_head.symmetric_eigenvalues().min();
        let at_stop = sprung.law.end_stop.map_or(0.0, |stop| (stop.stiffness_nm_per_rad / lightest).sqrt() / TAU);
        of_modes.hypot(sprung.law.hold.as_ref().map_or(0.0, |hand| hand.frequency_hz)).hypot(at_stop)
    }

    /// Energy of the head: of its motion, its height above the world's zero, and its spring, J.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium there.
    pub fn energy_j(&self, world_from_base: &Pose, head: &Kinematics) -> Result<f64, DynamicsError> {
        let centre = head.of_frame(&Pose::from_parts(self.body.centre_of_mass_in_head.into(), Default::default()));
        let turning = centre.angular_velocity_in_body();
        let moving = 0.5 * self.body.mass_kg * centre.velocity_in_world.norm_squared()
            + 0.5 * turning.dot(&(self.body.inertia_in_head * turning));
        let height = -self.body.mass_kg * gravity_in_world().dot(&centre.world_from_body.translation.vector);
        let in_linkage = match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => 0.0,
            Linkage::Spring(sprung) => sprung.law.potential_j(&world_from_base.inv_mul(&head.world_from_body))?,
        };
        Ok(moving + height + in_linkage)
    }
}

/// Why a head does not stand, as a sentence.
type Explain = fn(&Site<'_>, &Unrest, &Source) -> SpecError;

/// What a spring's linkage is built from.
pub(super) struct Site<'a> {
    pub design: SpringDesign,
    pub segments: usize,
    pub base_from_spring: Pose,
    pub head_from_top: Pose,
    pub body: &'a Body,
}

impl Site<'_> {
    /// The undamped head at rest under `share` of gravity, with its stiffness.
    pub fn at_rest(&self, share: f64) -> Result<(Law, Pose, Matrix6), Unrest> {
        let gravity_in_base = gravity_in_world() * share;
        let along = self.base_from_spring.rotation.inverse() * gravity_in_base;
        let spring = self.design.law(-self.body.mass_kg * along.z, self.segments)?;
        let straight = Pose::translation(0.0, 0.0, spring.length_m());
        let start = self.base_from_spring * straight * self.head_from_top.inverse();
        let law = Law::undamped(spring, self.base_from_spring, self.head_from_top, self.body);
        let (rest, stiffness) = Statics { law: &law, body: self.body, gravity_in_base }.settle(&start)?;
        Ok((law, rest, stiffness))
    }

    /// The head's fall as a sentence: why, and how much the spring would carry.
    fn explain(&self, unrest: &Unrest, source: &Source) -> SpecError {
        let (mut stands, mut falls) = (0.0, 1.0);
        for _ in 0..24 {
            let middle = 0.5 * (stands + falls);
            if self.at_rest(middle).is_ok() { stands = middle } else { falls = middle }
        }
        let mass_kg = self.body.mass_kg;
        if stands < 1e-3 {
            return SpecError::about(source, "spring", unrest.to_string());
        }
        let message = format!(
            "the head cannot stand on its spring: {unrest}; mounted so, the spring carries at most {:.3} kg, and the head has \
             {mass_kg:.3} kg",
            stands * mass_kg
        );
        SpecError::about(source, "spring", message).with_help(
            "a thicker wire, fewer coils or a shorter spring are stiffer; a lighter or lower head asks for less",
        )
    }
}

impl Linkage {
    fn new(spec: &LinkageSpec, body: &Body, source: &Source, explain: Explain) -> Result<Self, DynamicsError> {
        match spec {
            LinkageSpec::Rigid { base_from_head } => Ok(Linkage::Rigid { base_from_head: base_from_head.pose() }),
            LinkageSpec::Actuated { base_from_head, motor } => {
                Ok(Linkage::Actuated(Box::new(Actuated::new(base_from_head, motor, source)?)))
            }
            LinkageSpec::Spring {
                spring,
                segments,
                base_from_spring,
                head_from_spring,
                damping_ratio,
                end_stop,
                hold,
            } => {
                let design = spring.design().map_err(|error| SpecError::about(source, "spring", error.to_string()))?;
                let (base_from_spring, head_from_top) = (base_from_spring.pose(), head_from_spring.pose());
                let site = Site { design, segments: *segments, base_from_spring, head_from_top, body };
                let (law, rest, stiffness) = site.at_rest(1.0).map_err(|unrest| explain(&site, &unrest, source))?;
                let mut sprung = Sprung::linearised(law, (rest, stiffness), body, damping_ratio, hold.as_ref())
                    .ok_or_else(|| SpecError::about(source, "parts", "the head's mass has no inverse"))?;
                sprung.law.end_stop = end_stop.map(|stop| sprung.end_stop(&stop, source)).transpose()?;
                Ok(Linkage::Spring(Box::new(sprung)))
            }
        }
    }
}

impl Hold {
    /// A hand on a head of this mass, resting so, both in the deformation's coordinates: `(2 pi f)^2 M` and `4 pi f zeta M`.
    fn new(hand: &HoldSpec, mass: &Matrix6, rest: Vector6) -> Self {
        let (frequency_hz, omega) = (hand.frequency_hz, TAU * hand.frequency_hz);
        let damping = mass * (2.0 * hand.damping_ratio * omega);
        Self { frequency_hz, stiffness: mass * (omega * omega), damping, rest }
    }
}

impl Sprung {
    /// The head at rest with its modes damped, and a hand near it; `None` where its mass has no inverse.
    fn linearised(
        mut law: Law,
        (rest, stiffness): (Pose, Matrix6),
        body: &Body,
        damping: &DampingSpec,
        hand: Option<&HoldSpec>,
    ) -> Option<Self> {
        let mass = body.mass_matrix(rest.rotation.to_rotation_matrix().matrix());
        let (coordinates, rate) = law.rate_matrix(&rest);
        let modes = modes(&mass, &stiffness, &rate, damping)?;
        let unrate = rate.try_inverse()?;
        let modal = modal_damping(&mass, &modes);
        law.damping = unrate.tr_mul(&(modal * unrate));
        law.hold = hand.map(|hand| Hold::new(hand, &unrate.tr_mul(&(mass * unrate)), coordinates));
        let statics = Statics { law: &law, body, gravity_in_base: gravity_in_world() };
        let base_stiffness = statics.stiffness_to_base(&rest).ok()?;
        // A base that moves by (d, phi) carries a head that is stuck to it by (d + phi x centre, phi).
        let centre = (rest.translation.vector) + rest.rotation * body.centre_of_mass_in_head;
        let (one, zero) = (Matrix::identity(), Matrix::zeros());
        let carry = blocks(&one, &-skew(&centre), &zero, &one);
        let linear =
            LinearModel { mass, damping: modal, stiffness, base_damping: modal * carry, base_stiffness, modes };
        Some(Self { law, rest, linear })
    }

    fn end_stop(&self, stop: &EndStopSpec, source: &Source) -> Result<EndStop, SpecError> {
        let (coordinates, _) = self.law.rate_matrix(&self.rest);
        let (_, turn) = split(&coordinates);
        let lean_deg = turn.norm().to_degrees();
        if stop.angle_deg <= lean_deg || stop.angle_deg >= 170.0 {
            let message = format!(
                "the stop at {} degrees must be beyond the head's lean at rest, {lean_deg:.1} degrees, and below 170",
                stop.angle_deg
            );
            return Err(SpecError::about(source, "angle_deg", message));
        }
        Ok(EndStop {
            angle_rad: stop.angle_deg.to_radians(),
            stiffness_nm_per_rad: stop.stiffness_nm_per_rad,
            damping_nm_s_per_rad: stop.damping_nm_s_per_rad,
        })
    }
}
