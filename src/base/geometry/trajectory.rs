//! Trajectories: poses over time.

use super::{Pose, Vector};
use crate::time::Stamp;

/// Poses at strictly increasing stamps, with linear interpolation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    stamps: Vec<Stamp>,
    poses: Vec<Pose>,
}

/// Errors of a sequence of stamped poses.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum TrajectoryError {
    /// A stamp is not later than the previous one.
    #[error("pose {index} has stamp {stamp_ns} ns, not later than the previous stamp {before_ns} ns")]
    NotIncreasing {
        /// Index of the pose, from 0.
        index: usize,
        /// Stamp of that pose, ns.
        stamp_ns: i64,
        /// Stamp of the previous pose, ns.
        before_ns: i64,
    },
    /// A pose contains NaN or infinity.
    #[error("pose {index} is not finite")]
    NotFinite {
        /// Index of the pose, from 0.
        index: usize,
    },
}

impl Trajectory {
    /// Creates an empty trajectory.
    pub fn new() -> Self {
        Self::default()
    }

    /// Creates a trajectory from `stamped` poses in order of time.
    ///
    /// # Errors
    /// When a stamp is not later than the previous one, or a pose is not finite.
    pub fn from_poses(stamped: impl IntoIterator<Item = (Stamp, Pose)>) -> Result<Self, TrajectoryError> {
        let mut trajectory = Self::new();
        for (stamp, pose) in stamped {
            trajectory.push(stamp, pose)?;
        }
        Ok(trajectory)
    }

    /// Appends a pose.
    ///
    /// # Errors
    /// When `stamp` is not later than the last one, or the pose is not finite.
    pub fn push(&mut self, stamp: Stamp, pose: Pose) -> Result<(), TrajectoryError> {
        let index = self.len();
        if let Some(before) = self.stamps.last().filter(|before| stamp <= **before) {
            return Err(TrajectoryError::NotIncreasing { index, stamp_ns: stamp.nanos(), before_ns: before.nanos() });
        }
        let finite = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite());
        if !finite {
            return Err(TrajectoryError::NotFinite { index });
        }
        self.stamps.push(stamp);
        self.poses.push(pose);
        Ok(())
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether the trajectory has no poses.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// The stamps, increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// The poses, one for each stamp.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// First and last stamp.
    pub fn span(&self) -> Option<(Stamp, Stamp)> {
        Some((*self.stamps.first()?, *self.stamps.last()?))
    }

    /// Stamped poses in order of time.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Stamp, &Pose)> {
        self.stamps.iter().copied().zip(&self.poses)
    }

    /// The pose at `stamp`; `None` outside the time span.
    ///
    /// Linear in position, shortest arc in rotation.
    pub fn at(&self, stamp: Stamp) -> Option<Pose> {
        let after = self.stamps.partition_point(|s| *s <= stamp);
        let before = after.checked_sub(1)?;
        if self.stamps[before] == stamp {
            return Some(self.poses[before]);
        }
        let (t0, t1) = (self.stamps[before], *self.stamps.get(after)?);
        let u = (stamp - t0).seconds() / (t1 - t0).seconds();
        let (a, b) = (&self.poses[before], &self.poses[after]);
        let position: Vector = a.translation.vector.lerp(&b.translation.vector, u);
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis();
        Some(Pose::from_parts(position.into(), super::Rotation::from_scaled_axis(turn * u) * a.rotation))
    }

    /// The same poses relative to another world frame: each `a_from_b * b_from_body`.
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self { stamps: self.stamps.clone(), poses: self.poses.iter().map(|pose| a_from_b * pose).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::from_roll_pitch_yaw;
    use approx::assert_relative_eq;

    fn stamp(ms: i64) -> Stamp {
        Stamp::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn interpolation_is_linear_in_position_and_rotation() {
        let end = Pose::from_parts(Vector::new(4.0, 0.0, 0.0).into(), from_roll_pitch_yaw(0.0, 0.0, 1.0));
        let line = Trajectory::from_poses([(stamp(0), Pose::identity()), (stamp(100), end)]).unwrap();
        let pose = line.at(stamp(25)).unwrap();
        assert_relative_eq!(pose.translation.vector.x, 1.0, epsilon = 1e-12);
        assert_relative_eq!(pose.rotation.angle(), 0.25, epsilon = 1e-12);
        assert_eq!(line.at(stamp(100)), Some(end));
        assert_eq!(line.at(stamp(101)), None);
        assert_eq!(line.at(stamp(-1)), None);
    }

    #[test]
    fn decreasing_stamps_and_non_finite_poses_are_rejected() {
        let poses = [(stamp(2), Pose::identity()), (stamp(1), Pose::identity())];
        let error = Trajectory::from_poses(poses).unwrap_err();
        assert_eq!(error, TrajectoryError::NotIncreasing { index: 1, stamp_ns: 1_000_000, before_ns: 2_000_000 });
        let nan = Pose::translation(f64::NAN, 0.0, 0.0);
        assert_eq!(Trajectory::from_poses([(stamp(0), nan)]).unwrap_err(), TrajectoryError::NotFinite { index: 0 });
    }
}
