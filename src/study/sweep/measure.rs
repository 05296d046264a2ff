//! Measures: the figures that a sweep reports for each run.

use super::BaseSpec;
use serde::{Deserialize, Serialize};

/// A measure of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Position error of the open-loop estimate after rigid alignment, root mean square, m.
    PositionRmseM,
    /// Rotation error (angle) of the open-loop estimate after rigid alignment, root mean square, degrees.
    RotationRmseDeg,
    /// Position drift of the open-loop estimate, m/min.
    DriftMPerMin,
    /// Yaw drift of the open-loop estimate, degrees/min.
    YawDriftDegPerMin,
    /// Error of the estimated clock offset over the complete run including its start, root mean square, s.
    ClockRmseS,
    /// Absolute error of the estimated clock offset 30 s after the first estimate, s; the offset starts from 0.
    #[serde(rename = "clock_error_30s_s")]
    ClockError30S,
    /// The same after 120 s, s.
    #[serde(rename = "clock_error_120s_s")]
    ClockError120S,
    /// Position error of the base computed from the open-loop estimate of the head as if the link between them were rigid,
    /// after rigid alignment, root mean square, m.
    RigidLinkRmseM,
    /// Position error after loop closure and rigid alignment, root mean square, m. Loops are closed only if this measure
    /// or the next is requested.
    ClosedPositionRmseM,
    /// Ratio of that error to the information bound with an unknown map (`zsim bound --map unknown`), for runs of up to
    /// 300 s. The bound takes up to a minute for a recording of 150 s, which `wall_s` does not include.
    ErrorOverSlamBound,
    /// Integrity verdict on the estimate: 0 good, 1 degraded, 2 lost.
    Status,
    /// Position error of the final trajectory (loop-closed if that is requested) after rigid alignment over the first
    /// 20 s (half of a shorter run), root mean square, m.
    AlignedRmseM,
    /// Largest position error after the same alignment, m.
    LargestErrorM,
    /// Median of the 99 % bound on the aligned position error, m.
    #[serde(rename = "bound_m_99")]
    BoundM99,
    /// Fraction of the poses whose position error is within the bound.
    WithinBound,
    /// Ratio of bound to position error, median over the poses.
    BoundOverError,
    /// Length of the estimated path, from positions one second apart, m.
    WayM,
    /// Open loop aligned over the first 20 s: position error at the end over the length of the path.
    DriftOverPath,
    /// Standard deviation of the map's points about the true surfaces, along their normals, m.
    CloudSigmaM,
    /// Mean signed distance of the map's points to the true surfaces, m: positive where they are too near to the sensor.
    CloudBiasM,
    /// Ratio of that standard deviation to that of the same beams projected by the true trajectory; without timing errors.
    CloudOverTruth,
    /// Standard deviation of the map's points about the surfaces of the reference system's map, along their normals, m
    /// (Bosse, Zlot and Flick 2012, section IV-A). Both maps are aligned with the truth. It is missing if the reference
    /// system is lost.
    ReferenceSigmaM,
    /// Mean signed distance of the same points, m: positive where they are too near to the sensor.
    ReferenceBiasM,
    /// Position error of the reference system after rigid alignment, root mean square, m.
    ReferenceRmseM,
    /// Error of the estimated clock offset at the end of a run with timing errors, s.
    ClockErrorS,
    /// Fraction of the sphere of directions that the lidar observed.
    FractionSeen,
    /// Fraction of the sphere observed in one second, mean over the seconds.
    #[serde(rename = "fraction_seen_1s")]
    FractionSeen1S,
    /// Time until 90 % of `fraction_seen` was observed, s.
    CoveredS,
    /// Beams per steradian and second, mean over the observed part of the sphere.
    DensityPerSrS,
    /// Vertical field of view, degrees. In a journey: from the 2.5 % to the 97.5 % quantile of the forward beam's
    /// elevation. In closed form: twice the head's pitch amplitude.
    FieldOfViewDeg,
    /// Maximum angular rate on an axis of the gyroscope, degrees/s.
    RateDegPerS,
    /// 99 % quantile over time of the largest rate among the gyroscope's axes, degrees/s.
    RateP99DegPerS,
    /// Fraction of the time in which at least one axis of the gyroscope is saturated.
    Saturated,
    /// Fraction of the gyroscope's range above the maximum angular rate on an axis; negative if the rate exceeds the range.
    GyroRangeLeft,
    /// Time in which coils of the spring touch, s. A design should have none: the motion after a clash is approximate.
    CoilContactS,
    /// Frequency of the slowest mode, Hz.
    RockingHz,
    /// Peak gain, head over base: of the pitch rate in closed form, along or about the axis of a gain measurement.
    PeakGain,
    /// Static compression of the spring under the head's weight, mm.
    SagMm,
    /// Mass of the spring's active wire, g.
    SpringMassG,
    /// Maximum stress in the wire over the yield strength.
    StressShare,
    /// Margin of the wire's stress cycle by Goodman's line: over the mission of a spring search, else over 1000 hours of the
    /// shake. Above 1 the spring lasts as long.
    FatigueMargin,
    /// Computing time of the open loop on one thread over the length of the recording. Like the next two it is reported in
    /// `times.csv`, not in the table of results.
    OpenLoopTimeRatio,
    /// The same of the loop closure.
    ClosedLoopTimeRatio,
    /// Computing time of the run on its thread, s.
    WallS,
}

