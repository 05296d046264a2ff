//! The statement of integrity of a run, as `metrics.json` has it.

use super::Metrics;
use super::quantity::length;
use serde::{Deserialize, Serialize};

/// What happened to the measurements or the estimate, each kind once.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EventMetrics {
    /// A key for scripts.
    pub kind: String,
    /// How often.
    pub count: u64,
    /// When first and last, s after the first measurement; `None` for what has no time.
    pub first_s: Option<f64>,
    /// When last.
    pub last_s: Option<f64>,
    /// Size of the worst, where the kind has one: seconds of a gap, samples.
    pub worst: Option<f64>,
    /// The worst in words.
    pub sentence: String,
}

/// A cause of the verdict.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CauseMetrics {
    /// `degraded` or `lost`.
    pub status: String,
    /// A key for scripts.
    pub kind: String,
    /// From when, s after the first measurement.
    pub from_s: f64,
    /// Until when.
    pub to_s: f64,
    /// In words.
    pub sentence: String,
}

/// How far the result can be trusted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntegrityMetrics {
    /// Median over the poses of the bound that the position error does not exceed with a probability of 99 %, after
    /// alignment over the first 20 s, m; `None` where more than half of the poses have no bound.
    pub bound_m_99: Option<f64>,
    /// Largest bound of a pose that has one, m.
    pub largest_bound_m: Option<f64>,
    /// From when the result is not good, s after the first measurement; `None` where it is.
    pub since_s: Option<f64>,
    /// Why, the worst first.
    pub causes: Vec<CauseMetrics>,
    /// Where the truth is known: share of the poses whose error is within their bound.
    pub within_bound: Option<f64>,
    /// Where the truth is known: median of bound over error.
    pub bound_over_error: Option<f64>,
    /// Where the truth is known: position error after that alignment, root mean square, m.
    pub aligned_rmse_m: Option<f64>,
    /// Where the truth is known: largest position error after that alignment, m.
    pub largest_error_m: Option<f64>,
}

impl EventMetrics {
    /// One line for a terminal.
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

/// The verdict in one sentence; `None` where there is no estimate.
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

    fn judged(status: &str, causes: Vec<CauseMetrics>) -> Metrics {
        let integrity = IntegrityMetrics { bound_m_99: Some(0.0062), causes, ..IntegrityMetrics::default() };
        Metrics { status: Some(status.to_owned()), integrity, ..Metrics::default() }
    }

    #[test]
    fn the_verdict_names_its_first_cause_and_its_time() {
        assert_eq!(verdict(&Metrics::default()), None);
        assert_eq!(verdict(&judged("good", vec![])).unwrap(), "good: 99 % of position errors below 6.20 mm");
        let cause = |status: &str| CauseMetrics {
            status: status.to_owned(),
            kind: "gap".to_owned(),
            from_s: 3.25,
            to_s: 4.25,
            sentence: "gap of 1.00 s in the IMU data".to_owned(),
        };
        let degraded = verdict(&judged("degraded", vec![cause("degraded")])).unwrap();
        assert_eq!(degraded, "degraded: gap of 1.00 s in the IMU data, 3.2 to 4.2 s");
        let lost = verdict(&judged("lost", vec![cause("lost")])).unwrap();
        assert_eq!(lost, "lost: gap of 1.00 s in the IMU data, from 3.2 s");
    }

    #[test]
    fn a_kind_of_event_is_one_line() {
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
