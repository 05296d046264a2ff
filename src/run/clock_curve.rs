//! The clock offset of a run over time.

use serde::{Deserialize, Serialize};
use zsim_base::time::Stamp;
use zsim_evaluation::clock_errors;

/// Time between stored points, s.
const STEP_S: f64 = 1.0;

/// Estimated clock offset of a run, and its error, at points 1 s apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockCurve {
    /// Time since the first estimate, s.
    pub t_s: Vec<f64>,
    /// Estimated offset, IMU stamp minus lidar stamp of the same time, ms.
    pub offset_ms: Vec<f64>,
    /// Estimated minus true offset, ms.
    pub error_ms: Vec<f64>,
}

impl ClockCurve {
    /// The curve of estimated offsets with their true values, both over lidar time, s.
    pub(super) fn new(estimate: &[(Stamp, f64)], truth: &[(Stamp, f64)]) -> Self {
        let mut curve = Self { t_s: Vec::new(), offset_ms: Vec::new(), error_ms: Vec::new() };
        let Some((first, _)) = estimate.first() else { return curve };
        let mut offsets = estimate.iter();
        for (stamp, error_s) in clock_errors(estimate, truth) {
            let Some((_, offset_s)) = offsets.find(|(at, _)| *at == stamp) else { break };
            let t_s = stamp.seconds_since(*first);
            if curve.t_s.last().is_none_or(|last| t_s - last >= STEP_S) {
                curve.t_s.push(t_s);
                curve.offset_ms.push(offset_s * 1e3);
                curve.error_ms.push(error_s * 1e3);
            }
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_has_a_point_each_second_where_the_truth_is_known() {
        let at = |ms: i64| Stamp::from_nanos(ms * 1_000_000);
        let estimate: Vec<_> = (0..50).map(|k| (at(100 * k), 1e-3 * k as f64)).collect();
        let truth = [(at(1000), 0.0), (at(3500), 0.0)];
        let curve = ClockCurve::new(&estimate, &truth);
        assert_eq!(curve.t_s, [1.0, 2.0, 3.0]);
        assert_eq!(curve.offset_ms, [10.0, 20.0, 30.0]);
        assert_eq!(curve.error_ms, curve.offset_ms, "the true offset is 0");
        assert!(ClockCurve::new(&[], &truth).t_s.is_empty());
    }
}
