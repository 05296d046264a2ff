//! Covariance of the registered poses.
//!
//! The inverse of the normal equations of the last iteration is the joint covariance of all corrections ([`Reduction`]). The first
//! pose defines the map frame, so the error of a later pose is relative to that of the first: with the corrections `(dr, dt)` of
//! both,
//!
//! ```text
//! e_r = dr_k - dr_0       e_t = dt_k - dt_0 - dr_0 x (t_k - t_0)
//! ```

use super::corrected_trajectory::CorrectedTrajectory;
use super::equations::Equations;
use super::reduction::{CorrectionCovariance, Reduction, carried};
use crate::spline::Basis;
use nalgebra::Matrix6;
use zsim_base::geometry::{PoseCovariance, Vector};
use zsim_base::time::Stamp;

/// At most this many poses have a covariance from the equations; those between them are interpolated.
const MAX_EPOCHS: usize = 100;
/// At most this many knots are unknowns of the covariance: its cost grows with the cube.
const MAX_NODES: usize = 100;

/// Covariances of the registered poses at the stamps of `of_open_loop`, in order of time; `None` if the equations are singular.
///
/// Position (m), then attitude (rad), map axes. The first pose, which relative to itself is certain, has the covariance of the
/// open loop's: that of a pose within the first window.
pub(super) fn covariances(
    corrected: &CorrectedTrajectory,
    equations: &Equations,
    of_open_loop: &[(Stamp, PoseCovariance)],
) -> Option<Vec<PoseCovariance>> {
    let epochs = corrected.epochs(MAX_EPOCHS);
    let bases: Vec<Basis> = epochs.iter().map(|epoch| epoch.basis).collect();
    let reduction = Reduction::new(&corrected.knot_positions(), MAX_NODES);
    let of_corrections = reduction.covariances(equations, &bases)?;
    let (first, of_first) = (epochs.first()?, of_corrections.first()?.own);
    let mut of_poses: Vec<(Stamp, PoseCovariance)> = epochs
        .iter()
        .zip(&of_corrections)
        .map(|(epoch, of)| {
            let apart = epoch.position - first.position;
            (epoch.stamp, relative_to_first(of, &of_first, &apart))
        })
        .collect();
    if let (Some(first), Some((_, in_window))) = (of_poses.first_mut(), of_open_loop.first()) {
        first.1 = *in_window;
    }
    Some(of_open_loop.iter().map(|(stamp, _)| interpolated(&of_poses, *stamp)).collect())
}

/// The covariance of a pose that is `apart` from the first one, m.
fn relative_to_first(of: &CorrectionCovariance, of_first: &Matrix6<f64>, apart: &Vector) -> PoseCovariance {
    // The correction of the first pose, carried along rigidly.
    let carry = carried(apart);
    let cross = of.with_first * carry.transpose();
    let relative = of.own - cross - cross.transpose() + carry * of_first * carry.transpose();
    let mut reordered = PoseCovariance::zeros();
    for (row, column) in [(0, 0), (0, 3), (3, 0), (3, 3)] {
        let block = relative.fixed_view::<3, 3>(3 - row, 3 - column);
        reordered.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    }
    (reordered + reordered.transpose()) * 0.5
}

/// The covariance at `stamp`, linearly between its neighbours in `known`, which is not empty.
fn interpolated(known: &[(Stamp, PoseCovariance)], stamp: Stamp) -> PoseCovariance {
    let after = known.partition_point(|(at, _)| *at < stamp).min(known.len() - 1);
    let ((from, before), (to, next)) = (&known[after.saturating_sub(1)], &known[after]);
    if from == to {
        return *next;
    }
    let fraction = (stamp.seconds_since(*from) / to.seconds_since(*from)).clamp(0.0, 1.0);
    before * (1.0 - fraction) + next * fraction
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Vector6;

    /// If both poses move as one rigid body, their relative pose is certain.
    #[test]
    fn a_rigid_motion_of_the_trajectory_is_no_error_of_a_pose() {
        let mixed = Matrix6::from_fn(|r, c| ((r * 5 + c * c) as f64).cos());
        let of_first = mixed * mixed.transpose() * 1e-6;
        let apart = Vector::new(3.0, -2.0, 0.5);
        let mut carry = Matrix6::identity();
        for axis in 0..3 {
            let moved = Vector::ith(axis, 1.0).cross(&apart);
            carry.fixed_view_mut::<3, 1>(3, axis).copy_from(&moved);
        }
        let rigid = CorrectionCovariance { own: carry * of_first * carry.transpose(), with_first: carry * of_first };
        assert_relative_eq!(relative_to_first(&rigid, &of_first, &apart), PoseCovariance::zeros(), epsilon = 1e-18);
        // Independent errors add: of the heading of the first pose at a distance, and of the pose itself.
        let heading = Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, 1e-6, 0.0, 0.0, 0.0));
        let own = Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, 4e-6, 9e-6, 9e-6, 9e-6));
        let of = CorrectionCovariance { own, with_first: Matrix6::zeros() };
        let found = relative_to_first(&of, &heading, &(Vector::x() * 2.0));
        assert_relative_eq!(found[(1, 1)], 9e-6 + 4e-6, max_relative = 1e-12);
        assert_relative_eq!(found[(0, 0)], 9e-6, max_relative = 1e-12);
        assert_relative_eq!(found[(5, 5)], 5e-6, max_relative = 1e-12);
    }

    #[test]
    fn covariances_are_interpolated_and_constant_outside() {
        let at = Stamp::from_nanos;
        let known = [(at(0), PoseCovariance::zeros()), (at(10), PoseCovariance::identity())];
        for (stamp, expected) in [(-5, 0.0), (0, 0.0), (4, 0.4), (10, 1.0), (20, 1.0)] {
            assert_relative_eq!(interpolated(&known, at(stamp))[(0, 0)], expected);
        }
        assert_eq!(interpolated(&known[1..], at(0)), PoseCovariance::identity());
    }
}
