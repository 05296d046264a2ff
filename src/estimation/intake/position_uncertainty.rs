//! Uncertainty of the position while only the IMU is available.

use crate::strapdown::Interval;

/// Above this standard deviation of the position (m) a window of dead reckoning cannot be matched with the map again.
const MAX_SIGMA_M: f64 = 0.3;

/// Uncertainty that grows from the last return of the lidar on, due to the noise of the IMU.
///
/// Clipped and bridged samples dominate: the change of velocity of a shock is unknown by metres per second.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PositionUncertainty {
    velocity_variance_m2_per_s2: f64,
    position_sigma_m: f64,
}

impl PositionUncertainty {
    /// Adds the intervals of a segment without returns.
    pub(super) fn add(&mut self, intervals: &[(f64, Interval)]) {
        for (_, interval) in intervals {
            self.velocity_variance_m2_per_s2 += (interval.accel_sigma * interval.h).powi(2);
            self.position_sigma_m += self.velocity_variance_m2_per_s2.sqrt() * interval.h;
        }
    }

    /// Whether the position is too uncertain to continue without a new search in the map.
    pub(super) fn is_too_large(&self) -> bool {
        self.position_sigma_m > MAX_SIGMA_M
    }
}
