//! Mounting of a head: the linkage of a spec before any load, and the equilibrium under weight.

use super::actuated::Actuated;
use super::body::Body;
use super::cord::Cord;
use super::elements::{CableSpec, ElementSpec, SpringElementSpec, SpringMassSpec};
use super::float::Float;
use super::force_law::ForceLaw;
use super::forces::EndFrames;
use super::joint::UniversalJoint;
use super::mounted_spring::{MountedSpring, WireMass};
use super::spec::{DampingSpec, EndStopSpec, HoldSpec, LinkageSpec};
use super::statics::{NoEquilibrium, Statics};
use zsim_base::geometry::{Pose, Rotation, gravity_in_world};
use zsim_base::spec::{Source, SpecError};
use zsim_elasticity::{ElasticityError, Matrix6, SpringDesign, SpringSpec, check_buckling};

/// The mounting of a head, before any load.
pub(super) enum Mount<'a> {
    /// Rigid connection: `base_from_head`.
    Rigid(Pose),
    /// A motor rotates the head.
    Actuated(Actuated),
    /// A compliant linkage.
    Compliant(CompliantMount<'a>),
}

/// The elements of a compliant linkage before any load.
pub(super) struct CompliantMount<'a> {
    springs: Vec<SpringMount>,
    cords: Vec<Cord>,
    floats: Vec<Float>,
    joint: Option<UniversalJoint>,
    /// Start pose `base_from_head` of the search for the equilibrium; `None` for a single spring, where the search
    /// starts at the top of the straight spring.
    start: Option<Pose>,
    body: &'a Body,
    options: LinkageOptions,
    /// Whether a pulled spring gets more segments than its spec has, if its pull needs them.
    refines: bool,
}

/// Options that apply to a linkage as a whole.
#[derive(Clone, Copy)]
pub(super) struct LinkageOptions {
    pub damping_ratio: DampingSpec,
    pub end_stop: Option<EndStopSpec>,
    pub hold: Option<HoldSpec>,
}

/// A spring before any load, with mounting frames.
struct SpringMount {
    design: SpringDesign,
    segments: usize,
    ends: EndFrames,
    wire_mass_kg: Option<f64>,
}

/// The common parameters of the spring linkage and of a spring element.
struct SpringParameters<'a> {
    spring: &'a SpringSpec,
    segments: usize,
    ends: EndFrames,
    mass: SpringMassSpec,
    cable: Option<&'a CableSpec>,
}

/// Maximum iterations in which the axial loads of the springs converge.
const MAX_ITERATIONS: usize = 20;

/// Length at which a displacement of a suspended head counts as a rotation by 1 rad, m.
const ROTATION_LENGTH_M: f64 = 0.1;

impl<'a> Mount<'a> {
    /// Creates the mount that a linkage spec describes.
    ///
    /// # Errors
    /// When a value of an element is invalid, or there are too few or too many elements.
    pub fn of(linkage: &LinkageSpec, body: &'a Body, source: &Source) -> Result<Self, SpecError> {
        let (damping_ratio, end_stop, hold) = match linkage {
            LinkageSpec::Rigid { base_from_head } => return Ok(Mount::Rigid(base_from_head.pose())),
            LinkageSpec::Actuated { base_from_head, motor } => {
                return Ok(Mount::Actuated(Actuated::new(base_from_head, motor, source)?));
            }
            LinkageSpec::Spring { damping_ratio, end_stop, hold, .. }
            | LinkageSpec::Suspension { damping_ratio, end_stop, hold, .. } => (*damping_ratio, *end_stop, *hold),
        };
        let options = LinkageOptions { damping_ratio, end_stop, hold };
        let mut mount = CompliantMount {
            springs: vec![],
            cords: vec![],
            floats: vec![],
            joint: None,
            start: None,
            body,
            options,
            refines: false,
        };
        match linkage {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => {}
            LinkageSpec::Spring {
                spring, segments, base_from_spring, head_from_spring, spring_mass, cable, ..
            } => {
                let ends =
                    EndFrames { base_from_foot: base_from_spring.pose(), head_from_top: head_from_spring.pose() };
                let parameters =
                    SpringParameters { spring, segments: *segments, ends, mass: *spring_mass, cable: cable.as_ref() };
                mount.add_spring(&parameters, source)?;
            }
            LinkageSpec::Suspension { elements, base_from_head, .. } => {
                if elements.is_empty() {
                    let message = "a suspension has at least one element: add a spring, cord, float or universal_joint";
                    return Err(SpecError::about(source, "elements", message));
                }
                elements.iter().try_for_each(|element| mount.add(element, source))?;
                mount.start = Some(mount.joint.map_or(base_from_head.pose(), |joint| joint.pose_at_zero_angles()));
            }
        }
        Ok(Mount::Compliant(mount))
    }
}

