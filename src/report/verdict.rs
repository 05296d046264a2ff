//! The status of a run as one line.

use super::Metrics;
use super::quantity::length;

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
    use crate::{CauseMetrics, IntegrityMetrics};

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
}