/// The computation that yields a measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// Estimation from a recording.
    Estimate,
    /// Estimation from a recording, only with timing errors.
    Map,
    /// Estimation from a recording, with or without timing errors.
    AnyMap,
    /// Estimation from a recording, the map of which is compared with the true surfaces; only without timing errors.
    Cloud,
    /// Estimation from two recordings, of a run and of its reference system.
    Reference,
    /// Simulation of the head's swing without ray casting.
    Swing,
    /// The closed form of the linearised head.
    ClosedForm,
    /// Simulation of the swing in a journey, else the closed form.
    SwingOrClosedForm,
    /// Measured computing time of an estimate.
    EstimateWallClock,
    /// Measured computing time of a run.
    WallClock,
}

impl Origin {
    /// Whether the measure needs a recording and an estimate.
    pub(super) fn is_estimate(self) -> bool {
        matches!(
            self,
            Self::Estimate | Self::Map | Self::AnyMap | Self::Cloud | Self::Reference | Self::EstimateWallClock
        )
    }
}

impl Measure {
    /// Every measure.
    pub const ALL: [Self; 44] = [
        Self::PositionRmseM,
        Self::RotationRmseDeg,
        Self::DriftMPerMin,
        Self::YawDriftDegPerMin,
        Self::ClockRmseS,
        Self::ClockError30S,
        Self::ClockError120S,
        Self::RigidLinkRmseM,
        Self::ClosedPositionRmseM,
        Self::ErrorOverSlamBound,
        Self::Status,
        Self::AlignedRmseM,
        Self::LargestErrorM,
        Self::BoundM99,
        Self::WithinBound,
        Self::BoundOverError,
        Self::WayM,
        Self::DriftOverPath,
        Self::CloudSigmaM,
        Self::CloudBiasM,
        Self::CloudOverTruth,
        Self::ReferenceSigmaM,
        Self::ReferenceBiasM,
        Self::ReferenceRmseM,
        Self::ClockErrorS,
        Self::FractionSeen,
        Self::FractionSeen1S,
        Self::CoveredS,
        Self::DensityPerSrS,
        Self::FieldOfViewDeg,
        Self::RateDegPerS,
        Self::RateP99DegPerS,
        Self::Saturated,
        Self::GyroRangeLeft,
        Self::CoilContactS,
        Self::RockingHz,
        Self::PeakGain,
        Self::SagMm,
        Self::SpringMassG,
        Self::StressShare,
        Self::FatigueMargin,
        Self::OpenLoopTimeRatio,
        Self::ClosedLoopTimeRatio,
        Self::WallS,
    ];

