//! Events of a run: what the estimator warns of, and the causes of the status of its result.

use std::fmt;
use zsim_base::geometry::Vector;
use zsim_base::time::{Span, Stamp};

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
    /// Returns the status of a result with these causes: that of the most severe.
    pub fn of(causes: &[Event]) -> Self {
        causes.iter().map(|cause| cause.severity.status()).max().unwrap_or_default()
    }

    /// Returns the value in `metrics.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Degraded => "degraded",
            Self::Lost => "lost",
        }
    }
}

/// Effect of an event on the result, mildest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Information for the user.
    Note,
    /// Measurements are missing or unused, or there is no estimate for some time.
    Loss,
    /// The result is degraded.
    Degraded,
    /// The result is lost.
    Lost,
}

impl Severity {
    /// Returns the key for scripts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Loss => "loss",
            Self::Degraded => "degraded",
            Self::Lost => "lost",
        }
    }

    /// Returns the best status of a result with such an event.
    fn status(self) -> Status {
        match self {
            Self::Note | Self::Loss => Status::Good,
            Self::Degraded => Status::Degraded,
            Self::Lost => Status::Lost,
        }
    }
}

/// An event that degrades or explains an estimate, over an interval of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Start, lidar time.
    pub from: Stamp,
    /// End, lidar time; the start for an event without a duration, which repeats while it lasts.
    pub to: Stamp,
    /// Effect on the result.
    pub severity: Severity,
    /// Kind of event, with its values.
    pub kind: EventKind,
}

impl Event {
    /// Creates an event without a duration, of the severity of its kind.
    pub fn at(stamp: Stamp, kind: EventKind) -> Self {
        Self::over(stamp, stamp, kind)
    }

    /// Creates an event of the severity of its kind.
    pub fn over(from: Stamp, to: Stamp, kind: EventKind) -> Self {
        Self { from, to, severity: kind.severity(), kind }
    }

    /// Creates an event that starts at `from` and lasts `seconds`.
    pub(super) fn lasting(from: Stamp, seconds: f64, kind: EventKind) -> Self {
        Self::over(from, from + Span::from_seconds(seconds), kind)
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:.3} s: {}", self.from.nanos() as f64 * 1e-9, self.kind)
    }
}

/// Groups events by severity and key; the first of a group is the largest.
pub fn grouped<'a>(events: impl IntoIterator<Item = &'a Event>) -> Vec<Vec<&'a Event>> {
    let mut groups: Vec<Vec<&Event>> = Vec::new();
    for event in events {
        let of = |event: &Event| (event.severity, event.kind.key());
        match groups.iter_mut().find(|group| of(group[0]) == of(event)) {
            Some(group) if event.kind.magnitude() > group[0].kind.magnitude() => group.insert(0, event),
            Some(group) => group.push(event),
            None => groups.push(vec![event]),
        }
    }
    groups
}

/// Declares the kinds: `/// description`, `Kind { values } = key in metrics.json, severity, magnitude, sentence;`
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident $({ $($(#[$of_value:meta])* $value:ident: $type:ty,)* })? =
        $key:literal, $severity:ident, $magnitude:expr, $sentence:literal $(, $($argument:expr),+)?;)*) => {
        /// Kinds of events.
        #[derive(Debug, Clone, PartialEq)]
        pub enum EventKind {
            $($(#[$doc])* $kind $({ $($(#[$of_value])* $value: $type,)* })?,)*
        }

        impl EventKind {
            /// Returns the key in `metrics.json`.
            pub fn key(&self) -> &'static str {
                match self {
                    $(Self::$kind { .. } => $key,)*
                }
            }

            /// Returns the severity of the kind; a value beyond a second limit makes an event more severe.
            fn severity(&self) -> Severity {
                match self {
                    $(Self::$kind { .. } => Severity::$severity,)*
                }
            }

            /// Returns the magnitude, if the kind has one; larger is worse.
            ///
            /// It is in the unit of the value: s, m, number or ratio.
            #[expect(unused_variables, reason = "some values have no effect on the magnitude")]
            pub fn magnitude(&self) -> Option<f64> {
                match self {
                    $(Self::$kind $({ $($value),* })? => $magnitude,)*
                }
            }
        }

        impl fmt::Display for EventKind {
            #[expect(unused_variables, reason = "a sentence need not contain all values")]
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $(Self::$kind $({ $($value),* })? => write!(f, $sentence $(, $($argument),+)?),)*
                }
            }
        }
    };
}

