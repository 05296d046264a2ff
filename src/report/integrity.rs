//! Integrity of a run: error bounds, causes of the status and events, as in `metrics.json`.

use serde::{Deserialize, Serialize};
use zsim_base::time::Stamp;
use zsim_estimation::{Event, Severity, grouped};

/// All events of one kind: losses of measurements, or notes on the estimate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EventMetrics {
    /// Key of the kind, for scripts.
    pub kind: String,
    /// Number of events.
    pub count: u64,
    /// Time of the first event, s after the first measurement; `None` for an event without a time.
    pub first_s: Option<f64>,
    /// Time of the last event, s after the first measurement.
    pub last_s: Option<f64>,
    /// Magnitude of the worst event, if the kind has one: duration of a gap in s, number of samples.
    pub worst: Option<f64>,
    /// Message of the worst event.
    pub sentence: String,
}

/// A cause of a status other than `good`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CauseMetrics {
    /// `degraded` or `lost`.
    pub status: String,
    /// Key of the kind, for scripts.
    pub kind: String,
    /// Start, s after the first measurement.
    pub from_s: f64,
    /// End, s after the first measurement.
    pub to_s: f64,
    /// Message.
    pub sentence: String,
}

/// Error bounds of a result and causes of its status.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntegrityMetrics {
    /// Median over the poses of the 99 % bound on the position error, aligned over the first 20 s, m; `None` if more
    /// than half of the poses have no bound.
    pub bound_m_99: Option<f64>,
    /// Largest finite bound of a pose, m.
    pub largest_bound_m: Option<f64>,
    /// Start of the first cause, s after the first measurement; `None` if the status is `good`.
    pub since_s: Option<f64>,
    /// Causes of the status, most severe first.
    pub causes: Vec<CauseMetrics>,
    /// Fraction of the poses whose error is within the bound; `None` without truth.
    pub within_bound: Option<f64>,
    /// Median ratio of bound to error; `None` without truth.
    pub bound_over_error: Option<f64>,
    /// RMS position error after alignment over the first 20 s, m; `None` without truth.
    pub aligned_rmse_m: Option<f64>,
    /// Largest position error after alignment over the first 20 s, m; `None` without truth.
    pub largest_error_m: Option<f64>,
    /// 95 % quantile of the position error after alignment over the first 20 s, m; `None` without truth.
    pub aligned_p95_m: Option<f64>,
    /// Fraction of the time in which a cause degrades the result.
    pub degraded_fraction: Option<f64>,
    /// Length of the estimated path, from positions one second apart, m.
    pub path_length_m: Option<f64>,
}

impl CauseMetrics {
    /// Describes a cause, with times relative to `start`.
    pub fn new(cause: &Event, start: Stamp) -> Self {
        Self {
            status: cause.severity.name().to_owned(),
            kind: cause.kind.key().to_owned(),
            from_s: cause.from.seconds_since(start),
            to_s: cause.to.seconds_since(start),
            sentence: cause.kind.to_string(),
        }
    }

    /// Formats the cause as one line: message and interval of time.
    pub fn line(&self) -> String {
        format!("{}, {:.1} to {:.1} s", self.sentence, self.from_s, self.to_s)
    }
}

impl EventMetrics {
    /// Summarises the events of a severity, one entry for each kind, with times relative to `start`.
    pub fn of(events: &[Event], severity: Severity, start: Stamp) -> Vec<Self> {
        let summary = |group: Vec<&Event>| {
            let times_s = || group.iter().map(|event| event.from.seconds_since(start));
            Self {
                kind: group[0].kind.key().to_owned(),
                count: group.len() as u64,
                first_s: times_s().min_by(f64::total_cmp),
                last_s: times_s().max_by(f64::total_cmp),
                worst: group[0].kind.magnitude(),
                sentence: group[0].kind.to_string(),
            }
        };
        grouped(events.iter().filter(|event| event.severity == severity)).into_iter().map(summary).collect()
    }

    /// Creates an entry for an event without a time.
    pub fn without_time(kind: &str, sentence: String) -> Self {
        Self { kind: kind.to_owned(), count: 1, sentence, ..Self::default() }
    }

    /// Formats the events as one line: time, message and count.
    pub fn line(&self) -> String {
        let at = self.first_s.map_or_else(String::new, |s| format!("{s:.2} s: "));
        match (self.count, self.last_s) {
            (count, Some(last_s)) if count > 1 => {
                format!("{at}{} ({count} times, last at {last_s:.2} s)", self.sentence)
            }
            _ => format!("{at}{}", self.sentence),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Span;
    use zsim_estimation::EventKind;

    #[test]
    fn each_kind_is_one_entry_with_count_first_time_and_worst_case() {
        let start = Stamp::from_nanos(5_000_000_000);
        let gap = |at_s: f64, seconds: f64| Event::at(start + Span::from_seconds(at_s), EventKind::ImuGap { seconds });
        let moved = Event::at(start, EventKind::StartedInMotion);
        let events = [gap(3.0, 0.1), moved, gap(1.0, 0.3), gap(9.0, 0.2)];
        let losses = EventMetrics::of(&events, Severity::Loss, start);
        let [loss] = &losses[..] else { panic!("{losses:?}") };
        assert_eq!((loss.kind.as_str(), loss.count, loss.worst), ("imu_gap", 3, Some(0.3)));
        assert_eq!((loss.first_s, loss.last_s), (Some(1.0), Some(9.0)));
        assert!(loss.sentence.contains("0.300 s"), "{}", loss.sentence);
        assert_eq!(EventMetrics::of(&events, Severity::Note, start).len(), 1);
    }

    #[test]
    fn events_of_one_kind_are_one_line() {
        let event = EventMetrics {
            kind: "imu_gap".to_owned(),
            count: 40,
            first_s: Some(1.0),
            last_s: Some(9.5),
            worst: Some(0.2),
            sentence: "no IMU sample for 0.200 s".to_owned(),
        };
        assert_eq!(event.line(), "1.00 s: no IMU sample for 0.200 s (40 times, last at 9.50 s)");
        assert_eq!(EventMetrics { count: 1, first_s: None, ..event }.line(), "no IMU sample for 0.200 s");
    }
}
