//! Integrity of a run: error bounds, causes of the status and events, as in `metrics.json`.

use super::Metrics;
use super::quantity::length;
use serde::{Deserialize, Serialize};

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
}

impl EventMetrics {
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

/// The status with its bound or its first cause, as one line; `None` without an estimate.
pub(super) fn verdict(metrics: &Metrics) -> Option<String> {
    let status = metrics.status.as_deref()?;
    let bound = metrics.integrity.bound_m_99.map(|m| format!("99 % of position errors below {}", length(m)));
    Some(match metrics.integrity.causes.first() {
        None => format!("{status}: {}", bound.unwrap_or_else(|| "no bound".to_owned())),
        Some(cause) if status == "lost" => format!("lost: {}, from {:.1} s", cause.sentence, cause.from_s),
        Some(cause) => format!("{status}: {}, {:.1} to {:.1} s", cause.sentence, cause.from_s, cause.to_s),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_status(status: &str, causes: Vec<CauseMetrics>) -> Metrics {
        let integrity = IntegrityMetrics { bound_m_99: Some(0.0062), causes, ..IntegrityMetrics::default() };
        Metrics { status: Some(status.to_owned()), integrity, ..Metrics::default() }
    }

    #[test]
    fn the_verdict_contains_the_first_cause_and_its_time() {
        assert_eq!(verdict(&Metrics::default()), None);
        assert_eq!(verdict(&with_status("good", vec![])).unwrap(), "good: 99 % of position errors below 6.20 mm");
        let cause = |status: &str| CauseMetrics {
            status: status.to_owned(),
            kind: "gap".to_owned(),
            from_s: 3.25,
            to_s: 4.25,
            sentence: "gap of 1.00 s in the IMU data".to_owned(),
        };
        let degraded = verdict(&with_status("degraded", vec![cause("degraded")])).unwrap();
        assert_eq!(degraded, "degraded: gap of 1.00 s in the IMU data, 3.2 to 4.2 s");
        let lost = verdict(&with_status("lost", vec![cause("lost")])).unwrap();
        assert_eq!(lost, "lost: gap of 1.00 s in the IMU data, from 3.2 s");
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
