//! A head as it is written: `specs/heads/NAME.ron`.

use super::actuated::MotorSpec;
use super::carrier::CarrierSpec;
use super::elements::{CableSpec, ElementSpec, SpringMassSpec};
use crate::elasticity::SpringSpec;
use crate::geometry::{Pose, Vector, from_roll_pitch_yaw};
use crate::spec::{Kind, Source, SpecError, checked, find, parse};
use serde::{Deserialize, Serialize};

/// A head, and what carries it.
///
/// The frame `head` is where the spec puts it: a sane choice has its origin at the laser's optical centre, x forward, y
/// left, z up along the spring.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct HeadSpec {
    /// What the head is made of, and what is fastened to it.
    pub parts: Vec<PartSpec>,
    /// Pose of the lidar in the head.
    pub head_from_laser: PlacementSpec,
    /// Pose of the IMU in the head.
    pub head_from_imu: PlacementSpec,
    /// What holds the head on the base.
    pub linkage: LinkageSpec,
    /// What of its carrier the laser may see, fixed to the base: an operator, a handle, a cart.
    #[serde(default)]
    pub carrier: Vec<CarrierSpec>,
}

/// Finds and parses the head called `name`: a path, or a name in the library. The source comes with it, for errors of
/// [`HeadModel::new`](super::HeadModel::new).
///
/// # Errors
/// When there is none, or it is wrong.
pub fn load(name: &str) -> Result<(HeadSpec, Source), SpecError> {
    let source = find(Kind::Head, name)?;
    Ok((parse(&source)?, source))
}

/// A part of the head: a rigid body.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum PartSpec {
    /// A homogeneous block, its edges along the head's axes.
    Block {
        /// What it is.
        name: String,
        /// Mass, kg.
        #[serde(with = "checked::Positive")]
        mass_kg: f64,
        /// Edges along x, y, z, m.
        #[serde(with = "checked::PositiveArray::<3>")]
        size_m: [f64; 3],
        /// Its centre in the head, m.
        #[serde(with = "checked::FiniteArray::<3>")]
        centre_m: [f64; 3],
    },
    /// A body whose mass properties are known.
    Body {
        /// What it is.
        name: String,
        /// Mass, kg.
        #[serde(with = "checked::Positive")]
        mass_kg: f64,
        /// Its centre of mass in the head, m.
        #[serde(with = "checked::FiniteArray::<3>")]
        centre_of_mass_m: [f64; 3],
        /// Its inertia about its centre of mass, in the head's axes.
        inertia_kg_m2: InertiaSpec,
    },
}

/// A tensor of inertia; products are entries of the tensor, so `xy` is minus the integral of x y.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct InertiaSpec {
    /// About x, kg m^2.
    #[serde(with = "checked::Positive")]
    pub xx: f64,
    /// About y, kg m^2.
    #[serde(with = "checked::Positive")]
    pub yy: f64,
    /// About z, kg m^2.
    #[serde(with = "checked::Positive")]
    pub zz: f64,
    /// Product, kg m^2.
    #[serde(default, with = "checked::Finite")]
    pub xy: f64,
    /// Product, kg m^2.
    #[serde(default, with = "checked::Finite")]
    pub xz: f64,
    /// Product, kg m^2.
    #[serde(default, with = "checked::Finite")]
    pub yz: f64,
}

/// Where a frame sits in another.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlacementSpec {
    /// Its origin, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub position_m: [f64; 3],
    /// Its roll, pitch and yaw (about fixed x, then y, then z), degrees.
    #[serde(default, with = "checked::FiniteArray::<3>")]
    pub roll_pitch_yaw_deg: [f64; 3],
}

impl PlacementSpec {
    /// The pose it describes.
    pub fn pose(&self) -> Pose {
        let [roll, pitch, yaw] = self.roll_pitch_yaw_deg.map(f64::to_radians);
        Pose::from_parts(Vector::from(self.position_m).into(), from_roll_pitch_yaw(roll, pitch, yaw))
    }
}

