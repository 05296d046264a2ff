//! Motion through a lidar gap, predicted with the IMU.

use super::strapdown::Interval;

/// After a longer lidar gap the IMU predicts no better than nothing, s; this also bounds the memory.
const MAX_SILENCE_S: f64 = 20.0;
/// Error of the predicted acceleration, m/s^2: errors of tilt (0.15 degrees), of the accelerometer bias and scale.
const ACCELERATION_SIGMA: f64 = 0.025;

/// The IMU intervals of a lidar gap in which the estimate has stopped.
#[derive(Debug, Clone, Default)]
pub(super) struct Coasting {
    intervals: Vec<Interval>,
    /// Time since the last scan, s.
    silent_s: f64,
    /// Whether the intervals do not cover the gap.
    is_incomplete: bool,
}

impl Coasting {
    /// Adds the intervals of a segment without returns, which ends `silent_s` after the last scan.
    pub(super) fn add(&mut self, intervals: &[(f64, Interval)], silent_s: f64) {
        self.silent_s = silent_s;
        if silent_s > MAX_SILENCE_S {
            self.interrupt();
        }
        if !self.is_incomplete {
            self.intervals.extend(intervals.iter().map(|(_, interval)| *interval));
        }
    }

    /// Adds the intervals of a segment with returns that the estimate skips.
    pub(super) fn add_skipped(&mut self, intervals: &[(f64, Interval)]) {
        let seconds: f64 = intervals.iter().map(|(_, interval)| interval.h).sum();
        self.add(intervals, self.silent_s + seconds);
    }

    /// Records that IMU data are missing or useless.
    pub(super) fn interrupt(&mut self) {
        self.is_incomplete = true;
        self.intervals = Vec::new();
    }

    /// The prediction, if the IMU covers the gap.
    pub(super) fn if_complete(self) -> Option<Self> {
        (!self.is_incomplete && !self.intervals.is_empty()).then_some(self)
    }

    /// The intervals, in order.
    pub(super) fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// Standard deviation of the predicted position, m.
    pub(super) fn position_sigma_m(&self) -> f64 {
        0.5 * ACCELERATION_SIGMA * self.silent_s.powi(2)
    }
}
