//! Construction of the gauge: the window beginnings over which the trajectory is aligned when errors are reported.

use crate::estimation::GAUGED_S;
use crate::estimation::consider::Consider;
use crate::geometry::PoseCovariance;
use crate::time::{Span, Stamp};

/// Interval between marked beginnings while the alignment is built, s.
const MARKED_EVERY_S: f64 = 1.0;

/// The alignment of the first seconds, under construction.
#[derive(Debug, Clone, Default)]
pub(super) struct Gauging {
    /// Until when beginnings are part of the gauge, IMU time, s.
    until_s: Option<f64>,
    /// The last beginning that was marked meanwhile, IMU time, s.
    marked_s: Option<f64>,
    /// How uncertain the marked beginnings are against the alignment.
    gauged: Vec<(Stamp, PoseCovariance)>,
}

impl Gauging {
    /// Adds the beginning at `until_s` (IMU time), lidar time `stamp`, to the alignment of the first seconds. For
    /// twice as long beginnings are marked: a run that ends meanwhile is aligned over the first half.
    pub(super) fn advance(&mut self, consider: &mut Consider, until_s: f64, stamp: Stamp) {
        let end_s = *self.until_s.get_or_insert(until_s + GAUGED_S);
        if until_s >= end_s + GAUGED_S {
            self.gauged.append(&mut consider.take_marks());
            return;
        }
        if until_s < end_s {
            consider.gauge_by_beginning();
        }
        if self.marked_s.is_none_or(|last_s| until_s - last_s >= MARKED_EVERY_S) {
            consider.mark_beginning(stamp);
            self.marked_s = Some(until_s);
        }
    }

    /// The run ends with a pose at `last`: if beginnings are still marked, those of the first half form the alignment.
    /// Returns the covariances of the marked beginnings relative to it.
    pub(super) fn finish(&mut self, consider: &mut Consider, last: Option<Stamp>) -> Vec<(Stamp, PoseCovariance)> {
        if let (Some(first), Some(last)) = (consider.first_mark(), last) {
            let half_s = (0.5 * last.seconds_since(first)).min(GAUGED_S);
            consider.gauge_by_marks(first + Span::from_seconds(half_s));
            self.gauged.append(&mut consider.take_marks());
        }
        std::mem::take(&mut self.gauged)
    }
}
