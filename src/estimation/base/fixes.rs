//! Interpolated pose fixes of the IMU.

use crate::EstimationError;
use zsim_base::geometry::{Pose, Trajectory};
use zsim_base::time::{Span, Stamp};

/// Maximum time between two fixes for interpolation, s.
const MAX_INTERPOLATION_S: f64 = 0.1;

/// A pose of the base from a source other than its IMU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseFix {
    /// Time on the clock of the head's trajectory.
    pub stamp: Stamp,
    /// The pose; the z axis of the world is vertical to about 0.5 degrees.
    pub world_from_base: Pose,
    /// Uncertainty of the pose.
    pub sigmas: FixSigmas,
}

/// Standard deviations of fixes averaged over 50 ms, for each axis.
///
/// Errors of fixes are correlated over longer times, so these values exceed the scatter of the fixes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixSigmas {
    /// Standard deviation of the position, m.
    pub position_m: f64,
    /// Standard deviation of the attitude, rad.
    pub rotation_rad: f64,
}

impl FixSigmas {
    /// Fixes from the spring model and an estimated head trajectory.
    ///
    /// Measured on seeds 701 and 702, office and courtyard, hand-held and on the vehicle, after levelling the map. Position
    /// error per axis: 0.1 to 0.2 mm between 0.3 and 1 Hz, 0.5 mm below 0.3 Hz. Attitude error: 0.01 degrees in both bands,
    /// 0.05 degrees above 6 Hz. With these values the gyroscope dominates above about 0.4 Hz.
    pub const SPRING: Self = Self { position_m: 1e-3, rotation_rad: 1e-3 };
    /// Fixes that assume the head at rest on the base. Hand-held, the error is 20 degrees and 20 mm, correlated over half a
    /// swing of the head.
    pub const RIGID_LINK: Self = Self { position_m: 0.05, rotation_rad: 0.4 };
}

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

/// Converts seconds after `origin` to a stamp.
fn stamp(origin: Stamp, seconds: f64) -> Stamp {
    origin + Span::from_seconds(seconds)
}
