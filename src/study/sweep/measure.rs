//! What is told of a run.

use super::BaseSpec;
use serde::{Deserialize, Serialize};

/// A figure of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Of the estimate: position error after rigid alignment, root mean square, m.
    PositionRmseM,
    /// Of the estimate: angle of the rotation error after rigid alignment, root mean square, degrees.
    RotationRmseDeg,
    /// Of the estimate: drift of the position, m/min.
    DriftMPerMin,
    /// Of the estimate: drift about the vertical, degrees/min.
    YawDriftDegPerMin,
    /// Of the estimate: error of the clock offset over the whole run, its beginning included, root mean square, s.
    ClockRmseS,
    /// Of the closed loop: position error after rigid alignment, root mean square, m; loops are closed only where it is
    /// asked for.
    ClosedPositionRmseM,
    /// Verdict on the estimate: 0 good, 1 degraded, 2 lost.
    Status,
    /// Of the result that counts, the closed loop's where it is asked for: position error after rigid alignment over
    /// the first 20 s (half of a shorter run), root mean square, m.
    AlignedRmseM,
    /// The same, the largest of the run, m.
    LargestErrorM,
    /// Median of the 99 % bound on that error, m.
    #[serde(rename = "bound_m_99")]
    BoundM99,
    /// Share of the poses whose error is within its bound.
    WithinBound,
    /// Median over the poses of bound over error.
    BoundOverError,
    /// Length of the estimated path by positions a second apart, m.
    WayM,
    /// Share of the sphere that the lidar saw at all.
    FractionSeen,
    /// Time until nine tenths of that had been seen, s.
    CoveredS,
    /// Beams per steradian and second, mean of all that was seen.
    DensityPerSrS,
    /// Field of view: of a journey between the 2.5 % and 97.5 % quantiles of the forward beam's elevation, of a closed
    /// form twice the amplitude of the head's pitch; degrees.
    FieldOfViewDeg,
    /// Greatest rate of rotation on an axis of the gyroscope, degrees/s.
    RateDegPerS,
    /// Rate not exceeded in 99 % of the time on the busiest axis, degrees/s.
    RateP99DegPerS,
    /// Share of the time in which some axis of the gyroscope was beyond its limit.
    Saturated,
    /// Frequency of the slowest mode, Hz.
    RockingHz,
    /// Greatest gain of the pitch rate.
    PeakGain,
    /// How far the spring shortens under the head, mm.
    SagMm,
    /// Mass of the active wire, g.
    SpringMassG,
    /// Greatest stress in the wire over its yield.
    StressShare,
    /// Time that the run took on its thread, s. It is no property of the run, and stays out of the table of results.
    WallS,
}

/// What must be done to know a measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Told {
    /// An estimate from a recording.
    Estimate,
    /// A swing of the head, without rays.
    Swing,
    /// A closed form.
    ClosedForm,
    /// Either of a swing and a closed form.
    SwingOrClosedForm,
    /// A clock on the wall.
    Clock,
}

impl Measure {
    /// Every measure.
    pub const ALL: [Self; 26] = [
        Self::PositionRmseM,
        Self::RotationRmseDeg,
        Self::DriftMPerMin,
        Self::YawDriftDegPerMin,
        Self::ClockRmseS,
        Self::ClosedPositionRmseM,
        Self::Status,
        Self::AlignedRmseM,
        Self::LargestErrorM,
        Self::BoundM99,
        Self::WithinBound,
        Self::BoundOverError,
        Self::WayM,
        Self::FractionSeen,
        Self::CoveredS,
        Self::DensityPerSrS,
        Self::FieldOfViewDeg,
        Self::RateDegPerS,
        Self::RateP99DegPerS,
        Self::Saturated,
        Self::RockingHz,
        Self::PeakGain,
        Self::SagMm,
        Self::SpringMassG,
        Self::StressShare,
        Self::WallS,
    ];

