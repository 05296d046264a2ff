//! The results of a run, of which the measures are figures.

use serde::{Deserialize, Serialize};
use zsim_base::time::Stamp;
use zsim_estimation::Status;
use zsim_evaluation::clock_errors;
use zsim_head::coverage::Coverage;
use zsim_head::spring::DesignMetrics;
use zsim_report::Metrics;

/// What must be computed for a figure of the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// The closed form of the linearised head, or a gain measurement.
    Head,
    /// The simulated swing of the head without ray casting.
    Swing,
    /// The swing in a journey, else the closed form.
    SwingOrHead,
    /// The open loop, from a recording.
    OpenLoop,
    /// The open loop, with the clock offset over time as detail of the run.
    ClockCurve,
    /// The closed loop, from a recording.
    ClosedLoop,
    /// The closed loop, and the information bound of the recording.
    SlamBound,
    /// An estimate whose cloud is compared with the true surfaces.
    Cloud,
    /// The same, and a second estimate from the recording of a reference system.
    Reference,
    /// A run with timing errors.
    Timing,
    /// The computing time of the open loop.
    OpenLoopTime,
    /// The computing time of the closed loop.
    ClosedLoopTime,
    /// The computing time of the run.
    WallClock,
}

impl Needs {
    /// Whether it is a computing time, which differs from run to run.
    pub fn is_time(self) -> bool {
        matches!(self, Self::OpenLoopTime | Self::ClosedLoopTime | Self::WallClock)
    }

    /// Whether it needs loop closure.
    pub fn is_of_closed_loop(self) -> bool {
        matches!(self, Self::ClosedLoop | Self::SlamBound | Self::ClosedLoopTime)
    }

    /// Whether a head on its spring has it in closed form.
    pub fn has_closed_form(self) -> bool {
        matches!(self, Self::Head | Self::SwingOrHead)
    }

    /// Whether it needs an estimate from a recording.
    pub fn is_of_estimate(self) -> bool {
        !matches!(self, Self::Head | Self::Swing | Self::SwingOrHead | Self::WallClock)
    }
}

/// The results of a run, as far as the measures of its study need them.
#[derive(Debug, Clone, Default)]
pub struct Results {
    /// The results of an estimate, as in its `metrics.json`.
    pub metrics: Metrics,
    /// Position error of the base computed with the rigid link, m.
    pub rigid_link_rmse_m: Option<f64>,
    /// Information bound with an unknown map, m.
    pub slam_bound_m: Option<f64>,
    /// Comparison of the cloud with that of the reference system.
    pub reference: ReferenceResults,
    /// The swing of the head without rays.
    pub swing: Option<Swing>,
    /// The closed form of the head.
    pub head: Option<DesignMetrics>,
    /// Peak gain of a gain measurement.
    pub peak_gain: Option<f64>,
}

/// Comparison of a cloud with that of the reference system; m.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReferenceResults {
    /// Standard deviation of the distance along the normals.
    pub sigma_m: Option<f64>,
    /// Mean of the same distance.
    pub bias_m: Option<f64>,
    /// Position error of the reference system.
    pub rmse_m: Option<f64>,
}

/// The swing of the head without rays.
#[derive(Debug, Clone)]
pub struct Swing {
    /// Coverage of the lidar and use of the gyroscope's range.
    pub coverage: Coverage,
    /// Time in which coils touch, s.
    pub coil_contact_s: f64,
}

impl Results {
    /// The status as a number: 0 good, 1 degraded, 2 lost.
    pub fn status(&self) -> Option<f64> {
        let name = self.metrics.status.as_deref()?;
        let status = [Status::Good, Status::Degraded, Status::Lost].into_iter().find(|status| status.name() == name)?;
        Some(f64::from(status as u8))
    }
}

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
