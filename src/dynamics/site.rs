//! A linkage as its spec has it, before any load; and the head at rest in it.

use super::actuated::Actuated;
use super::body::Body;
use super::cord::Cord;
use super::elements::{CableSpec, ElementSpec, SpringElementSpec, SpringMassSpec};
use super::float::Float;
use super::joint::UniversalJoint;
use super::law::Law;
use super::mounted::{MountedSpring, WireMass};
use super::push::Ends;
use super::spec::{DampingSpec, EndStopSpec, HoldSpec, LinkageSpec};
use super::statics::{Statics, Unrest};
use crate::elasticity::{Matrix6, SpringDesign, SpringSpec};
use crate::geometry::{Pose, Rotation, gravity_in_world};
use crate::spec::{Source, SpecError};

/// What holds a head, before any load.
pub(super) enum Mount<'a> {
    /// Nothing gives: `base_from_head`.
    Rigid(Pose),
    /// A motor turns the head.
    Actuated(Actuated),
    /// Something gives.
    Gives(Site<'a>),
}

/// What a linkage that gives is built from.
pub(super) struct Site<'a> {
    springs: Vec<SpringSite>,
    cords: Vec<Cord>,
    floats: Vec<Float>,
    joint: Option<UniversalJoint>,
    /// Where the head is let down from; `None` for one spring, on whose straight top it is put.
    start: Option<Pose>,
    body: &'a Body,
    manner: Manner,
}

/// What is said of a linkage as a whole.
#[derive(Clone, Copy)]
pub(super) struct Manner {
    pub damping_ratio: DampingSpec,
    pub end_stop: Option<EndStopSpec>,
    pub hold: Option<HoldSpec>,
}

/// A spring before any load, and where it is fastened.
struct SpringSite {
    design: SpringDesign,
    segments: usize,
    ends: Ends,
    wire_mass_kg: Option<f64>,
}

/// A spring as either kind of linkage writes it.
struct Written<'a> {
    spring: &'a SpringSpec,
    segments: usize,
    ends: Ends,
    mass: SpringMassSpec,
    cable: Option<&'a CableSpec>,
}

/// Rounds in which the springs' loads are found from the rest that they lead to.
const MOST_ROUNDS: usize = 20;

/// Scale of a suspension, on which a shift of it counts as a turn by one radian, m.
const SCALE_M: f64 = 0.1;

impl<'a> Mount<'a> {
    /// The mount of a linkage.
    ///
    /// # Errors
    /// When an element's numbers are none, or there are too few or too many elements.
    pub fn of(linkage: &LinkageSpec, body: &'a Body, source: &Source) -> Result<Self, SpecError> {
        let (damping_ratio, end_stop, hold) = match linkage {
            LinkageSpec::Rigid { base_from_head } => return Ok(Mount::Rigid(base_from_head.pose())),
            LinkageSpec::Actuated { base_from_head, motor } => {
                return Ok(Mount::Actuated(Actuated::new(base_from_head, motor, source)?));
            }
            LinkageSpec::Spring { damping_ratio, end_stop, hold, .. }
            | LinkageSpec::Suspension { damping_ratio, end_stop, hold, .. } => (*damping_ratio, *end_stop, *hold),
        };
        let manner = Manner { damping_ratio, end_stop, hold };
        let mut site = Site { springs: vec![], cords: vec![], floats: vec![], joint: None, start: None, body, manner };
        match linkage {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => {}
            LinkageSpec::Spring {
                spring, segments, base_from_spring, head_from_spring, spring_mass, cable, ..
            } => {
                let ends = Ends { base_from_foot: base_from_spring.pose(), head_from_top: head_from_spring.pose() };
                let written = Written { spring, segments: *segments, ends, mass: *spring_mass, cable: cable.as_ref() };
                site.add_spring(&written, source)?;
            }
            LinkageSpec::Suspension { elements, base_from_head, .. } => {
                if elements.is_empty() {
                    let message = "a suspension has at least one element: a spring, cord, float or universal_joint";
                    return Err(SpecError::about(source, "elements", message));
                }
                elements.iter().try_for_each(|element| site.add(element, source))?;
                site.start = Some(site.joint.map_or(base_from_head.pose(), |joint| joint.straight()));
            }
        }
        Ok(Mount::Gives(site))
    }
}