kinds! {
    /// The head moved at the start, so initial tilt and gyroscope bias are uncertain.
    StartedInMotion = "started_in_motion", Note, None,
        "the head moved at the start; initial tilt and gyroscope bias are uncertain";
    /// The first window, at the start or after a gap, was inconsistent: it was discarded, and the estimate starts later.
    StartRejected {
        /// Last correction of its solution, m; after a gap the largest of this and the two windows before.
        correction_m: f64,
        /// Contradiction between IMU and lidar in it, as a multiple of the IMU noise.
        times: f64,
    } = "start_rejected", Note, Some(*correction_m),
        "the first window, at the start or after a gap, is inconsistent (last correction {:.0} mm, IMU and lidar \
         contradict each other by {times:.1} times the IMU noise): discarded, the estimate starts later", 1e3 * correction_m;
    /// The noise measured at rest exceeds the specification by these factors, and is used instead.
    NoisyImu {
        /// Factor of the gyroscope noise, at least 1.
        gyro: f64,
        /// Factor of the accelerometer noise, at least 1.
        accel: f64,
    } = "noisy_imu", Note, Some(gyro.max(*accel)),
        "the IMU noise at rest is {gyro:.1} (gyroscope) and {accel:.1} (accelerometer) times that of the model; \
         the measured noise is used";
    /// An IMU gap, bridged by interpolation.
    ImuGap {
        /// Duration, s.
        seconds: f64,
    } = "imu_gap", Loss, Some(*seconds),
        "no IMU sample for {seconds:.3} s; bridged by interpolation";
    /// A lidar gap, bridged by dead reckoning with the IMU.
    LidarGap {
        /// Duration, s.
        seconds: f64,
    } = "lidar_gap", Loss, Some(*seconds),
        "no lidar scan for {seconds:.3} s; dead reckoning with the IMU";
    /// An IMU gap too long to bridge: the estimate restarted after it.
    Restarted {
        /// Duration, s.
        seconds: f64,
    } = "restarted", Loss, Some(*seconds),
        "no IMU sample for {seconds:.3} s, too long to bridge; re-initialised after the gap";
    /// Relocalisation after the gap succeeded.
    Relocalised {
        /// Distance from the position before the gap, m.
        distance_m: f64,
        /// Distance that the true position may be from the one found because another pose matches too, m.
        ambiguity_m: f64,
    } = "relocalised", Note, Some(*distance_m),
        "relocalised after the IMU gap, {distance_m:.2} m from the position before it; similar surfaces leave \
         the position uncertain by {ambiguity_m:.2} m";
    /// The data between two gaps, or after the last one, are too few to relocalise: they have no estimate.
    TooShortToRelocalise {
        /// Duration, s.
        seconds: f64,
    } = "too_short_to_relocalise", Loss, Some(*seconds),
        "{seconds:.1} s after an IMU gap are too short to relocalise; they have no estimate";
    /// Relocalisation after the gap failed: the motion during the gap is missing from the trajectory.
    NotRelocalised {
        /// Reason of the failure.
        why: String,
    } = "not_relocalised", Loss, None,
        "relocalisation failed after the IMU gap ({why}); the motion during the gap is missing from the \
         trajectory";
    /// Relocalisation in the map failed after a gap.
    LostInMap = "lost_in_map", Loss, None,
        "relocalisation in the map failed after the gap; continuing without the map";
    /// IMU samples that arrived late, or with decreasing stamps, were discarded.
    LateSamples {
        /// Number of measurements.
        count: usize,
    } = "late_samples", Loss, Some(*count as f64),
        "discarded {count} late IMU samples (or decreasing stamps)";
    /// Lidar scans that arrived late, or with decreasing stamps, were discarded.
    LateScans {
        /// Number of measurements.
        count: usize,
    } = "late_scans", Loss, Some(*count as f64),
        "discarded {count} late lidar scans (or decreasing stamps)";
    /// IMU samples that are outliers or not finite were discarded.
    Outliers {
        /// Number of measurements.
        count: usize,
    } = "outliers", Note, Some(*count as f64),
        "discarded {count} outliers among the IMU samples";
    /// IMU samples that repeat the previous reading were discarded.
    RepeatedSamples {
        /// Number of measurements.
        count: usize,
    } = "repeated_samples", Loss, Some(*count as f64),
        "discarded {count} repeated IMU samples";
    /// Lidar scans that repeat the previous scan while the head turns, or have the same range on all beams, were discarded.
    RepeatedScans {
        /// Number of measurements.
        count: usize,
    } = "repeated_scans", Loss, Some(*count as f64),
        "discarded {count} repeated lidar scans (or scans of constant range)";
    /// Clipped IMU samples, at the end of the range of the sensor.
    Saturated {
        /// Number of clipped samples so far.
        samples: usize,
    } = "clipped", Note, Some(*samples as f64),
        "{samples} saturated IMU samples so far; check the units (rad/s, m/s^2), and the range in the \
         calibration (`gyro_limit_rad_per_s`, `accel_limit_m_per_s2`)";
    /// Too few surfel matches: this window is dead reckoning with the IMU.
    FewMatches {
        /// Number of matches.
        matches: usize,
    } = "few_matches", Note, None,
        "only {matches} surfel matches; dead reckoning with the IMU";
    /// Degenerate geometry: the lidar does not constrain a direction, which is dead reckoning with the IMU.
    WeakGeometry {
        /// Smallest over largest eigenvalue of the position information, 0..1.
        conditioning: f64,
        /// The unconstrained direction, a unit vector in the map frame.
        direction_in_map: Vector,
    } = "weak_geometry", Note, None,
        "degenerate geometry: the lidar does not constrain {} in the map frame (conditioning {}); dead reckoning \
         with the IMU along it", direction_text(direction_in_map), conditioning_text(*conditioning);
    /// The solution of a window was rejected and the IMU prediction used.
    NotSolved {
        /// Reason of the rejection.
        reason: &'static str,
    } = "not_solved", Note, None,
        "window solution rejected ({reason}); IMU prediction used";
    /// Tracking was lost for a large part of the recording, with dead reckoning by the IMU only.
    Lost {
        /// Duration, s.
        seconds: f64,
        /// Length of the recording, s.
        of_seconds: f64,
    } = "lost", Loss, Some(*seconds),
        "tracking lost for {seconds:.0} of {of_seconds:.0} s (too few matched surfaces); trajectory unreliable";
    /// IMU and lidar contradicted each other for a large part of the recording by more than the IMU noise.
    Contradicted {
        /// Median contradiction over that time, as a multiple of the IMU noise; 0.1 to 0.4 in a sound run.
        times: f64,
        /// Duration, s.
        seconds: f64,
        /// Length of the recording, s.
        of_seconds: f64,
    } = "contradiction", Note, Some(*times),
        "IMU and lidar contradict each other for {seconds:.0} of {of_seconds:.0} s, by {times:.1} times the IMU \
         noise (0.1 to 0.4 is usual); check the extrinsics, the units and signs of the IMU, and the beam times";

    // Causes of the status of the result.
    /// IMU and lidar contradict each other by more than the IMU noise explains.
    Contradiction {
        /// Median multiple of the IMU noise over the interval; 0.1 to 0.4 in a sound run.
        times: f64,
    } = "contradiction", Degraded, Some(*times),
        "IMU and lidar contradict each other by {times:.1} times the IMU noise (0.1 to 0.4 is usual); check the \
         extrinsics, the units, signs and range of the IMU, and the clocks";
    /// IMU and lidar contradict each other while the matched surfaces fit badly or the IMU scale is not plausible.
    Inconsistent {
        /// The smaller measure, as a multiple of its limit of a degraded result.
        ratio: f64,
    } = "inconsistent", Lost, Some(*ratio),
        "the motion by the lidar contradicts the IMU, and no calibration explains it: a large moving surface \
         fills the view, or a sensor is wrong; the trajectory has an unknown error";
    /// Too few surfaces were matched; dead reckoning with the IMU.
    Untracked {
        /// Duration, s.
        seconds: f64,
    } = "few_matches", Lost, Some(*seconds),
        "tracking lost for {seconds:.1} s (too few matched surfaces); position from the IMU only";
    /// Rest is assumed from the IMU only: uniform motion would not change the lidar's view.
    RestAssumed {
        /// Duration, s.
        seconds: f64,
    } = "rest_assumed", Lost, Some(*seconds),
        "at rest for {seconds:.1} s according to the IMU only: the visible surfaces would look the same at \
         constant velocity; start at rest where the lidar sees surfaces on all sides";
    /// Matched surfaces fit badly.
    PoorFit {
        /// Root mean square residual, median over the interval, m.
        residual_m: f64,
    } = "poor_fit", Degraded, Some(*residual_m),
        "matched surfaces fit to {:.0} mm only; map and trajectory may be distorted", residual_m * 1e3;
    /// Relocalisation failed after a gap, so the trajectory after it has an unknown offset.
    UnknownOffset = "not_relocalised", Lost, None,
        "relocalisation failed after a gap; the trajectory after it has an unknown offset";
    /// The estimated velocity is not plausible.
    Speed {
        /// Largest speed, m/s.
        speed_m_per_s: f64,
    } = "speed", Lost, Some(*speed_m_per_s),
        "implausible velocity of {speed_m_per_s:.0} m/s";
    /// A gap in the data of a sensor.
    Gap {
        /// `"IMU"` or `"lidar"`.
        sensor: &'static str,
        /// Duration, s.
        seconds: f64,
    } = "gap", Degraded, Some(*seconds),
        "gap of {seconds:.2} s in the {sensor} data";
    /// The estimate does not cover the full recording.
    NotCovered {
        /// Length of the missing part, s.
        seconds: f64,
    } = "not_covered", Degraded, Some(*seconds),
        "no estimate for {seconds:.1} s at the start and end of the recording";
    /// The gyroscope or accelerometer was at the end of its range.
    Clipped {
        /// Fraction of the samples, 0..1.
        fraction: f64,
    } = "clipped", Degraded, Some(*fraction),
        "{:.1} % of the IMU samples are saturated", fraction * 1e2;
    /// The IMU repeats the same reading.
    FrozenImu {
        /// Number of discarded samples.
        count: usize,
    } = "frozen", Degraded, Some(*count as f64),
        "the IMU repeats the same reading ({count} discarded)";
    /// The lidar repeats the same scan.
    FrozenLidar {
        /// Number of discarded scans.
        count: usize,
    } = "frozen", Degraded, Some(*count as f64),
        "the lidar repeats scans, or all beams of a scan have one range ({count} scans discarded)";
    /// The estimated correction of all ranges is not plausible.
    RangeCorrection {
        /// The correction, m.
        correction_m: f64,
    } = "range_correction", Degraded, Some(correction_m.abs()),
        "implausible range correction of {:.0} mm", correction_m * 1e3;
    /// The estimated scale or misalignment of the IMU is not plausible.
    ImuScale {
        /// Absolute value of the entry.
        value: f64,
        /// Its standard deviation according to the model of the IMU.
        model_sigma: f64,
    } = "imu_scale", Degraded, Some(*value),
        "implausible IMU scale or misalignment of {:.1} % (standard deviation of its model: {:.2} %)", value * 1e2, model_sigma * 1e2;
    /// The estimated rate of the clock offset is not plausible.
    ClockRate {
        /// The rate, s/s.
        rate: f64,
    } = "clock_rate", Degraded, Some(*rate),
        "implausible drift between the clocks of {:.0} ppm", rate * 1e6;
    /// The bound on the position error is large.
    Uncertain {
        /// Largest bound, m.
        bound_m: f64,
    } = "uncertain", Degraded, Some(*bound_m),
        "the position error may reach {bound_m:.2} m (99 % bound)";
    /// Loop closure moved the trajectory by more than the uncertainty.
    LoopClosure {
        /// Largest shift, m.
        moved_m: f64,
    } = "loop_closure", Degraded, Some(*moved_m),
        "loop closure moved the trajectory by {moved_m:.2} m, more than the uncertainty";
}

impl EventKind {
    /// Whether a window with this problem lacks matches or a solution, and is dead reckoning with the IMU.
    pub(super) fn is_untracked(&self) -> bool {
        matches!(self, Self::FewMatches { .. } | Self::NotSolved { .. })
    }

    /// Whether the kind is a sensor fault, not a consequence of one.
    pub(super) fn is_sensor_fault(&self) -> bool {
        matches!(self, Self::Clipped { .. } | Self::FrozenImu { .. } | Self::FrozenLidar { .. })
    }
}

/// Formats a direction in the map frame.
fn direction_text(direction: &Vector) -> String {
    if direction.z.abs() > 0.9 {
        return "z".to_owned();
    }
    // Its sign is arbitrary: the largest component is positive, and 0 has no sign.
    let largest = direction[direction.iamax()];
    let [x, y, z] =
        [direction.x, direction.y, direction.z].map(|part| (part * largest.signum() * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2})")
}

/// Formats a conditioning.
fn conditioning_text(conditioning: f64) -> String {
    if conditioning == 0.0 { "0".to_owned() } else { format!("{conditioning:.1e}") }
}
