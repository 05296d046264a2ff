//! The motion that the sensors measured: the open loop without the influence of its fixed views.

use crate::RegistrationSpec;
use crate::observed::MotionByViews;
use nalgebra::{Matrix6, Vector6};
use zsim_base::geometry::{Pose, Rotation, Trajectory, TrajectoryError, Vector};
use zsim_base::time::{Span, Stamp};

/// The open loop with the influence of the views removed from its motion; it drifts as an open loop without views.
///
/// Between the ends of a change, the change is interpolated; elsewhere, the motion is that of the open loop.
pub(super) fn sensed_motion(
    open_loop: &Trajectory,
    by_views: &[MotionByViews],
    origin: Stamp,
) -> Result<Trajectory, TrajectoryError> {
    let mut changes = by_views.iter().map(|change| HeadMotion::of(change, open_loop, origin)).peekable();
    let mut so_far = Pose::identity();
    let moved = |(stamp, pose): (Stamp, &Pose)| {
        let tau_s = stamp.seconds_since(origin);
        while let Some(passed) = changes.next_if(|motion| motion.change.until_s <= tau_s) {
            so_far *= passed.change.change;
        }
        let within = changes.peek().map_or(*pose, |motion| motion.partly(tau_s, pose));
        (stamp, so_far * within)
    };
    Trajectory::from_poses(open_loop.iter().map(moved))
}

/// Combines the motion without views with that of the open loop, which errs by a random walk of its own.
///
/// With the covariances `P` of the motion without views and `Q` of the open loop, the combination has the covariance `W P` with
/// `W = Q (Q + P)^-1`, and the fraction `W` of the change remains. Where the surfaces of the windows do not hold the motion, as
/// during a stop of the swing, it is that of the open loop.
pub(super) fn combined_with_open_loop(
    by_views: &[MotionByViews],
    open_loop: &Trajectory,
    origin: Stamp,
    spec: &RegistrationSpec,
) -> Vec<MotionByViews> {
    let (shift, turn) = (spec.view_drift_m_per_sqrt_s.powi(2), spec.view_turn_deg_per_sqrt_s.to_radians().powi(2));
    let q = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
    let combine = |motion: &MotionByViews| {
        let p = motion.covariance_per_s;
        let gain = (q + p).try_inverse().map_or_else(Matrix6::zeros, |inverse| q * inverse);
        let covariance = gain * p;
        let covariance_per_s = (covariance + covariance.transpose()) * 0.5;
        MotionByViews { covariance_per_s, ..HeadMotion::of(motion, open_loop, origin).scaled_by(&gain) }
    };
    by_views.iter().map(combine).collect()
}

/// A change as a rotation of the head about itself and a displacement.
struct HeadMotion<'a> {
    change: &'a MotionByViews,
    /// Rotation vector, map axes, rad.
    turn: Vector,
    /// Displacement of the head at the end of the change, m.
    displacement: Vector,
    /// Positions of the head at both ends in the open loop, m.
    ends: [Vector; 2],
}

impl<'a> HeadMotion<'a> {
    fn of(change: &'a MotionByViews, open_loop: &Trajectory, origin: Stamp) -> Self {
        let [start, end] = [change.from_s, change.until_s].map(|tau_s| {
            let pose = open_loop.at(origin + Span::from_seconds(tau_s));
            pose.or_else(|| open_loop.poses().last().copied()).unwrap_or_else(Pose::identity)
        });
        let displacement = (change.change * end).translation.vector - end.translation.vector;
        let ends = [start.translation.vector, end.translation.vector];
        Self { change, turn: change.change.rotation.scaled_axis(), displacement, ends }
    }

    /// The change with its rotation, and its translation as in the residuals of the registration, multiplied by `gain`.
    fn scaled_by(&self, gain: &Matrix6<f64>) -> MotionByViews {
        let [start, end] = self.ends;
        let half = (end - start) * 0.5;
        let translation = self.displacement + half.cross(&self.turn);
        let mut both = Vector6::zeros();
        both.fixed_rows_mut::<3>(0).copy_from(&self.turn);
        both.fixed_rows_mut::<3>(3).copy_from(&translation);
        let scaled = gain * both;
        let turn: Vector = scaled.fixed_rows::<3>(0).into_owned();
        let displacement = scaled.fixed_rows::<3>(3) - half.cross(&turn);
        let rotation = Rotation::from_scaled_axis(turn);
        let change = Pose::from_parts((end + displacement - rotation * end).into(), rotation);
        MotionByViews { change, ..*self.change }
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
    use zsim_base::geometry::from_roll_pitch_yaw;

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
            MotionByViews { from_s, until_s, change, covariance_per_s: Matrix6::zeros() }
        };
        // Nothing is known of the first half second; there the motion of both is the same.
        let changes: Vec<MotionByViews> = (1..9).map(change).collect();
        let (open_loop, expected) = (trajectory(true), trajectory(false));
        // Certain motion without views is used as it is, uncertain motion not at all.
        let spec = crate::load("default").unwrap().registration;
        let combined = |changes: &[MotionByViews]| combined_with_open_loop(changes, &open_loop, stamp(0), &spec);
        let uncertain: Vec<MotionByViews> =
            changes.iter().map(|c| MotionByViews { covariance_per_s: Matrix6::identity() * 1e6, ..*c }).collect();
        let kept = sensed_motion(&open_loop, &combined(&uncertain), stamp(0)).unwrap();
        for (is, should) in kept.poses().iter().zip(open_loop.poses()) {
            assert!((should.inverse() * is).translation.vector.norm() < 1e-6);
        }
        let sensed = sensed_motion(&open_loop, &combined(&changes), stamp(0)).unwrap();
        // After the last change, at 4.5 s, the motion is that of the open loop.
        for (k, (is, should)) in sensed.poses().iter().zip(expected.poses()).take(46).enumerate() {
            let error = should.inverse() * is;
            // Between the ends of a change it is interpolated linearly. A change of direction of 0.005 rad within 1 m moves the head
            // by the square of the distance: at most 0.005 * 1 m / 8 from the line.
            let (shift_m, turn_rad) = if k % 5 == 0 { (1e-9, 1e-9) } else { (7e-4, 2e-4) };
            assert!(error.translation.vector.norm() < shift_m, "{k}: {error}");
            assert!(error.rotation.angle() < turn_rad, "{k}: {error}");
        }
    }
}