    /// Key in files, short name for tables, axis label, display unit, and factor from the key's unit to the display unit.
    fn names(self) -> (&'static str, &'static str, &'static str, &'static str, f64) {
        match self {
            Self::PositionRmseM => ("position_rmse_m", "position", "Position error, open loop, RMS (mm)", "mm", 1e3),
            Self::RotationRmseDeg => {
                ("rotation_rmse_deg", "rotation", "Rotation error, open loop, RMS (°)", "deg", 1.0)
            }
            Self::DriftMPerMin => ("drift_m_per_min", "drift", "Drift, open loop (mm/min)", "mm/min", 1e3),
            Self::YawDriftDegPerMin => {
                ("yaw_drift_deg_per_min", "yaw drift", "Yaw drift, open loop (°/min)", "deg/min", 1.0)
            }
            Self::ClockRmseS => ("clock_rmse_s", "clock", "Clock offset error, RMS (ms)", "ms", 1e3),
            Self::ClockError30S => ("clock_error_30s_s", "clock 30 s", "Clock offset error after 30 s (ms)", "ms", 1e3),
            Self::ClockError120S => {
                ("clock_error_120s_s", "clock 120 s", "Clock offset error after 120 s (ms)", "ms", 1e3)
            }
            Self::RigidLinkRmseM => {
                ("rigid_link_rmse_m", "rigid link", "Position error of the base, rigid link, RMS (mm)", "mm", 1e3)
            }
            Self::ClosedPositionRmseM => {
                ("closed_position_rmse_m", "closed loop", "Position error, closed loop, RMS (mm)", "mm", 1e3)
            }
            Self::ErrorOverSlamBound => {
                ("error_over_slam_bound", "error/CRLB", "Closed-loop error over information bound", "1", 1.0)
            }
            Self::Status => ("status", "status", "Verdict (0 good, 1 degraded, 2 lost)", "1", 1.0),
            Self::AlignedRmseM => {
                ("aligned_rmse_m", "aligned", "Position error, aligned over the first 20 s, RMS (mm)", "mm", 1e3)
            }
            Self::LargestErrorM => ("largest_error_m", "largest", "Largest position error (mm)", "mm", 1e3),
            Self::BoundM99 => ("bound_m_99", "bound", "99 % bound on the position error, median (mm)", "mm", 1e3),
            Self::WithinBound => ("within_bound", "within", "Poses within their bound (%)", "%", 1e2),
            Self::BoundOverError => ("bound_over_error", "bound/error", "99 % bound over error, median", "1", 1.0),
            Self::WayM => ("way_m", "path", "Length of the path (m)", "m", 1.0),
            Self::DriftOverPath => ("drift_over_path", "drift/path", "Drift over the length of the path (%)", "%", 1e2),
            Self::CloudSigmaM => ("cloud_sigma_m", "cloud", "Standard deviation of the cloud (mm)", "mm", 1e3),
            Self::CloudBiasM => ("cloud_bias_m", "cloud bias", "Bias of the cloud (mm)", "mm", 1e3),
            Self::CloudOverTruth => {
                ("cloud_over_truth", "cloud/truth", "Cloud sigma over that with the true trajectory", "1", 1.0)
            }
            Self::ReferenceSigmaM => {
                ("reference_sigma_m", "from reference", "Standard deviation from the reference cloud (mm)", "mm", 1e3)
            }
            Self::ReferenceBiasM => ("reference_bias_m", "reference bias", "Bias from the reference (mm)", "mm", 1e3),
            Self::ReferenceRmseM => {
                ("reference_rmse_m", "reference", "Position error of the reference, RMS (mm)", "mm", 1e3)
            }
            Self::ClockErrorS => ("clock_error_s", "clock error", "Clock offset error at the end (ms)", "ms", 1e3),
            Self::FractionSeen => ("fraction_seen", "coverage", "Observed fraction of the sphere (%)", "%", 1e2),
            Self::FractionSeen1S => ("fraction_seen_1s", "in 1 s", "Coverage in a second (%)", "%", 1e2),
            Self::CoveredS => ("covered_s", "cover time", "Time to 90 % of the coverage (s)", "s", 1.0),
            Self::DensityPerSrS => {
                ("density_per_sr_s", "density", "Beam density, mean of the observed part (1/sr/s)", "1/sr/s", 1.0)
            }
            Self::FieldOfViewDeg => {
                ("field_of_view_deg", "view", "Elevation range of the forward beam (°)", "deg", 1.0)
            }
            Self::RateDegPerS => ("rate_deg_per_s", "rate", "Maximum rate (°/s)", "deg/s", 1.0),
            Self::RateP99DegPerS => ("rate_p99_deg_per_s", "rate 99 %", "Rate, 99 % quantile (°/s)", "deg/s", 1.0),
            Self::Saturated => ("saturated", "saturated", "Time with a saturated gyroscope (%)", "%", 1e2),
            Self::GyroRangeLeft => ("gyro_range_left", "range left", "Range of the gyroscope left (%)", "%", 1e2),
            Self::CoilContactS => ("coil_contact_s", "contact", "Time with touching coils (s)", "s", 1.0),
            Self::RockingHz => ("rocking_hz", "rocking", "Rocking frequency (Hz)", "Hz", 1.0),
            Self::PeakGain => ("peak_gain", "gain", "Peak gain", "1", 1.0),
            Self::SagMm => ("sag_mm", "sag", "Static compression, negative for extension (mm)", "mm", 1.0),
            Self::SpringMassG => ("spring_mass_g", "mass", "Mass of the spring (g)", "g", 1.0),
            Self::StressShare => ("stress_share", "stress", "Stress over yield strength (%)", "%", 1e2),
            Self::FatigueMargin => ("fatigue_margin", "fatigue", "Margin of fatigue", "1", 1.0),
            Self::OpenLoopTimeRatio => {
                ("open_loop_time_ratio", "loop time", "Open-loop computing time over recording (%)", "%", 1e2)
            }
            Self::ClosedLoopTimeRatio => {
                ("closed_loop_time_ratio", "closure time", "Loop-closure computing time over recording (%)", "%", 1e2)
            }
            Self::WallS => ("wall_s", "time", "Computing time (s)", "s", 1.0),
        }
    }

