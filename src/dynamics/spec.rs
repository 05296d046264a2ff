//! Spec of a head: `specs/heads/NAME.ron`.

use super::actuated::MotorSpec;
use super::carrier::CarrierSpec;
use super::elements::{CableSpec, ElementSpec, SpringMassSpec};
pub use super::placement::PlacementSpec;
use serde::{Deserialize, Serialize};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, checked, find, name_from};
use zsim_elasticity::SpringSpec;

/// A head, the linkage to the base, and the carrier.
///
/// The spec chooses the frame `head` freely. Recommended: origin at the laser's optical centre, x forward, y left, z up
/// along the spring.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct HeadSpec {
    /// Rigid parts of the head: sensors, brackets, plates.
    pub parts: Vec<PartSpec>,
    /// Pose of the lidar in the head.
    #[serde(default)]
    pub head_from_laser: PlacementSpec,
    /// Pose of the IMU in the head.
    pub head_from_imu: PlacementSpec,
    /// The linkage between base and head.
    pub linkage: LinkageSpec,
    /// Parts of the carrier that the laser can hit, fixed to the base: an operator, a handle, a cart.
    #[serde(default)]
    pub carrier: Vec<CarrierSpec>,
}

/// Finds and parses the head called `name`: a path, or a name in the library.
///
/// The source is returned too, for the error messages of [`HeadModel::new`](super::HeadModel::new).
///
/// # Errors
/// When there is no such head, or the file is invalid.
pub fn load(name: &str) -> Result<(HeadSpec, Source), SpecError> {
    let source = find(Kind::Head, name)?;
    Ok((HeadSpec::read(&source)?, source))
}

impl HeadSpec {
    /// Parses `source`; files of springs are relative to its folder.
    ///
    /// # Errors
    /// If the text is invalid.
    pub fn read(source: &Source) -> Result<Self, SpecError> {
        Ok(Self::parse(source)?.with_files_of(source))
    }

    /// The head with the paths of the spring files that are in the folder of `source`.
    #[must_use]
    pub fn with_files_of(mut self, source: &Source) -> Self {
        let springs: Vec<&mut SpringSpec> = match &mut self.linkage {
            LinkageSpec::Spring { spring, .. } => vec![spring],
            LinkageSpec::Suspension { elements, .. } => {
                let springs = elements.iter_mut().filter_map(|element| match element {
                    ElementSpec::Spring(mounted) => Some(&mut mounted.spring),
                    ElementSpec::Cord(_) | ElementSpec::Float(_) | ElementSpec::UniversalJoint(_) => None,
                });
                springs.collect()
            }
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => Vec::new(),
        };
        for spring in springs {
            if let SpringSpec::Named(name) = spring {
                *name = name_from(source, name);
            }
        }
        self
    }
}

/// A part of the head: a rigid body.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum PartSpec {
    /// A homogeneous block with edges parallel to the head's axes.
    Block {
        /// Name of the part; its number by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Mass, kg.
        #[serde(with = "checked::Positive")]
        mass_kg: f64,
        /// Edge lengths along x, y, z, m.
        #[serde(with = "checked::PositiveArray::<3>")]
        size_m: [f64; 3],
        /// Centre of the block in the head frame, m.
        #[serde(with = "checked::FiniteArray::<3>")]
        centre_m: [f64; 3],
    },
    /// A body with given mass properties.
    Body {
        /// Name of the part; its number by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Mass, kg.
        #[serde(with = "checked::Positive")]
        mass_kg: f64,
        /// Centre of mass in the head frame, m.
        #[serde(with = "checked::FiniteArray::<3>")]
        centre_of_mass_m: [f64; 3],
        /// Inertia tensor about the part's centre of mass, in the axes of the head.
        inertia_kg_m2: InertiaSpec,
    },
}

/// An inertia tensor; `xy`, `xz`, `yz` are tensor entries: `xy` is minus the integral of x y.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct InertiaSpec {
    /// Moment of inertia about x, kg m^2.
    #[serde(with = "checked::Positive")]
    pub xx: f64,
    /// Moment of inertia about y, kg m^2.
    #[serde(with = "checked::Positive")]
    pub yy: f64,
    /// Moment of inertia about z, kg m^2.
    #[serde(with = "checked::Positive")]
    pub zz: f64,
    /// Tensor entry xy, kg m^2.
    #[serde(default, with = "checked::Finite")]
    pub xy: f64,
    /// Tensor entry xz, kg m^2.
    #[serde(default, with = "checked::Finite")]
    pub xz: f64,
    /// Tensor entry yz, kg m^2.
    #[serde(default, with = "checked::Finite")]
    pub yz: f64,
}