/// What holds the head on the base.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "there is one a head")]
pub enum LinkageSpec {
    /// Nothing moves: the head is screwed to the base.
    Rigid {
        /// Pose of the head in the base.
        base_from_head: PlacementSpec,
    },
    /// A motor turns the head, as stiff as a screw.
    Actuated {
        /// Pose of the head in the base before the motor starts.
        base_from_head: PlacementSpec,
        /// The motor.
        motor: MotorSpec,
    },
    /// One spring.
    Spring {
        /// The spring.
        spring: SpringSpec,
        /// Pieces the spring is cut into for large swings; 1 is fastest.
        segments: usize,
        /// Pose of the spring's foot in the base; z points along the spring.
        base_from_spring: PlacementSpec,
        /// Pose of the spring's top in the head.
        head_from_spring: PlacementSpec,
        /// What becomes of the spring's own mass.
        #[serde(default)]
        spring_mass: SpringMassSpec,
        /// A cable through the spring.
        #[serde(default)]
        cable: Option<CableSpec>,
        /// How its modes are damped.
        damping_ratio: DampingSpec,
        /// What stops the head when it swings too far.
        #[serde(default)]
        end_stop: Option<EndStopSpec>,
        /// The hand that holds the head when the motion says so.
        #[serde(default)]
        hold: Option<HoldSpec>,
    },
    /// Several springs, cords, floats, a joint, side by side.
    Suspension {
        /// What holds the head.
        elements: Vec<ElementSpec>,
        /// Pose of the head in the base near which it rests.
        base_from_head: PlacementSpec,
        /// How its modes are damped, beside what its elements take.
        damping_ratio: DampingSpec,
        /// What stops the head when it swings too far.
        #[serde(default)]
        end_stop: Option<EndStopSpec>,
        /// The hand that holds the head when the motion says so.
        #[serde(default)]
        hold: Option<HoldSpec>,
    },
}

impl LinkageSpec {
    /// The damping ratios of its modes; `None` for one that has none.
    pub fn damping_ratio_mut(&mut self) -> Option<&mut DampingSpec> {
        match self {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => None,
            LinkageSpec::Spring { damping_ratio, .. } | LinkageSpec::Suspension { damping_ratio, .. } => {
                Some(damping_ratio)
            }
        }
    }
}

/// Damping ratios of the six modes about rest.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DampingSpec {
    /// Of the two slowest bending modes, in which the head nods and rolls.
    #[serde(with = "checked::NonNegative")]
    pub rocking: f64,
    /// Of the other two bending modes, in which it shifts sideways against its turn.
    #[serde(with = "checked::NonNegative")]
    pub sway: f64,
    /// Of the mode along the spring.
    #[serde(with = "checked::NonNegative")]
    pub bounce: f64,
    /// Of the mode about the spring.
    #[serde(with = "checked::NonNegative")]
    pub yaw: f64,
}

/// A stop against which the head comes when its axis leans too far: the axis of a spring's top from its foot's, or, on
/// several elements, the head's from where it rests.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EndStopSpec {
    /// Lean at which it begins to press, degrees.
    #[serde(with = "checked::Positive")]
    pub angle_deg: f64,
    /// Torque for each radian beyond, N m/rad.
    #[serde(with = "checked::Positive")]
    pub stiffness_nm_per_rad: f64,
    /// Torque for each rad/s of lean while it presses, N m s/rad.
    #[serde(with = "checked::NonNegative")]
    pub damping_nm_s_per_rad: f64,
}

/// A hand that holds the head: a spring and a damper towards the head's rest, as firm as the motion says at each
/// instant.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct HoldSpec {
    /// Frequency that the head would have in a firm hand alone, without spring and gravity, Hz.
    #[serde(with = "checked::Positive")]
    pub frequency_hz: f64,
    /// Damping ratio that it would have in it.
    #[serde(with = "checked::NonNegative")]
    pub damping_ratio: f64,
}
