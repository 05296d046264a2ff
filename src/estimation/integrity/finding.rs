//! Findings about a run, and their effect on the result.

use crate::MatrixEntry;
use std::fmt;
use zsim_base::time::Stamp;

/// Status of a result, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Status {
    /// The error is within a small bound.
    #[default]
    Good,
    /// Usable, with a larger bound or with missing parts.
    Degraded,
    /// Not usable from some time on.
    Lost,
}

impl Status {
    /// The value in `metrics.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Degraded => "degraded",
            Self::Lost => "lost",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A cause of degradation or loss, over an interval of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Effect on the result.
    pub status: Status,
    /// The cause.
    pub cause: Cause,
    /// Start, lidar time.
    pub from: Stamp,
    /// End, lidar time.
    pub to: Stamp,
}

/// A cause that degrades an estimate.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// IMU and lidar contradict each other by more than the IMU noise explains.
    Contradiction {
        /// Median multiple of the IMU noise over the interval; 0.1 to 0.4 in a sound run.
        times: f64,
    },
    /// IMU and lidar contradict each other, and at the same time the matched surfaces fit badly or the IMU scale is not
    /// plausible.
    Inconsistent {
        /// The smaller measure, as a multiple of its limit of a degraded result.
        ratio: f64,
    },
    /// Too few surfaces were matched; dead reckoning with the IMU.
    FewMatches {
        /// Duration, s.
        seconds: f64,
    },
    /// Rest is assumed from the IMU only: uniform motion would not change the lidar's view.
    RestAssumed {
        /// Duration, s.
        seconds: f64,
    },
    /// Matched surfaces fit badly.
    PoorFit {
        /// Root mean square residual, median over the interval, m.
        residual_m: f64,
    },
    /// Relocalisation in the map failed after a gap, so the trajectory has an unknown offset.
    NotRelocalised,
    /// The estimated velocity is not plausible.
    Speed {
        /// Largest speed, m/s.
        speed_m_per_s: f64,
    },
    /// A gap in the data of a sensor.
    Gap {
        /// `"IMU"` or `"lidar"`.
        sensor: &'static str,
        /// Duration, s.
        seconds: f64,
    },
    /// The estimate does not cover the full recording.
    NotCovered {
        /// Length of the missing part, s.
        seconds: f64,
    },
    /// The gyroscope or accelerometer was at the end of its range.
    Clipped {
        /// Fraction of the samples, 0..1.
        fraction: f64,
    },
    /// A sensor repeats the same reading.
    Frozen {
        /// `"IMU"` or `"lidar"`.
        sensor: &'static str,
        /// Number of discarded measurements.
        count: usize,
    },
    /// The estimated correction of all ranges is not plausible.
    RangeCorrection {
        /// The correction, m.
        correction_m: f64,
    },
    /// The estimated scale or misalignment of the IMU is not plausible.
    ImuScale {
        /// The entry, and its standard deviation according to the model of the IMU.
        entry: MatrixEntry,
    },
    /// The estimated rate of the clock offset is not plausible.
    ClockRate {
        /// The rate, s/s.
        rate: f64,
    },
    /// The bound on the position error is large.
    Uncertain {
        /// Largest bound, m.
        bound_m: f64,
    },
    /// Loop closure moved the trajectory by more than the uncertainty.
    LoopClosure {
        /// Largest shift, m.
        moved_m: f64,
    },
}

impl Finding {
    /// Whether the cause is a sensor fault, not a consequence of one.
    pub(super) fn is_sensor_fault(&self) -> bool {
        matches!(self.cause, Cause::Clipped { .. } | Cause::Frozen { .. })
    }
}

impl Cause {
    /// Magnitude, in the unit of the kind.
    pub(super) fn magnitude(&self) -> f64 {
        match self {
            Self::Contradiction { times } => *times,
            Self::Inconsistent { ratio } => *ratio,
            Self::FewMatches { seconds }
            | Self::RestAssumed { seconds }
            | Self::Gap { seconds, .. }
            | Self::NotCovered { seconds } => *seconds,
            Self::PoorFit { residual_m } => *residual_m,
            Self::NotRelocalised => 0.0,
            Self::Speed { speed_m_per_s } => *speed_m_per_s,
            Self::Clipped { fraction } => *fraction,
            Self::Frozen { count, .. } => *count as f64,
            Self::RangeCorrection { correction_m } => correction_m.abs(),
            Self::ImuScale { entry } => entry.value,
            Self::ClockRate { rate } => *rate,
            Self::Uncertain { bound_m } => *bound_m,
            Self::LoopClosure { moved_m } => *moved_m,
        }
    }