    /// Key in files, name in narrow tables, name on an axis of a plot with its unit there, that unit alone, and how
    /// many of it make one of the key's.
    fn names(self) -> (&'static str, &'static str, &'static str, &'static str, f64) {
        match self {
            Self::PositionRmseM => ("position_rmse_m", "position", "Position error (mm rms)", "mm", 1e3),
            Self::RotationRmseDeg => ("rotation_rmse_deg", "rotation", "Rotation error (degrees rms)", "deg", 1.0),
            Self::DriftMPerMin => ("drift_m_per_min", "drift", "Drift (mm/min)", "mm/min", 1e3),
            Self::YawDriftDegPerMin => {
                ("yaw_drift_deg_per_min", "yaw drift", "Yaw drift (degrees/min)", "deg/min", 1.0)
            }
            Self::ClockRmseS => ("clock_rmse_s", "clock", "Error of the clock offset (ms rms)", "ms", 1e3),
            Self::ClosedPositionRmseM => {
                ("closed_position_rmse_m", "closed loop", "Position error, closed loop (mm rms)", "mm", 1e3)
            }
            Self::Status => ("status", "status", "Verdict (0 good, 1 degraded, 2 lost)", "1", 1.0),
            Self::AlignedRmseM => {
                ("aligned_rmse_m", "aligned", "Position error, aligned over the first 20 s (mm rms)", "mm", 1e3)
            }
            Self::LargestErrorM => ("largest_error_m", "largest", "Largest position error (mm)", "mm", 1e3),
            Self::BoundM99 => ("bound_m_99", "bound", "Bound on the position error, 99 % (mm)", "mm", 1e3),
            Self::WithinBound => ("within_bound", "within", "Poses within their bound (%)", "%", 1e2),
            Self::BoundOverError => ("bound_over_error", "bound/error", "Bound over error", "1", 1.0),
            Self::WayM => ("way_m", "way", "Length of the path (m)", "m", 1.0),
            Self::FractionSeen => ("fraction_seen", "seen", "Share of the sphere seen (%)", "%", 1e2),
            Self::CoveredS => ("covered_s", "covered", "Time to nine tenths of it (s)", "s", 1.0),
            Self::DensityPerSrS => ("density_per_sr_s", "density", "Beams per sr and s", "1/sr/s", 1.0),
            Self::FieldOfViewDeg => ("field_of_view_deg", "view", "Field of view (degrees)", "deg", 1.0),
            Self::RateDegPerS => ("rate_deg_per_s", "rate", "Greatest rate (degrees/s)", "deg/s", 1.0),
            Self::RateP99DegPerS => {
                ("rate_p99_deg_per_s", "rate 99 %", "Rate not exceeded in 99 % (degrees/s)", "deg/s", 1.0)
            }
            Self::Saturated => ("saturated", "saturated", "Gyroscope beyond its limit (% of the time)", "%", 1e2),
            Self::RockingHz => ("rocking_hz", "rocking", "Rocking frequency (Hz)", "Hz", 1.0),
            Self::PeakGain => ("peak_gain", "gain", "Peak gain of the pitch rate", "1", 1.0),
            Self::SagMm => ("sag_mm", "sag", "Sag (mm)", "mm", 1.0),
            Self::SpringMassG => ("spring_mass_g", "mass", "Mass of the spring (g)", "g", 1.0),
            Self::StressShare => ("stress_share", "stress", "Stress over yield (%)", "%", 1e2),
            Self::WallS => ("wall_s", "time", "Time taken (s)", "s", 1.0),
        }
    }

    /// Its name in files.
    pub fn key(self) -> &'static str {
        self.names().0
    }

    /// Its name in narrow tables.
    pub(super) fn short(self) -> &'static str {
        self.names().1
    }

    /// What it is called on an axis of a plot, in the unit that people read.
    pub(super) fn label(self) -> &'static str {
        self.names().2
    }

    /// The unit in which people read it, and how many of it make one of the file's.
    pub(super) fn unit(self) -> (&'static str, f64) {
        (self.names().3, self.names().4)
    }

    /// What a figure that is not there counts as: an estimate that was lost is infinitely wrong.
    pub(super) fn when_lost(self) -> f64 {
        if self.told() == Told::Estimate { f64::INFINITY } else { f64::NAN }
    }

    pub(super) fn told(self) -> Told {
        match self {
            Self::PositionRmseM
            | Self::RotationRmseDeg
            | Self::DriftMPerMin
            | Self::YawDriftDegPerMin
            | Self::ClockRmseS
            | Self::ClosedPositionRmseM
            | Self::Status
            | Self::AlignedRmseM
            | Self::LargestErrorM
            | Self::BoundM99
            | Self::WithinBound
            | Self::BoundOverError
            | Self::WayM => Told::Estimate,
            Self::FractionSeen | Self::CoveredS | Self::DensityPerSrS | Self::RateP99DegPerS | Self::Saturated => {
                Told::Swing
            }
            Self::FieldOfViewDeg | Self::RateDegPerS => Told::SwingOrClosedForm,
            Self::RockingHz | Self::PeakGain | Self::SagMm | Self::SpringMassG | Self::StressShare => Told::ClosedForm,
            Self::WallS => Told::Clock,
        }
    }

    /// Whether a run of this base tells it.
    pub(super) fn is_of(self, base: &BaseSpec) -> bool {
        match self.told() {
            Told::Clock | Told::SwingOrClosedForm => true,
            Told::ClosedForm => matches!(base, BaseSpec::Spring { .. }),
            Told::Estimate | Told::Swing => matches!(base, BaseSpec::Journey { .. }),
        }
    }
}
