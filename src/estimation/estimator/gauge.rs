//! Builds the gauge: the window starts over which the trajectory is aligned when errors are reported.

use crate::ALIGNMENT_S;
use crate::consider::ConsiderCovariance;
use zsim_base::geometry::PoseCovariance;
use zsim_base::time::{Span, Stamp};

/// Interval between marked window starts while the gauge is built, s.
const MARK_INTERVAL_S: f64 = 1.0;

/// Builds the alignment over the first seconds.
#[derive(Debug, Clone, Default)]
pub(super) struct GaugeBuilder {
    /// Window starts up to this time are part of the gauge, trajectory time, s.
    until_s: Option<f64>,
    /// Time of the last marked window start, trajectory time, s.
    marked_s: Option<f64>,
    /// Covariances of the marked window starts relative to the alignment.
    aligned_covariances: Vec<(Stamp, PoseCovariance)>,
}

impl GaugeBuilder {
    /// Adds the window start at `until_s` (trajectory time), `stamp` (lidar time), to the alignment over the first seconds.
    ///
    /// Window starts are marked for twice that time, because a run that ends earlier is aligned over its first half.
    pub(super) fn advance(&mut self, consider: &mut ConsiderCovariance, until_s: f64, stamp: Stamp) {
        let end_s = *self.until_s.get_or_insert(until_s + ALIGNMENT_S);
        if until_s >= end_s + ALIGNMENT_S {
            self.aligned_covariances.append(&mut consider.take_marks());
            return;
        }
        if until_s < end_s {
            consider.add_start_to_gauge();
        }
        if self.marked_s.is_none_or(|last_s| until_s - last_s >= MARK_INTERVAL_S) {
            consider.mark_start(stamp);
            self.marked_s = Some(until_s);
        }
    }

    /// Completes the gauge at the end of the run, with the last pose at `last`.
    ///
    /// If the gauge is not complete, the marked window starts of the first half form the alignment. Returns the
    /// covariances of the marked window starts relative to it.
    pub(super) fn finish(
        &mut self,
        consider: &mut ConsiderCovariance,
        last: Option<Stamp>,
    ) -> Vec<(Stamp, PoseCovariance)> {
        if let (Some(first), Some(last)) = (consider.first_mark(), last) {
            let half_s = (0.5 * last.seconds_since(first)).min(ALIGNMENT_S);
            consider.rebuild_gauge(first + Span::from_seconds(half_s));
            self.aligned_covariances.append(&mut consider.take_marks());
        }
        std::mem::take(&mut self.aligned_covariances)
    }
}
