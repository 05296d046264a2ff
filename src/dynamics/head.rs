//! The model of a head: mass properties, linkage and equilibrium.

use super::actuated::Actuated;
use super::body::Body;
use super::carrier;
use super::compliant::{CompliantLinkage, ElementLoad};
use super::error::DynamicsError;
use super::forces::MotionState;
use super::modes::{LinearModel, Mode};
use super::mount::{CompliantMount, LinkageOptions, Mount};
use super::mounted_spring::MountedSpring;
use super::spec::{HeadSpec, LinkageSpec};
use super::statics::NoEquilibrium;
use zsim_base::geometry::{Kinematics, Pose, gravity_in_world};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, parse_named};
use zsim_elasticity::{ElasticityError, SpringSpec, SpringState, stack};

/// A head and the linkage that connects it to the base.
///
/// A constructed model is valid: the mass properties are physical and the equilibrium is stable.
#[derive(Debug, Clone)]
pub struct HeadModel {
    pub(super) body: Body,
    pub(super) linkage: Linkage,
    head_from_laser: Pose,
    head_from_imu: Pose,
}

/// The linkage between base and head.
#[derive(Debug, Clone)]
pub(super) enum Linkage {
    /// A rigid connection.
    Rigid { base_from_head: Pose },
    /// A motor rotates the head.
    Actuated(Box<Actuated>),
    /// A compliant linkage: one spring or several elements.
    Compliant(Box<CompliantLinkage>),
}

impl HeadModel {
    /// Builds the model of the head that `spec`, read from `source`, describes.
    ///
    /// # Errors
    /// When a value is invalid or the head has no stable equilibrium; the message gives the supported mass and advice.
    pub fn new(spec: &HeadSpec, source: &Source) -> Result<Self, DynamicsError> {
        Self::build(spec, source, |mount, failure, source| mount.explain(failure, source))
    }

    /// As [`HeadModel::new`], with a short message for a head without stable equilibrium.
    ///
    /// A design search meets thousands of such heads, and the supported mass is expensive to compute.
    ///
    /// # Errors
    /// When a value is invalid or the head has no stable equilibrium.
    pub fn new_without_advice(spec: &HeadSpec, source: &Source) -> Result<Self, DynamicsError> {
        Self::build(spec, source, |mount, failure, source| {
            SpecError::about(source, mount.spec_key(), failure.to_string())
        })
    }

    fn build(spec: &HeadSpec, source: &Source, explain: ExplainFailure) -> Result<Self, DynamicsError> {
        let body = Body::of(spec, source)?;
        let linkage = Linkage::new(&spec.linkage, &body, source, explain)?;
        let (head_from_laser, head_from_imu) = (spec.head_from_laser.pose(), spec.head_from_imu.pose());
        let model = Self { body, linkage, head_from_laser, head_from_imu };
        let base_from_laser = model.base_from_head_at_rest() * head_from_laser;
        carrier::check(&spec.carrier, &base_from_laser.translation.vector, source)?;
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

    /// Pose of the head in the base in static equilibrium, with the base upright.
    ///
    /// For an actuated mount, the pose before the motor starts.
    pub fn base_from_head_at_rest(&self) -> &Pose {
        match &self.linkage {
            Linkage::Rigid { base_from_head } => base_from_head,
            Linkage::Actuated(actuated) => &actuated.start,
            Linkage::Compliant(compliant) => &compliant.rest,
        }
    }

    /// Why there are no modes or gains to compute; `None` for a compliant linkage.
    pub fn rigid_mount_reason(&self) -> Option<&'static str> {
        match &self.linkage {
            Linkage::Rigid { .. } => {
                Some("the head is screwed to the base: there is no spring, hence nothing to characterise")
            }
            Linkage::Actuated(_) => Some("a motor turns the head: there is no spring, hence nothing to characterise"),
            Linkage::Compliant(_) => None,
        }
    }

    /// The springs, each with a state for the solutions of its inner nodes.
    pub(super) fn springs_with_states(&self) -> Vec<(&MountedSpring, SpringState)> {
        let springs: &[MountedSpring] = match &self.linkage {
            Linkage::Compliant(compliant) => &compliant.law.springs,
            Linkage::Rigid { .. } | Linkage::Actuated(_) => &[],
        };
        springs.iter().map(|mounted| (mounted, mounted.spring.state())).collect()
    }