impl Site<'_> {
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
                let ends = Ends { base_from_foot: base_from_spring.pose(), head_from_top: head_from_spring.pose() };
                let written = Written { spring, segments: *segments, ends, mass: *spring_mass, cable: cable.as_ref() };
                self.add_spring(&written, source)?;
            }
            ElementSpec::Cord(cord) => self.cords.push(Cord::of(cord)),
            ElementSpec::Float(float) => self.floats.push(Float::of(float)),
            ElementSpec::UniversalJoint(joint) => {
                if self.joint.replace(UniversalJoint::of(joint)).is_some() {
                    let message = "a suspension has at most one universal_joint: a second leaves the head no motion";
                    return Err(SpecError::about(source, "universal_joint", message));
                }
            }
        }
        Ok(())
    }

    fn add_spring(&mut self, written: &Written<'_>, source: &Source) -> Result<(), SpecError> {
        let refused = |error: &dyn std::fmt::Display| SpecError::about(source, "spring", error.to_string());
        let design = written.spring.design().map_err(|error| refused(&error))?;
        let wire_mass_kg = match written.mass {
            SpringMassSpec::Neglected => None,
            SpringMassSpec::Included => {
                let mass_kg = written.spring.wire_mass_kg().map_err(|error| refused(&error))?;
                Some(mass_kg.ok_or_else(|| {
                    let message = "the spring's own mass is not known: give a coil whose material has a \
                                   density_kg_per_m3, or leave spring_mass out";
                    SpecError::about(source, "spring_mass", message)
                })?)
            }
        };
        if let Some(cable) = written.cable {
            let cord = Cord::through(cable, &written.ends).ok_or_else(|| {
                let message = format!(
                    "a cable of {} m under {} N would be {:.3} m long without its tension, by its stiffness of {} N/m",
                    cable.length_m,
                    cable.tension_n,
                    cable.length_m - cable.tension_n / cable.stiffness_n_per_m,
                    cable.stiffness_n_per_m
                );
                SpecError::about(source, "cable", message)
            })?;
            self.cords.push(cord);
        }
        self.springs.push(SpringSite { design, segments: written.segments, ends: written.ends, wire_mass_kg });
        Ok(())
    }

    /// What is said of the linkage as a whole.
    pub fn manner(&self) -> Manner {
        self.manner
    }

    /// The head.
    pub fn body(&self) -> &Body {
        self.body
    }

    /// Whether one spring alone holds the head up.
    pub fn is_one_spring(&self) -> bool {
        self.start.is_none()
    }

    /// The undamped head at rest with `weight` times its weight, with its stiffness (see [`Statics::settle`]).
    ///
    /// One spring carries the weight's part along it. Of several elements each spring's load is the one that it is
    /// found to carry at rest; a spring known by its stiffness has the load of an even share.
    pub fn at_rest(&self, weight: f64) -> Result<(Law, Pose, Matrix6), Unrest> {
        let gravity_in_base = gravity_in_world();
        let weight_n = gravity_in_base * (weight * self.body.mass_kg);
        let share = 1.0 / self.springs.len().max(1) as f64;
        let even = self.springs.iter().map(|s| -(s.ends.base_from_foot.rotation.inverse() * weight_n).z * share);
        let mut loads_n: Vec<f64> = even.collect();
        let is_alone = self.is_one_spring() && self.cords.is_empty() && self.springs.iter().all(SpringSite::is_light);
        let tolerance_n = 1e-6 * self.body.mass_kg * gravity_in_base.norm();
        for _ in 0..MOST_ROUNDS {
            let mut law = self.law(&loads_n)?;
            let scale_m = if self.is_one_spring() { law.springs[0].spring.length_m() } else { SCALE_M };
            let statics = Statics { law: &law, body: self.body, gravity_in_base, weight, scale_m };
            let start = match &self.start {
                None => self.on_straight_spring(&law),
                Some(start) => statics.let_down(start)?,
            };
            let (rest, stiffness) = statics.settle(&start)?;
            let mut change_n = 0.0_f64;
            for ((load_n, site), mounted) in loads_n.iter_mut().zip(&self.springs).zip(&law.springs) {
                if matches!(site.design, SpringDesign::Coil(_)) && !is_alone {
                    let before_n = std::mem::replace(load_n, mounted.load_n(&rest)?);
                    change_n = change_n.max((before_n - *load_n).abs());
                }
            }
            if change_n <= tolerance_n {
                self.seat(&mut law, &rest);
                return Ok((law, rest, stiffness));
            }
        }
        Err(Unrest::Falls)
    }

    fn on_straight_spring(&self, law: &Law) -> Pose {
        let mounted = &law.springs[0];
        let straight = Pose::translation(0.0, 0.0, mounted.spring.length_m());
        mounted.ends.base_from_foot * straight * mounted.ends.head_from_top.inverse()
    }

    /// The law under given loads on the springs; of several elements its seat is nowhere yet.
    fn law(&self, loads_n: &[f64]) -> Result<Law, Unrest> {
        let mut springs = Vec::new();
        for (site, load_n) in self.springs.iter().zip(loads_n) {
            springs.push(site.under(*load_n)?);
        }
        let seat = match springs.first() {
            Some(only) if self.is_one_spring() => only.ends,
            _ => self.frames_in_centre(&self.start.unwrap_or_default()),
        };
        Ok(Law {
            springs,
            cords: self.cords.clone(),
            floats: self.floats.clone(),
            joint: self.joint,
            seat,
            damping: Matrix6::zeros(),
            hold: None,
            end_stop: None,
        })
    }

    fn seat(&self, law: &mut Law, rest: &Pose) {
        if !self.is_one_spring() {
            law.seat = self.frames_in_centre(rest);
        }
    }

    /// Two frames in the centre of mass that agree with the head at a pose, their axes those of the base.
    fn frames_in_centre(&self, base_from_head: &Pose) -> Ends {
        let centre = self.body.centre_of_mass_in_head;
        let place = base_from_head * nalgebra::Point3::from(centre);
        Ends {
            base_from_foot: Pose::from_parts(place.coords.into(), Rotation::identity()),
            head_from_top: Pose::from_parts(centre.into(), base_from_head.rotation.inverse()),
        }
    }
}

impl SpringSite {
    fn is_light(&self) -> bool {
        self.wire_mass_kg.is_none()
    }

    fn under(&self, load_n: f64) -> Result<MountedSpring, Unrest> {
        let spring = self.design.law(load_n, self.segments)?;
        let mass = match (&self.design, self.wire_mass_kg) {
            (SpringDesign::Coil(coil), Some(mass_kg)) => {
                Some(WireMass::new(mass_kg, 0.5 * coil.coil_diameter_m(), spring.length_m()))
            }
            _ => None,
        };
        Ok(MountedSpring { spring, ends: self.ends, mass })
    }
}