    /// The key in `metrics.json`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Contradiction { .. } => "contradiction",
            Self::Inconsistent { .. } => "inconsistent",
            Self::FewMatches { .. } => "few_matches",
            Self::RestAssumed { .. } => "rest_assumed",
            Self::PoorFit { .. } => "poor_fit",
            Self::NotRelocalised => "not_relocalised",
            Self::Speed { .. } => "speed",
            Self::Gap { .. } => "gap",
            Self::NotCovered { .. } => "not_covered",
            Self::Clipped { .. } => "clipped",
            Self::Frozen { .. } => "frozen",
            Self::RangeCorrection { .. } => "range_correction",
            Self::ImuScale { .. } => "imu_scale",
            Self::ClockRate { .. } => "clock_rate",
            Self::Uncertain { .. } => "uncertain",
            Self::LoopClosure { .. } => "loop_closure",
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Contradiction { times } => write!(
                f,
                "IMU and lidar contradict each other by {times:.1} times the IMU noise (0.1 to 0.4 is usual); check the \
                 extrinsics, the units, signs and range of the IMU, and the clocks"
            ),
            Self::Inconsistent { .. } => write!(
                f,
                "the motion by the lidar contradicts the IMU, and no calibration explains it: a large moving surface fills the \
                 view, or a sensor is wrong; the trajectory has an unknown error"
            ),
            Self::FewMatches { seconds } => {
                write!(f, "tracking lost for {seconds:.1} s (too few matched surfaces); position from the IMU only")
            }
            Self::RestAssumed { seconds } => {
                write!(
                    f,
                    "at rest for {seconds:.1} s according to the IMU only: the visible surfaces would look the same at \
                     constant velocity; start at rest where the lidar sees surfaces on all sides"
                )
            }
            Self::PoorFit { residual_m } => {
                write!(
                    f,
                    "matched surfaces fit to {:.0} mm only; map and trajectory may be distorted",
                    residual_m * 1e3
                )
            }
            Self::NotRelocalised => {
                write!(f, "relocalisation failed after a gap; the trajectory after it has an unknown offset")
            }
            Self::Speed { speed_m_per_s } => write!(f, "implausible velocity of {speed_m_per_s:.0} m/s"),
            Self::Gap { sensor, seconds } => write!(f, "gap of {seconds:.2} s in the {sensor} data"),
            Self::NotCovered { seconds } => {
                write!(f, "no estimate for {seconds:.1} s at the start and end of the recording")
            }
            Self::Clipped { fraction } => {
                write!(f, "{:.1} % of the IMU samples are saturated", fraction * 1e2)
            }
            Self::Frozen { sensor: "lidar", count } => {
                write!(f, "the lidar repeats scans, or all beams of a scan have one range ({count} scans discarded)")
            }
            Self::Frozen { sensor, count } => write!(f, "the {sensor} repeats the same reading ({count} discarded)"),
            Self::RangeCorrection { correction_m } => {
                write!(f, "implausible range correction of {:.0} mm", correction_m * 1e3)
            }
            Self::ImuScale { entry } => write!(
                f,
                "implausible IMU scale or misalignment of {:.1} % (standard deviation of its model: {:.2} %)",
                entry.value * 1e2,
                entry.model_sigma * 1e2
            ),
            Self::ClockRate { rate } => write!(f, "implausible drift between the clocks of {:.0} ppm", rate * 1e6),
            Self::Uncertain { bound_m } => {
                write!(f, "the position error may reach {bound_m:.2} m (99 % bound)")
            }
            Self::LoopClosure { moved_m } => {
                write!(f, "loop closure moved the trajectory by {moved_m:.2} m, more than the uncertainty")
            }
        }
    }
}
