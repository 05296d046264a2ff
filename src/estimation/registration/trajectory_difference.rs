//! Difference of two trajectories.

use zsim_base::geometry::Trajectory;

/// Largest difference of two trajectories at the same stamps, m and rad.
pub(super) fn largest_difference(from: &Trajectory, to: &Trajectory) -> (f64, f64) {
    from.poses().iter().zip(to.poses()).fold((0.0, 0.0), |(shift, turn): (f64, f64), (from, to)| {
        let difference = to.translation.vector - from.translation.vector;
        (shift.max(difference.norm()), turn.max(from.rotation.angle_to(&to.rotation)))
    })
}
