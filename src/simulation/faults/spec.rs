//! Data of a faults file, `specs/faults/NAME.ron`.

use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;

/// Faults of the sensors and of their delivery, applied in the order listed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultsSpec {
    /// The faults, applied in order: each acts on the output of the previous ones.
    #[serde(default)]
    pub faults: Vec<FaultSpec>,
}

/// One fault: sensor, interval, and effect.
///
/// Times are true seconds since the start of the run. A measurement belongs to the time at which it is complete: the
/// end of an IMU sample's interval, the end of a lidar scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultSpec {
    /// The sensor whose measurements are affected.
    pub sensor: FaultySensor,
    /// Start of the fault, s; the start of the run by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// End of the fault, s; the end of the run by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
    /// Period at which the fault recurs, s, counted from `from_s`; needs `lasts_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every_s: Option<f64>,
    /// Duration of each recurrence, s; needs `every_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lasts_s: Option<f64>,
    /// What happens.
    pub fault: FaultKind,
}

/// The sensor that a fault affects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultySensor {
    /// The inertial measurement unit of the head.
    Imu,
    /// The lidar.
    Lidar,
    /// Both, each with its own random draws.
    Both,
}

/// What happens to measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum FaultKind {
    /// Messages are lost at random.
    Drop {
        /// Probability that a message is lost, 0 to 1.
        #[serde(with = "checked::Fraction")]
        share: f64,
    },
    /// All messages of the interval are lost.
    Gap,
    /// The sensor starts late or ends early.
    Cut {
        /// Time of the first measurement, s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        start_s: Option<f64>,
        /// Time of the last measurement, s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        end_s: Option<f64>,
    },
    /// Keeps only the messages nearest to given arrival times.
    Thin {
        /// Arrival times, s after the start, in order.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        arrivals_s: Option<Vec<f64>>,
        /// Text file of arrival times, one a line, `#` before comments; a relative path is from the spec's folder.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<String>,
        /// Period at which the arrival times repeat, s; without it nothing arrives after the last one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        repeat_s: Option<f64>,
    },
    /// Stamps and log times are late by an exponentially distributed delay. Order is kept, as in a queue: a message
    /// waits for the one before it.
    Delay {
        /// Mean of the distribution, s; at most 2.
        #[serde(with = "checked::Positive")]
        mean_s: f64,
    },
    /// Messages arrive in groups, stamped at the arrival of the group's last.
    Burst {
        /// Messages in a group, 2 to 1000.
        size: usize,
        /// Time between the stamps within a group, us; 0 for equal stamps.
        #[serde(default, with = "checked::NonNegative")]
        spacing_us: f64,
    },
    /// The IMU saturates below the limits of the data sheet. The noise model that is published with the recording
    /// keeps those of the data sheet.
    Clip {
        /// Maximum rate on an axis, rad/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_rad_per_s: Option<f64>,
        /// Maximum rate on an axis, deg/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_deg_per_s: Option<f64>,
        /// Maximum specific force on an axis, m/s^2.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        accel_m_per_s2: Option<f64>,
    },
    /// The last measurement before the interval is repeated with new stamps.
    Freeze,
    /// Every beam of the lidar returns the same range.
    ConstantRange {
        /// That range, m.
        #[serde(with = "checked::Positive")]
        range_m: f64,
    },
    /// Single samples of the IMU are replaced.
    Spike {
        /// Rate in a bad sample, rad/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_rad_per_s: Option<[f64; 3]>,
        /// Rate in a bad sample, deg/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_deg_per_s: Option<[f64; 3]>,
        /// Specific force in a bad sample, m/s^2.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        accel_m_per_s2: Option<[f64; 3]>,
        /// When, s: the first sample at or after each of these times is bad.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        times_s: Option<Vec<f64>>,
        /// How many at random times within the interval; instead of `times_s`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        count: Option<u32>,
    },
    /// The IMU's bias is larger by a constant from `from_s` on.
    BiasStep {
        /// Step of the gyroscope's bias, rad/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_rad_per_s: Option<[f64; 3]>,
        /// Step of the gyroscope's bias, deg/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_deg_per_s: Option<[f64; 3]>,
        /// Step of the accelerometer's bias, m/s^2.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        accel_m_per_s2: Option<[f64; 3]>,
    },
    /// Beams without a return are encoded in another way in `sensor_msgs/LaserScan`.
    Misses {
        /// The encoding.
        encoding: MissEncoding,
    },
    /// The sensor's clock jumps at `from_s`: all later stamps are off by the jump.
    ClockJump {
        /// The jump, s; positive is forward.
        #[serde(with = "checked::Finite")]
        jump_s: f64,
    },
    /// The sensor's clock is off by a constant from the start.
    ClockOffset {
        /// The offset, s; positive is ahead.
        #[serde(with = "checked::Finite")]
        offset_s: f64,
    },
    /// Messages are delivered twice.
    Duplicate {
        /// Probability that a message is repeated, 0 to 1.
        #[serde(with = "checked::Fraction")]
        share: f64,
    },
    /// Neighbouring messages are delivered in the wrong order; their stamps stay.
    Reorder {
        /// Probability that a message is exchanged with the next one, 0 to 1.
        #[serde(with = "checked::Fraction")]
        share: f64,
    },
    /// The IMU's driver uses other conventions than REP-145.
    Axes {
        /// Whether the sign of the rates is inverted.
        #[serde(default)]
        negate_gyro: bool,
        /// Whether the sign of the specific forces is inverted.
        #[serde(default)]
        negate_accel: bool,
        /// Whether gravity is removed, by the true attitude.
        #[serde(default)]
        remove_gravity: bool,
        /// Factor on rates, e.g. 57.29578 for degrees; 1 by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro_scale: Option<f64>,
        /// Factor on specific forces, e.g. 0.101972 for units of gravity; 1 by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        accel_scale: Option<f64>,
    },
    /// The published calibration (`/tf_static`) is wrong; the mounting of the sensor does not change.
    Extrinsics {
        /// Error of the sensor's position in the head, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        position_m: Option<[f64; 3]>,
        /// Error of the attitude about the sensor axes, degrees.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        roll_pitch_yaw_deg: Option<[f64; 3]>,
    },
}

/// Encoding of a beam without a return. The simulated lidar uses `inf` (REP-117).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MissEncoding {
    /// The maximum range.
    RangeMax,
    /// One metre above the maximum range.
    AboveMax,
    /// Zero.
    Zero,
    /// Not a number.
    Nan,
    /// Infinity.
    Inf,
    /// Minus infinity, which REP-117 reserves for objects below the minimum range.
    MinusInf,
}

impl FaultKind {
    /// Name in a spec.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Drop { .. } => "drop",
            Self::Gap => "gap",
            Self::Cut { .. } => "cut",
            Self::Thin { .. } => "thin",
            Self::Delay { .. } => "delay",
            Self::Burst { .. } => "burst",
            Self::Clip { .. } => "clip",
            Self::Freeze => "freeze",
            Self::ConstantRange { .. } => "constant_range",
            Self::Spike { .. } => "spike",
            Self::BiasStep { .. } => "bias_step",
            Self::Misses { .. } => "misses",
            Self::ClockJump { .. } => "clock_jump",
            Self::ClockOffset { .. } => "clock_offset",
            Self::Duplicate { .. } => "duplicate",
            Self::Reorder { .. } => "reorder",
            Self::Axes { .. } => "axes",
            Self::Extrinsics { .. } => "extrinsics",
        }
    }
}
