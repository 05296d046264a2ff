//! Interpolated pose fixes of the IMU.

use super::{BaseFix, FixSigmas, stamp};
use crate::estimation::EstimationError;
use crate::geometry::{Pose, Trajectory};
use crate::time::Stamp;

/// Maximum time between two fixes for interpolation, s.
const MAX_INTERPOLATION_S: f64 = 0.1;

/// Pose fixes of the IMU over time.
pub(super) struct Fixes {
    pub(super) origin: Stamp,
    pub(super) world_from_imu: Trajectory,
    sigmas: Vec<FixSigmas>,
}

impl Fixes {
    /// Converts fixes of the base to fixes of the IMU; seconds count from `origin`.
    pub(super) fn new(fixes: &[BaseFix], origin: Stamp, base_from_imu: &Pose) -> Result<Self, EstimationError> {
        let placed = fixes.iter().map(|fix| (fix.stamp, fix.world_from_base * base_from_imu));
        let world_from_imu =
            Trajectory::from_poses(placed).map_err(|error| EstimationError::Base(format!("invalid fixes: {error}")))?;
        Ok(Self { origin, world_from_imu, sigmas: fixes.iter().map(|fix| fix.sigmas).collect() })
    }

    /// Times of the first and the last fix, s.
    pub(super) fn span_s(&self) -> (f64, f64) {
        let span = self.world_from_imu.span().unwrap_or_default();
        (span.0.seconds_since(self.origin), span.1.seconds_since(self.origin))
    }

    /// Interpolated pose and uncertainty at `tau_s`; `None` outside of the fixes and in gaps.
    pub(super) fn at(&self, tau_s: f64) -> Option<(Pose, FixSigmas)> {
        let (at, stamps) = (stamp(self.origin, tau_s), self.world_from_imu.stamps());
        let after = stamps.partition_point(|stamp| *stamp <= at);
        let before = after.checked_sub(1)?;
        let after = after.min(stamps.len() - 1);
        if stamps[after].seconds_since(stamps[before]) > MAX_INTERPOLATION_S {
            return None;
        }
        let (a, b) = (self.sigmas[before], self.sigmas[after]);
        let worse =
            FixSigmas { position_m: a.position_m.max(b.position_m), rotation_rad: a.rotation_rad.max(b.rotation_rad) };
        Some((self.world_from_imu.at(at)?, worse))
    }
}