    /// The model linearised about the equilibrium; `None` for a rigid or actuated mount.
    pub fn linear(&self) -> Option<&LinearModel> {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => None,
            Linkage::Compliant(compliant) => Some(&compliant.linear),
        }
    }

    /// The modes about the equilibrium, lowest frequency first; empty for a rigid or actuated mount.
    pub fn linear_modes(&self) -> &[Mode] {
        self.linear().map_or(&[], |linear| &linear.modes)
    }

    /// The static load of each element of the linkage; empty for a rigid or actuated mount.
    pub fn element_loads(&self) -> Vec<ElementLoad> {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => Vec::new(),
            Linkage::Compliant(compliant) => compliant.element_loads(),
        }
    }

    /// Upper bound of the natural frequencies, with hand hold and end stop, Hz.
    ///
    /// Zero for a rigid or actuated mount.
    pub(super) fn fastest_hz(&self) -> f64 {
        match &self.linkage {
            Linkage::Rigid { .. } | Linkage::Actuated(_) => 0.0,
            Linkage::Compliant(compliant) => compliant.fastest_hz(&self.body),
        }
    }

    /// Kinetic, gravitational and elastic energy of the head, J.
    ///
    /// The height is measured from the world origin. The masses of wire and fluid that move with the head count with
    /// the velocity relative to the base.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium at this pose.
    pub fn energy_j(&self, world_from_base: &Pose, head: &Kinematics) -> Result<f64, DynamicsError> {
        let centre = head.of_frame(&Pose::from_parts(self.body.centre_of_mass_in_head.into(), Default::default()));
        let turning = centre.angular_velocity_in_body();
        let moving = 0.5 * self.body.mass_kg * centre.velocity_in_world.norm_squared()
            + 0.5 * turning.dot(&(self.body.inertia_in_head * turning));
        let height = -self.body.mass_kg * gravity_in_world().dot(&centre.world_from_body.translation.vector);
        let Linkage::Compliant(compliant) = &self.linkage else { return Ok(moving + height) };
        let base_from_head = world_from_base.inv_mul(&head.world_from_body);
        let in_linkage = compliant.law.potential_j(world_from_base, &base_from_head, &gravity_in_world())?;
        let twist = stack(&centre.velocity_in_world, &centre.angular_velocity_in_world);
        let now = MotionState {
            base: &Kinematics::at_rest(*world_from_base),
            world_from_head: &head.world_from_body,
            twist: &twist,
            body: &self.body,
            hold: 0.0,
            gravity_in_world: gravity_in_world(),
        };
        let inertia = compliant.law.forces(&mut compliant.law.state(), &now)?.inertia;
        Ok(moving + height + in_linkage + 0.5 * twist.dot(&(inertia * twist)))
    }
}

/// Builds the message for a head without stable equilibrium.
type ExplainFailure = fn(&CompliantMount<'_>, &NoEquilibrium, &Source) -> SpecError;

impl CompliantMount<'_> {
    /// The spec key of the element or elements that support the head.
    fn spec_key(&self) -> &'static str {
        if self.is_one_spring() { "spring" } else { "elements" }
    }

    /// The message for a head without stable equilibrium: cause, and mass that the linkage supports.
    fn explain(&self, failure: &NoEquilibrium, source: &Source) -> SpecError {
        if let NoEquilibrium::Spring(ElasticityError::TooFewSegments { .. }) = failure {
            return SpecError::about(source, "segments", failure.to_string());
        }
        let (mut stable, mut unstable) = (0.0, 1.0);
        for _ in 0..24 {
            let middle = 0.5 * (stable + unstable);
            if self.equilibrium(middle).is_ok() { stable = middle } else { unstable = middle }
        }
        let mass_kg = self.body().mass_kg;
        let on = if self.is_one_spring() { "the spring" } else { "the elements" };
        if stable < 1e-3 {
            let message = if self.is_one_spring() {
                failure.to_string()
            } else {
                format!("the head has no stable equilibrium on {on}: {failure}")
            };
            return SpecError::about(source, self.spec_key(), message);
        }
        let carrier = if self.is_one_spring() { "the spring supports" } else { "they support" };
        let message = format!(
            "the head cannot stand on {on}: {failure}; in this mount {carrier} at most {:.3} kg, and the head has \
             {mass_kg:.3} kg",
            stable * mass_kg
        );
        let help = if self.is_one_spring() {
            "use a thicker wire, fewer coils or a shorter spring, or a lighter head with a lower centre of mass"
        } else {
            "use more, stiffer or more widely spaced elements, or a lighter head with a lower centre of mass"
        };
        SpecError::about(source, self.spec_key(), message).with_help(help)
    }
}

impl Linkage {
    fn new(spec: &LinkageSpec, body: &Body, source: &Source, explain: ExplainFailure) -> Result<Self, DynamicsError> {
        let mount = match Mount::of(spec, body, source)? {
            Mount::Rigid(base_from_head) => return Ok(Linkage::Rigid { base_from_head }),
            Mount::Actuated(actuated) => return Ok(Linkage::Actuated(Box::new(actuated))),
            Mount::Compliant(mount) => mount,
        };
        let (law, rest, stiffness) = mount.equilibrium(1.0).map_err(|failure| explain(&mount, &failure, source))?;
        let LinkageOptions { damping_ratio, end_stop, hold } = mount.options();
        let mut compliant = CompliantLinkage::linearised(law, rest, stiffness, body, &damping_ratio, hold.as_ref())
            .ok_or_else(|| SpecError::about(source, "parts", "the mass matrix of the head is singular"))?;
        if let Some(stop) = &end_stop {
            compliant.add_end_stop(stop, body, source)?;
        }
        Ok(Linkage::Compliant(Box::new(compliant)))
    }
}

impl NamedSpec for HeadSpec {
    const KIND: Kind = Kind::Head;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match HeadModel::new(&self.clone().with_files_of(source), source) {
            Ok(_) => Ok(Vec::new()),
            Err(DynamicsError::Spec(error)) => Err(error),
            Err(error) => Err(SpecError::plain(&source.name, error.to_string())),
        }
    }

    /// Replaces a spring that is given by name by its description, so that its settings can be varied.
    fn resolved(self, source: &Source) -> Result<Self, SpecError> {
        let mut head = self.with_files_of(source);
        if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
            *spring = SpringSpec::resolved(spring)?;
        }
        Ok(head)
    }
}