impl CompliantMount<'_> {
    fn add(&mut self, element: &ElementSpec, source: &Source) -> Result<(), SpecError> {
        match element {
            ElementSpec::Spring(SpringElementSpec {
                spring,
                segments,
                base_from_spring,
                head_from_spring,
                spring_mass,
                cable,
            }) => {
                let ends =
                    EndFrames { base_from_foot: base_from_spring.pose(), head_from_top: head_from_spring.pose() };
                let parameters =
                    SpringParameters { spring, segments: *segments, ends, mass: *spring_mass, cable: cable.as_ref() };
                self.add_spring(&parameters, source)?;
            }
            ElementSpec::Cord(cord) => self.cords.push(Cord::of(cord)),
            ElementSpec::Float(float) => self.floats.push(Float::of(float)),
            ElementSpec::UniversalJoint(joint) => {
                if self.joint.replace(UniversalJoint::of(joint)).is_some() {
                    let message =
                        "a suspension has at most one universal_joint: a second one would leave no free motion";
                    return Err(SpecError::about(source, "universal_joint", message));
                }
            }
        }
        Ok(())
    }

    fn add_spring(&mut self, parameters: &SpringParameters<'_>, source: &Source) -> Result<(), SpecError> {
        let invalid = |error: &dyn std::fmt::Display| SpecError::about(source, "spring", error.to_string());
        let design = parameters.spring.design().map_err(|error| invalid(&error))?;
        let wire_mass_kg = parameters.mass.of_wire(parameters.spring).map_err(|error| invalid(&error))?;
        if parameters.mass == SpringMassSpec::Included && wire_mass_kg.is_none() {
            let message = "the mass of the spring is unknown: use a coil whose material has a density_kg_per_m3, or omit \
                           spring_mass";
            return Err(SpecError::about(source, "spring_mass", message));
        }
        if let Some(cable) = parameters.cable {
            let cord = Cord::through(cable, &parameters.ends).ok_or_else(|| {
                let message = format!(
                    "a cable of {} m under {} N would be {:.3} m long without tension (stiffness {} N/m): lower tension_n or \
                     raise stiffness_n_per_m",
                    cable.length_m,
                    cable.tension_n,
                    cable.length_m - cable.tension_n / cable.stiffness_n_per_m,
                    cable.stiffness_n_per_m
                );
                SpecError::about(source, "cable", message)
            })?;
            self.cords.push(cord);
        }
        let end_m = parameters.spring.end_length_m()?;
        let ends = parameters.ends.at_active_coils(end_m);
        self.springs.push(SpringMount { design, segments: parameters.segments, ends, wire_mass_kg });
        Ok(())
    }

    /// The mount in which a pulled spring gets as many segments as its pull needs.
    ///
    /// The mass that a linkage supports must not depend on the number of segments.
    pub fn refined(mut self) -> Self {
        self.refines = true;
        self
    }

    /// The options of the linkage.
    pub fn options(&self) -> LinkageOptions {
        self.options
    }

    /// The head.
    pub fn body(&self) -> &Body {
        self.body
    }

    /// Whether the linkage is a single spring.
    pub fn is_one_spring(&self) -> bool {
        self.start.is_none()
    }

    /// The equilibrium of the undamped head with `weight` times the real weight: law, pose and stiffness.
    ///
    /// The stiffness is that of [`Statics::find_equilibrium`]. A single spring carries the component along the spring of this
    /// weight and of half of its own wire. With several elements, the load of each coil is iterated until it equals the load in
    /// equilibrium; a spring given by a stiffness matrix carries an equal fraction of the weight.
    pub fn equilibrium(&self, weight: f64) -> Result<(ForceLaw, Pose, Matrix6), NoEquilibrium> {
        let gravity_in_base = gravity_in_world();
        let fraction = 1.0 / self.springs.len().max(1) as f64;
        let even = self.springs.iter().map(|spring| {
            let carried_kg = weight * self.body.mass_kg * fraction + 0.5 * spring.wire_mass_kg.unwrap_or(0.0);
            -(spring.ends.base_from_foot.rotation.inverse() * gravity_in_base).z * carried_kg
        });
        let mut loads_n: Vec<f64> = even.collect();
        let load_is_known = self.is_one_spring() && self.cords.is_empty();
        let tolerance_n = 1e-6 * self.body.mass_kg * gravity_in_base.norm();
        for _ in 0..MAX_ITERATIONS {
            let mut law = self.law(&loads_n)?;
            let scale_m = if self.is_one_spring() { law.springs[0].spring.length_m() } else { ROTATION_LENGTH_M };
            let statics = Statics { law: &law, body: self.body, gravity_in_base, weight, scale_m };
            let start = match &self.start {
                None => self.on_straight_spring(&law),
                Some(start) => statics.minimise_energy(start)?,
            };
            let (rest, stiffness) = statics.find_equilibrium(&start)?;
            let mut change_n = 0.0_f64;
            for ((load_n, mount), mounted) in loads_n.iter_mut().zip(&self.springs).zip(&law.springs) {
                if matches!(mount.design, SpringDesign::Coil(_)) && !load_is_known {
                    let before_n = std::mem::replace(load_n, mounted.load_n(&rest)?);
                    change_n = change_n.max((before_n - *load_n).abs());
                }
            }
            if change_n <= tolerance_n {
                self.check_loads(&loads_n)?;
                self.set_reference(&mut law, &rest);
                return Ok((law, rest, stiffness));
            }
        }
        Err(NoEquilibrium::Unstable)
    }

    /// Checks that the loads are within the range of the force laws of the coils.
    fn check_loads(&self, loads_n: &[f64]) -> Result<(), ElasticityError> {
        self.springs.iter().zip(loads_n).try_for_each(|(spring, load_n)| match &spring.design {
            SpringDesign::Coil(coil) => check_buckling(coil, *load_n),
            SpringDesign::Stiffness { .. } => Ok(()),
        })
    }

    fn on_straight_spring(&self, law: &ForceLaw) -> Pose {
        let mounted = &law.springs[0];
        mounted.ends.base_from_foot * mounted.spring.base_from_top_at_rest() * mounted.ends.head_from_top.inverse()
    }

    /// The force law for given axial loads of the springs.
    ///
    /// For several elements the reference frames are preliminary (at the start pose).
    fn law(&self, loads_n: &[f64]) -> Result<ForceLaw, NoEquilibrium> {
        let mut springs = Vec::new();
        for (mount, load_n) in self.springs.iter().zip(loads_n) {
            springs.push(match mount.loaded(*load_n, mount.segments) {
                Err(ElasticityError::TooFewSegments { needed, .. }) if self.refines => mount.loaded(*load_n, needed)?,
                loaded => loaded?,
            });
        }
        let reference = match springs.first() {
            Some(only) if self.is_one_spring() => only.ends,
            _ => self.frames_in_centre(&self.start.unwrap_or_default()),
        };
        Ok(ForceLaw {
            springs,
            cords: self.cords.clone(),
            floats: self.floats.clone(),
            joint: self.joint,
            reference,
            damping: Matrix6::zeros(),
            hold: None,
            end_stop: None,
        })
    }

    fn set_reference(&self, law: &mut ForceLaw, rest: &Pose) {
        if !self.is_one_spring() {
            law.reference = self.frames_in_centre(rest);
        }
    }

    /// Two frames in the centre of mass that coincide with the head at a pose, parallel to the base's axes.
    fn frames_in_centre(&self, base_from_head: &Pose) -> EndFrames {
        let centre = self.body.centre_of_mass_in_head;
        let centre_in_base = base_from_head * nalgebra::Point3::from(centre);
        EndFrames {
            base_from_foot: Pose::from_parts(centre_in_base.coords.into(), Rotation::identity()),
            head_from_top: Pose::from_parts(centre.into(), base_from_head.rotation.inverse()),
        }
    }
}

impl SpringMount {
    fn loaded(&self, load_n: f64, segments: usize) -> Result<MountedSpring, ElasticityError> {
        let spring = self.design.loaded_spring(load_n, segments)?;
        let mass = match (&self.design, self.wire_mass_kg) {
            (SpringDesign::Coil(coil), Some(mass_kg)) => {
                Some(WireMass::new(mass_kg, 0.5 * coil.coil_diameter_m(), spring.length_m()))
            }
            _ => None,
        };
        let coil = match &self.design {
            SpringDesign::Coil(coil) => Some(*coil),
            SpringDesign::Stiffness { .. } => None,
        };
        Ok(MountedSpring { spring, ends: self.ends, mass, coil })
    }
}
