//! The status of a run as one line.

use super::Metrics;
use super::quantity::length;

/// Returns the status with its first cause, the position error and its bound, as one line; `None` without an estimate.
///
/// The error is that of the better estimate, where the truth is known. The bound is left out for a lost run: it is infinite from
/// the loss on.
pub(super) fn verdict(metrics: &Metrics) -> Option<String> {
    let status = metrics.status.as_deref()?;
    let integrity = &metrics.integrity;
    let is_lost = status == "lost";
    let cause = integrity.causes.first().map(|cause| match is_lost {
        true => format!("{}, from {:.1} s", cause.sentence, cause.from_s),
        false => cause.line(),
    });
    let rmse_m = metrics.closed_loop.position_rmse_m.or(metrics.open_loop.position_rmse_m);
    let rmse = rmse_m.map(|m| format!("RMSE {}", length(m)));
    let bound = match (integrity.bound_m_99, integrity.largest_bound_m) {
        _ if is_lost => None,
        (Some(median_m), Some(largest_m)) => {
            Some(format!("99 % bound: median {}, at most {}", length(median_m), length(largest_m)))
        }
        _ => Some("no error bound".to_owned()),
    };
    let parts: Vec<String> = [cause, rmse, bound].into_iter().flatten().collect();
    Some(format!("{status}: {}", parts.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CauseMetrics, IntegrityMetrics};

    fn with_status(status: &str, causes: Vec<CauseMetrics>) -> Metrics {
        let (bound_m_99, largest_bound_m) = (Some(0.0062), Some(0.0518));
        let integrity = IntegrityMetrics { bound_m_99, largest_bound_m, causes, ..IntegrityMetrics::default() };
        Metrics { status: Some(status.to_owned()), integrity, ..Metrics::default() }
    }

    #[test]
    fn the_verdict_contains_the_first_cause_the_error_and_its_bound() {
        assert_eq!(verdict(&Metrics::default()), None);
        let mut good = with_status("good", vec![]);
        assert_eq!(verdict(&good).unwrap(), "good: 99 % bound: median 6.20 mm, at most 51.8 mm");
        good.open_loop.position_rmse_m = Some(0.004);
        assert_eq!(verdict(&good).unwrap(), "good: RMSE 4.00 mm; 99 % bound: median 6.20 mm, at most 51.8 mm");
        good.closed_loop.position_rmse_m = Some(0.003);
        good.integrity.bound_m_99 = None;
        assert_eq!(verdict(&good).unwrap(), "good: RMSE 3.00 mm; no error bound");
        let cause = |status: &str| CauseMetrics {
            status: status.to_owned(),
            kind: "gap".to_owned(),
            from_s: 3.25,
            to_s: 4.25,
            sentence: "gap of 1.00 s in the IMU data".to_owned(),
        };
        let degraded = verdict(&with_status("degraded", vec![cause("degraded")])).unwrap();
        let expected =
            "degraded: gap of 1.00 s in the IMU data, 3.2 to 4.2 s; 99 % bound: median 6.20 mm, at most 51.8 mm";
        assert_eq!(degraded, expected);
        let lost = verdict(&with_status("lost", vec![cause("lost")])).unwrap();
        assert_eq!(lost, "lost: gap of 1.00 s in the IMU data, from 3.2 s");
    }
}
