//! Poses over time.

use super::{Pose, Vector};
use crate::time::Stamp;

/// Poses at strictly increasing stamps, interpolated in between.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    stamps: Vec<Stamp>,
    poses: Vec<Pose>,
}

/// Why stamped poses are not a trajectory.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum TrajectoryError {
    /// A stamp not after the one before it.
    #[error("pose {index} is stamped {stamp_ns} ns, not after the one before it at {before_ns} ns")]
    NotIncreasing {
        /// Which pose, from 0.
        index: usize,
        /// Its stamp.
        stamp_ns: i64,
        /// The stamp before it.
        before_ns: i64,
    },
    /// A pose with NaN or infinity in it.
    #[error("pose {index} is not finite")]
    NotFinite {
        /// Which pose, from 0.
        index: usize,
    },
}

impl Trajectory {
    /// A trajectory without poses.
    pub fn new() -> Self {
        Self::default()
    }

    /// A trajectory of `stamped` poses, in order of time.
    ///
    /// # Errors
    /// When a stamp does not come after the one before it, or a pose is not finite.
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
    /// When `stamp` does not come after the last one, or the pose is not finite.
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

    /// How many poses.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there is no pose.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// The stamps, increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// The poses, one a stamp.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// First and last stamp.
    pub fn span(&self) -> Option<(Stamp, Stamp)> {
        Some((*self.stamps.first()?, *self.stamps.last()?))
    }

    /// Stamped poses in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Stamp, &Pose)> {
        self.stamps.iter().copied().zip(&self.poses)
    }

    /// The pose at `stamp`: linear in position, the shortest arc in rotation; `None` outside the span.
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

    /// The same poses seen in another world frame: each `a_from_b * b_from_body`.
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
    fn a_quarter_of_the_way_is_a_quarter_of_the_turn() {
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
    fn time_running_backwards_is_refused() {
        let poses = [(stamp(2), Pose::identity()), (stamp(1), Pose::identity())];
        let error = Trajectory::from_poses(poses).unwrap_err();
        assert_eq!(error, TrajectoryError::NotIncreasing { index: 1, stamp_ns: 1_000_000, before_ns: 2_000_000 });
        let nan = Pose::translation(f64::NAN, 0.0, 0.0);
        assert_eq!(Trajectory::from_poses([(stamp(0), nan)]).unwrap_err(), TrajectoryError::NotFinite { index: 0 });
    }
}