/// The linkage between base and head.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "there is one a head")]
pub enum LinkageSpec {
    /// Rigid connection: the head is screwed to the base.
    Rigid {
        /// Pose of the head in the base.
        #[serde(default)]
        base_from_head: PlacementSpec,
    },
    /// A motor rotates the head along a given angle; it has no compliance.
    Actuated {
        /// Pose of the head in the base before the motor starts.
        #[serde(default)]
        base_from_head: PlacementSpec,
        /// Axis and motion of the motor.
        motor: MotorSpec,
    },
    /// A single spring.
    Spring {
        /// The spring: a coil, a stiffness matrix, or the name of a spring spec.
        spring: SpringSpec,
        /// Number of segments that model large deflections, 1 to 64; 1 is fastest.
        #[serde(default = "crate::usual::segments")]
        segments: usize,
        /// Pose of the spring's foot in the base; z points along the spring.
        #[serde(default)]
        base_from_spring: PlacementSpec,
        /// Pose of the spring's top in the head.
        head_from_spring: PlacementSpec,
        /// Whether the mass of the wire is modelled.
        #[serde(default)]
        spring_mass: SpringMassSpec,
        /// A cable through the spring, parallel to it.
        #[serde(default)]
        cable: Option<CableSpec>,
        /// Damping ratios of the modes.
        damping_ratio: DampingSpec,
        /// End stop that limits the tilt of the head.
        #[serde(default)]
        end_stop: Option<EndStopSpec>,
        /// Hand that holds the head while the base motion specifies a hold.
        #[serde(default)]
        hold: Option<HoldSpec>,
    },
    /// Several elements in parallel: springs, cords, floats, a joint.
    Suspension {
        /// The elements between base and head.
        elements: Vec<ElementSpec>,
        /// Approximate pose of the head in the base in equilibrium; start of the search for the equilibrium.
        #[serde(default)]
        base_from_head: PlacementSpec,
        /// Damping ratios of the modes, in addition to the dampers of the elements.
        damping_ratio: DampingSpec,
        /// End stop that limits the tilt of the head.
        #[serde(default)]
        end_stop: Option<EndStopSpec>,
        /// Hand that holds the head while the base motion specifies a hold.
        #[serde(default)]
        hold: Option<HoldSpec>,
    },
}

impl LinkageSpec {
    /// The damping ratios of the modes; `None` for a rigid or actuated mount.
    pub fn damping_ratio_mut(&mut self) -> Option<&mut DampingSpec> {
        match self {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => None,
            LinkageSpec::Spring { damping_ratio, .. } | LinkageSpec::Suspension { damping_ratio, .. } => {
                Some(damping_ratio)
            }
        }
    }
}

/// Damping ratios of the six modes about the equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DampingSpec {
    /// Damping ratio of the two slowest bending modes, in which the head pitches and rolls.
    #[serde(with = "checked::NonNegative")]
    pub rocking: f64,
    /// Damping ratio of the other two bending modes, in which the head shifts sideways and rotates against the shift.
    #[serde(with = "checked::NonNegative")]
    pub sway: f64,
    /// Damping ratio of the mode along the spring.
    #[serde(with = "checked::NonNegative")]
    pub bounce: f64,
    /// Damping ratio of the mode about the spring.
    #[serde(with = "checked::NonNegative")]
    pub yaw: f64,
}

/// An elastic end stop for the tilt of the head.
///
/// The tilt is the angle between the z axes of a single spring's foot and top, or, for several elements, the angle
/// between the head's present and equilibrium z axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EndStopSpec {
    /// Tilt at which the stop makes contact, degrees.
    #[serde(with = "checked::Positive")]
    pub angle_deg: f64,
    /// Stiffness beyond that tilt, N m/rad.
    #[serde(with = "checked::Positive")]
    pub stiffness_nm_per_rad: f64,
    /// Damping of the tilt rate during contact, N m s/rad.
    #[serde(default, with = "checked::NonNegative")]
    pub damping_nm_s_per_rad: f64,
}

/// A hand that holds the head: a spring and a damper towards the head's equilibrium pose.
///
/// The base motion sets the strength of the hold over time.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct HoldSpec {
    /// Natural frequency of the head with a firm hand as the only support (no spring, no gravity), Hz.
    #[serde(with = "checked::Positive")]
    pub frequency_hz: f64,
    /// Damping ratio of that oscillation.
    #[serde(with = "checked::NonNegative")]
    pub damping_ratio: f64,
}
