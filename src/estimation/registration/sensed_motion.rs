//! The motion that the sensors measured: the open loop without the influence of its fixed views.

use crate::estimation::observed::{MotionByViews, ObservedSurfels};
use crate::geometry::{Pose, Rotation, Trajectory, TrajectoryError, Vector};
use crate::time::{Span, Stamp};

/// The open loop with the influence of the views removed from its motion; it drifts as an open loop without views.
///
/// Between the ends of a change, the change is interpolated; elsewhere, the motion is that of the open loop.
pub(super) fn sensed_motion(open_loop: &Trajectory, observed: &ObservedSurfels) -> Result<Trajectory, TrajectoryError> {
    let mut changes =
        observed.by_views.iter().map(|change| HeadMotion::of(change, open_loop, observed.origin)).peekable();
    let mut so_far = Pose::identity();
    let moved = |(stamp, pose): (Stamp, &Pose)| {
        let tau_s = stamp.seconds_since(observed.origin);
        while let Some(passed) = changes.next_if(|motion| motion.change.until_s <= tau_s) {
            so_far *= passed.change.change;
        }
        let within = changes.peek().map_or(*pose, |motion| motion.partly(tau_s, pose));
        (stamp, so_far * within)
    };
    Trajectory::from_poses(open_loop.iter().map(moved))
}

/// A change as a rotation of the head about itself and a displacement.
struct HeadMotion<'a> {
    change: &'a MotionByViews,
    /// Rotation vector, map axes, rad.
    turn: Vector,
    /// Displacement of the head at the end of the change, m.
    displacement: Vector,
}

impl<'a> HeadMotion<'a> {
    fn of(change: &'a MotionByViews, open_loop: &Trajectory, origin: Stamp) -> Self {
        let end = open_loop.at(origin + Span::from_seconds(change.until_s));
        let end = end.or_else(|| open_loop.poses().last().copied()).unwrap_or_else(Pose::identity);
        let displacement = (change.change * end).translation.vector - end.translation.vector;
        Self { change, turn: change.change.rotation.scaled_axis(), displacement }
    }

    /// The pose of the head at `tau_s` with the part of the change up to then.
    fn partly(&self, tau_s: f64, pose: &Pose) -> Pose {
        let MotionByViews { from_s, until_s, .. } = self.change;
        let part = ((tau_s - from_s) / (until_s - from_s)).clamp(0.0, 1.0);
        let position = pose.translation.vector + self.displacement * part;
        Pose::from_parts(position.into(), Rotation::from_scaled_axis(self.turn * part) * pose.rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::from_roll_pitch_yaw;

    /// A walk with a change of direction; `bent` has a motion of its own between 1 and 3 s.
    fn pose(t_s: f64, bent: bool) -> Pose {
        let angle = 0.4 * t_s + if bent { 0.02 * (t_s.clamp(1.0, 3.0) - 1.0) } else { 0.0 };
        let position = Vector::new(2.0 * t_s, angle.sin(), if bent { 0.05 * (t_s.clamp(1.0, 3.0) - 1.0) } else { 0.0 });
        Pose::from_parts(position.into(), from_roll_pitch_yaw(0.1, -0.2, angle))
    }

    #[test]
    fn changes_by_views_are_removed_from_the_motion() {
        let stamp = |k: i64| Stamp::from_nanos(k * 100_000_000);
        let trajectory = |bent| {
            let poses = (0..50).map(|k| (stamp(k), pose(k as f64 * 0.1, bent)));
            Trajectory::from_poses(poses).unwrap()
        };
        let change = |k: usize| {
            let (from_s, until_s) = (0.5 * k as f64, 0.5 * (k + 1) as f64);
            let without = pose(from_s, false).inverse() * pose(until_s, false);
            let change = pose(from_s, true) * without * pose(until_s, true).inverse();
            MotionByViews { from_s, until_s, change }
        };
        // Nothing is known of the first half second; there the motion of both is the same.
        let observed = ObservedSurfels { by_views: (1..9).map(change).collect(), ..ObservedSurfels::default() };
        let (open_loop, expected) = (trajectory(true), trajectory(false));
        let sensed = sensed_motion(&open_loop, &observed).unwrap();
        for (k, (is, should)) in sensed.poses().iter().zip(expected.poses()).enumerate() {
            let error = should.inverse() * is;
            // Between the ends of a change of 5 cm and 0.6 degrees it is interpolated.
            let allowed = if k % 5 == 0 { 1e-9 } else { 2e-4 };
            assert!(error.translation.vector.norm() < allowed, "{k}: {error}");
            assert!(error.rotation.angle() < allowed, "{k}: {error}");
        }
    }
}