    /// Key in files.
    pub fn key(self) -> &'static str {
        self.names().0
    }

    /// Short name for tables.
    pub fn short(self) -> &'static str {
        self.names().1
    }

    /// Label of a plot axis, with the display unit.
    pub(crate) fn label(self) -> &'static str {
        self.names().2
    }

    /// The label without the unit.
    pub(super) fn quantity(self) -> &'static str {
        self.label().split(" (").next().unwrap_or_default()
    }

    /// Display unit, and the factor from the unit in files to it.
    pub fn unit(self) -> (&'static str, f64) {
        (self.names().3, self.names().4)
    }

    /// Value of a missing figure: infinite for the error of a lost estimate, else NaN.
    pub(super) fn missing_value(self) -> f64 {
        if self.origin().is_estimate() { f64::INFINITY } else { f64::NAN }
    }

    pub(super) fn origin(self) -> Origin {
        match self {
            Self::PositionRmseM
            | Self::RotationRmseDeg
            | Self::DriftMPerMin
            | Self::YawDriftDegPerMin
            | Self::ClockRmseS
            | Self::ClockError30S
            | Self::ClockError120S
            | Self::RigidLinkRmseM
            | Self::ClosedPositionRmseM
            | Self::ErrorOverSlamBound
            | Self::Status
            | Self::AlignedRmseM
            | Self::LargestErrorM
            | Self::BoundM99
            | Self::WithinBound
            | Self::BoundOverError
            | Self::WayM
            | Self::DriftOverPath => Origin::Estimate,
            Self::ClockErrorS => Origin::Map,
            Self::CloudSigmaM | Self::CloudBiasM => Origin::AnyMap,
            Self::CloudOverTruth => Origin::Cloud,
            Self::ReferenceSigmaM | Self::ReferenceBiasM | Self::ReferenceRmseM => Origin::Reference,
            Self::FractionSeen
            | Self::FractionSeen1S
            | Self::CoveredS
            | Self::DensityPerSrS
            | Self::RateP99DegPerS
            | Self::Saturated
            | Self::GyroRangeLeft
            | Self::CoilContactS => Origin::Swing,
            Self::FieldOfViewDeg | Self::RateDegPerS => Origin::SwingOrClosedForm,
            Self::RockingHz
            | Self::PeakGain
            | Self::SagMm
            | Self::SpringMassG
            | Self::StressShare
            | Self::FatigueMargin => Origin::ClosedForm,
            Self::OpenLoopTimeRatio | Self::ClosedLoopTimeRatio => Origin::EstimateWallClock,
            Self::WallS => Origin::WallClock,
        }
    }

    /// Whether it is a computing time, which differs from run to run.
    pub(super) fn is_time(self) -> bool {
        matches!(self.origin(), Origin::EstimateWallClock | Origin::WallClock)
    }

    /// Whether runs with this measure close loops.
    pub(super) fn needs_closed_loop(self) -> bool {
        matches!(self, Self::ClosedPositionRmseM | Self::ErrorOverSlamBound | Self::ClosedLoopTimeRatio)
    }

    /// Whether runs with this measure keep the clock offset over time.
    pub(super) fn has_clock_curve(self) -> bool {
        matches!(self, Self::ClockError30S | Self::ClockError120S)
    }

    /// Whether a head on its spring has this measure in closed form.
    pub(crate) fn has_closed_form(self) -> bool {
        matches!(self.origin(), Origin::ClosedForm | Origin::SwingOrClosedForm)
    }

    /// Whether it is a figure of a journey alone: it has no closed form, and needs no second system or timing errors.
    pub(crate) fn needs_journey(self) -> bool {
        matches!(self.origin(), Origin::Estimate | Origin::AnyMap | Origin::Cloud | Origin::Swing)
    }

    /// Whether it is a figure of an estimate.
    pub(crate) fn is_of_estimate(self) -> bool {
        self.origin().is_estimate()
    }

    /// Whether runs of this base have this measure.
    pub(super) fn is_available_for(self, base: &BaseSpec) -> bool {
        if matches!(base, BaseSpec::Gains { .. }) {
            return matches!(self, Self::PeakGain | Self::WallS);
        }
        match self.origin() {
            Origin::WallClock | Origin::SwingOrClosedForm => true,
            Origin::ClosedForm => matches!(base, BaseSpec::Spring { .. }),
            Origin::EstimateWallClock => matches!(base, BaseSpec::Journey { timing: None, .. }),
            Origin::Estimate if self != Self::PositionRmseM => matches!(base, BaseSpec::Journey { timing: None, .. }),
            Origin::Map => matches!(base, BaseSpec::Journey { timing: Some(_), .. }),
            Origin::Cloud => matches!(base, BaseSpec::Journey { timing: None, .. }),
            Origin::Reference => matches!(base, BaseSpec::Journey { reference: Some(_), .. }),
            Origin::Estimate | Origin::AnyMap | Origin::Swing => matches!(base, BaseSpec::Journey { .. }),
        }
    }
}
