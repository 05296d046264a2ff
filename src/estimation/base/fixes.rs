//! What the fixes say of the IMU's pose, at any instant.

use super::{BaseFix, FixSigmas, stamp};
use crate::estimation::EstimationError;
use crate::geometry::{Pose, Trajectory};
use crate::time::Stamp;

/// Between fixes that are farther apart than this nothing is said, s.
const LONGEST_STEP_S: f64 = 0.1;

/// Fixes of the IMU's pose.
pub(super) struct Fixes {
    pub(super) origin: Stamp,
    pub(super) world_from_imu: Trajectory,
    sigmas: Vec<FixSigmas>,
}

impl Fixes {
    /// Those that fixes of the base make, told in seconds after `origin`.
    pub(super) fn new(fixes: &[BaseFix], origin: Stamp, base_from_imu: &Pose) -> Result<Self, EstimationError> {
        let placed = fixes.iter().map(|fix| (fix.stamp, fix.world_from_base * base_from_imu));
        let world_from_imu =
            Trajectory::from_poses(placed).map_err(|error| EstimationError::Base(format!("its fixes: {error}")))?;
        Ok(Self { origin, world_from_imu, sigmas: fixes.iter().map(|fix| fix.sigmas).collect() })
    }

    /// The first and the last instant, s.
    pub(super) fn span_s(&self) -> (f64, f64) {
        let span = self.world_from_imu.span().unwrap_or_default();
        (span.0.seconds_since(self.origin), span.1.seconds_since(self.origin))
    }

    /// The pose at `tau_s`, and how well it is known; `None` outside of the fixes and in their holes.
    pub(super) fn at(&self, tau_s: f64) -> Option<(Pose, FixSigmas)> {
        let (at, stamps) = (stamp(self.origin, tau_s), self.world_from_imu.stamps());
        let after = stamps.partition_point(|stamp| *stamp <= at);
        let before = after.checked_sub(1)?;
        let after = after.min(stamps.len() - 1);
        if stamps[after].seconds_since(stamps[before]) > LONGEST_STEP_S {
            return None;
        }
        let (a, b) = (self.sigmas[before], self.sigmas[after]);
        let worse =
            FixSigmas { position_m: a.position_m.max(b.position_m), rotation_rad: a.rotation_rad.max(b.rotation_rad) };
        Some((self.world_from_imu.at(at)?, worse))
    }
}
