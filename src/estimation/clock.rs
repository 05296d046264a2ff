//! The offset between the clocks of IMU and lidar.

use super::spec::EstimatorSpec;

/// Random walk of the rate of a clock offset, 1/sqrt(s): 0.2 ppm, a quartz at room temperature.
pub(super) const RATE_WALK_PER_SQRT_S: f64 = 2e-7;

/// Maximum time over which the clock drift is extrapolated, s.
///
/// A longer gap is a clock that was set, or a pause in which it may have been set. A rate error of 20 ppm would cause an
/// offset error of 1.7 s after a day.
const MAX_EXTRAPOLATION_S: f64 = 60.0;

/// Offset between the IMU clock and the lidar clock: IMU time `u = tau + l(tau)`, with lidar time `tau`.
///
/// The trajectory is in IMU time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    /// Offset `l` at `at_s`, s: positive if IMU stamps are later.
    pub(super) offset_s: f64,
    /// Rate of the offset, s/s.
    pub(super) rate: f64,
    /// Reference time of `offset_s`, lidar time, s.
    pub(super) at_s: f64,
}

impl Clock {
    /// The clock at the start of the data, at `at_s`, s.
    pub(super) fn starting(spec: &EstimatorSpec, at_s: f64) -> Self {
        Self { offset_s: spec.clock.start_s, rate: 0.0, at_s }
    }

    /// The offset at `tau_s`, lidar time, s.
    pub(super) fn offset_at(&self, tau_s: f64) -> f64 {
        self.offset_s + self.rate * (tau_s - self.at_s)
    }

    /// Converts lidar time to the time of the trajectory, s.
    pub(super) fn trajectory_s(&self, tau_s: f64) -> f64 {
        tau_s + self.offset_at(tau_s)
    }

    /// Converts the time of the trajectory to lidar time, s.
    pub(super) fn lidar_s(&self, trajectory_s: f64) -> f64 {
        trajectory_s - self.offset_at(trajectory_s)
    }

    /// The same clock after a gap from `from_s` to `to_s`.
    pub(super) fn after_gap(&self, from_s: f64, to_s: f64) -> Self {
        let drifted_s = (to_s - from_s).min(MAX_EXTRAPOLATION_S);
        Self { offset_s: self.offset_at(from_s + drifted_s), at_s: to_s, ..*self }
    }

    /// The same clock with another reference time, s.
    pub(super) fn with_reference_at(&self, at_s: f64) -> Self {
        Self { offset_s: self.offset_at(at_s), at_s, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drift_is_extrapolated_for_at_most_a_minute() {
        let clock = Clock { offset_s: 0.003, rate: 1e-4, at_s: 10.0 };
        let day = clock.after_gap(15.0, 86_415.0);
        assert!((day.offset_at(86_415.0) - (0.0035 + 1e-4 * MAX_EXTRAPOLATION_S)).abs() < 1e-12, "{day:?}");
        let second = clock.after_gap(15.0, 16.0);
        assert!((second.offset_at(16.0) - clock.offset_at(16.0)).abs() < 1e-12, "{second:?}");
    }
}
