//! Covariance of the trajectory, including the errors of the quantities that a window holds constant.
//!
//! A window is solved with its start and the fixed views held constant. Their errors enter the solution linearly,
//! `e' = A e + sum V_k e_k + q`, so the joint covariance of the start and of all stored views propagates from window to
//! window (Schmidt's consider covariance, 1966; as in the stochastic
//! cloning of Roumeliotis and Burdick, 2002, a stored view is a copy of the start's error at that time).
//! Without views, `A` is the identity and the errors follow a random walk. If an old view is re-observed, `A` vanishes
//! and the error is that of the view.
//!
//! The error of a view has six components: a small rotation (rad) about the pivot, then a translation (m), in the map
//! frame. The error of a window start has the same components about the IMU position, the time derivatives, and the
//! inherited IMU states: biases and tilt of gravity. An error of velocity or bias persists over many windows. Without
//! these terms, the vertical drift of a head that observes neither floor nor ceiling for seconds is four times the
//! prediction.

mod alignment;
mod gauge;

use self::gauge::{Gauge, Mark};
use super::views::{MAP, ViewUpdate};
use crate::layout::GYRO_BIAS;
use nalgebra::{Matrix6, SMatrix};
use zsim_base::geometry::{Vector, skew};

/// Standard deviations of the pose after a gap with unknown motion: rotation, rad, and translation, m.
const GAP_SIGMA: (f64, f64) = (1.0, 1.0);

/// Number of inherited IMU states, the first unknowns of the border: biases and tilt of gravity.
pub(super) const IMU_STATES: usize = 8;
/// Number of states at a window start: rotation and translation, their derivatives, and [`IMU_STATES`].
pub(super) const START_STATES: usize = 12 + IMU_STATES;
/// Index of the first IMU state.
pub(super) const IMU_OFFSET: usize = 12;
const _: () = assert!(GYRO_BIAS == 0, "the border starts with the inherited unknowns");

/// A matrix over the states at a window start.
pub(super) type StartMatrix = SMatrix<f64, START_STATES, START_STATES>;

/// Sensitivity of the solution of a window to the errors of the quantities held constant.
#[derive(Debug, Clone)]
pub(super) struct Sensitivity {
    /// Reference point of the error: the IMU position, m.
    pub(super) pivot: Vector,
    /// `A`: sensitivity to the error of the window start.
    pub(super) start: StartMatrix,
    /// `V_k`: sensitivity to the error of each view in use, by view number.
    pub(super) views: Vec<(u64, SMatrix<f64, START_STATES, 6>)>,
    /// Covariance added by the window's measurements.
    pub(super) noise: StartMatrix,
}

/// Consider covariance: the joint covariance of the window start and of the stored views.
#[derive(Debug, Clone)]
pub(super) struct ConsiderCovariance {
    pivot: Vector,
    start: StartMatrix,
    views: Vec<View>,
    gauge: Option<Gauge>,
    marks: Vec<Mark>,
}

/// Covariances of a stored view.
#[derive(Debug, Clone)]
struct View {
    number: u64,
    /// With the window start: `E[e_view e_start^T]`.
    with_start: SMatrix<f64, 6, START_STATES>,
    /// With the previous views, then the variance of the view.
    with_views: Vec<Matrix6<f64>>,
}

impl ConsiderCovariance {
    /// For a map with the origin at `pivot`: the pose error there is zero by definition. `known` is the covariance of the
    /// start states.
    pub(super) fn new(pivot: Vector, known: &StartMatrix) -> Self {
        Self { pivot, start: *known, views: Vec::new(), gauge: None, marks: Vec::new() }
    }

    /// For a map that continues at `pivot` after a gap with unknown motion.
    pub(super) fn after_gap(pivot: Vector, known: &StartMatrix) -> Self {
        let mut sigmas = [GAP_SIGMA.0; 6];
        sigmas[3..].fill(GAP_SIGMA.1);
        let pose_block = Matrix6::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into());
        Self::new(pivot, &with_pose_covariance(known, &pose_block))
    }

    /// For a head localised at `pivot` in a map: `found` is the covariance relative to the map, `of_map` that of the map.
    pub(super) fn localised(pivot: Vector, known: &StartMatrix, found: &Matrix6<f64>, of_map: &Matrix6<f64>) -> Self {
        let mut with_start = SMatrix::<f64, 6, START_STATES>::zeros();
        with_start.fixed_view_mut::<6, 6>(0, 0).copy_from(of_map);
        let map = View { number: MAP, with_start, with_views: vec![*of_map] };
        Self { views: vec![map], ..Self::new(pivot, &with_pose_covariance(known, &(found + of_map))) }
    }

    /// Propagates the covariance to the end of the window, and adds that of the measurements.
    pub(super) fn propagate_to(&mut self, end: &Sensitivity) {
        self.move_rigidly(end.pivot, end.noise);
    }

    /// Updates after relocalisation at `pivot` in the surfaces seen before a gap.
    ///
    /// These surfaces have the covariance from before the gap, to which `found`, that of the relocalisation, is added;
    /// `known` as for [`ConsiderCovariance::new`].
    pub(super) fn relocalise(&mut self, pivot: Vector, known: &StartMatrix, found: &Matrix6<f64>) {
        self.move_rigidly(pivot, with_pose_covariance(known, found));
    }

    /// Moves the reference point rigidly to `pivot` and adds the covariance `noise`.
    fn move_rigidly(&mut self, pivot: Vector, noise: StartMatrix) {
        let mut pose_block = Matrix6::identity();
        pose_block.fixed_view_mut::<3, 3>(3, 0).copy_from(&-skew(&(pivot - self.pivot)));
        let start = with_pose_covariance(&StartMatrix::zeros(), &pose_block);
        self.advance(&Sensitivity { pivot, start, views: Vec::new(), noise });
    }

    /// Advances to the next window start, with the sensitivities `by`.
    pub(super) fn advance(&mut self, by: &Sensitivity) {
        let used: Vec<(usize, SMatrix<f64, START_STATES, 6>)> = by
            .views
            .iter()
            .filter_map(|(number, v)| Some((self.views.iter().position(|view| view.number == *number)?, *v)))
            .collect();
        // E[e_view e'^T], then E[e_start e'^T].
        let with_new: Vec<SMatrix<f64, 6, START_STATES>> = (0..self.views.len())
            .map(|k| {
                let start = self.views[k].with_start * by.start.transpose();
                used.iter().fold(start, |sum, (other, v)| sum + self.between(k, *other) * v.transpose())
            })
            .collect();
        let old_with_new = used.iter().fold(self.start * by.start.transpose(), |sum, (other, v)| {
            sum + self.views[*other].with_start.transpose() * v.transpose()
        });
        let start = by.start * old_with_new + by.noise;
        let new = used.iter().fold(start, |sum, (other, v)| sum + v * with_new[*other]);
        self.start = (new + new.transpose()) * 0.5;
        self.pivot = by.pivot;
        for (view, with_new) in self.views.iter_mut().zip(with_new) {
            view.with_start = with_new;
        }
    }

    /// Reference point of the rotation error of the start: the IMU position at that time, m.
    pub(super) fn pivot(&self) -> Vector {
        self.pivot
    }

    /// Adds and removes stored views.
    pub(super) fn update_views(&mut self, update: ViewUpdate) {
        if let Some(number) = update.removed {
            self.remove_view(number);
        }
        if let Some(number) = update.added {
            self.add_view(number);
        }
    }

    /// Stores a view with the error of the window start.
    fn add_view(&mut self, number: u64) {
        let with_start = self.start.fixed_rows::<6>(0).into_owned();
        let pose_block = |of: &SMatrix<f64, 6, START_STATES>| of.fixed_columns::<6>(0).into_owned();
        let before = self.views.iter().map(|view| pose_block(&view.with_start).transpose());
        let with_views = before.chain([pose_block(&with_start)]).collect();
        self.views.push(View { number, with_start, with_views });
    }

    /// Removes a view.
    fn remove_view(&mut self, number: u64) {
        let Some(at) = self.views.iter().position(|view| view.number == number) else { return };
        self.views.remove(at);
        for view in &mut self.views[at..] {
            view.with_views.remove(at);
        }
    }

    /// Covariance of position, then attitude, of a point rigidly connected to the window start.
    ///
    /// Both are in the map frame: m^2, m rad, rad^2.
    pub(super) fn covariance_at(&self, point: &Vector) -> Matrix6<f64> {
        let by = pose_error_matrix(&(point - self.pivot));
        by * self.start.fixed_view::<6, 6>(0, 0) * by.transpose()
    }

    /// `E[e_a e_b^T]` of two views.
    fn between(&self, a: usize, b: usize) -> Matrix6<f64> {
        if b <= a { self.views[a].with_views[b] } else { self.views[b].with_views[a].transpose() }
    }
}

/// Effect of a rotation and a translation error on position and attitude of a point at `from_pivot` from the pivot.
fn pose_error_matrix(from_pivot: &Vector) -> Matrix6<f64> {
    // shift = t + theta x (point - pivot)
    let mut by = Matrix6::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-skew(from_pivot));
    by.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    by.fixed_view_mut::<3, 3>(3, 0).fill_with_identity();
    by
}

/// `known` with the pose block replaced.
fn with_pose_covariance(known: &StartMatrix, pose_block: &Matrix6<f64>) -> StartMatrix {
    let mut all = *known;
    all.fixed_view_mut::<6, 6>(0, 0).copy_from(pose_block);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    pub(super) fn wave<const C: usize>(seed: usize) -> SMatrix<f64, START_STATES, C> {
        SMatrix::from_fn(|r, c| 0.2 * ((seed * 7 + r * 5 + c * 3 + r * c) as f64 * 0.61).sin())
    }

    pub(super) fn sensitivity(seed: usize, views: &[u64]) -> Sensitivity {
        let root = wave::<START_STATES>(seed + 50);
        Sensitivity {
            pivot: Vector::zeros(),
            start: wave(seed),
            views: views.iter().map(|number| (*number, wave(seed + 9 + *number as usize))).collect(),
            noise: root * root.transpose() + StartMatrix::identity() * 0.1,
        }
    }

    /// Compares with the definition: every error as a row of coefficients of independent noises.
    #[test]
    fn the_joint_covariance_is_that_of_explicitly_propagated_errors() {
        // The initial covariance, and the contribution of eight windows.
        let root = wave::<START_STATES>(31);
        let mut consider = ConsiderCovariance::new(Vector::zeros(), &(root * root.transpose()));
        let sources = START_STATES * 9;
        let mut start = DMatrix::<f64>::zeros(START_STATES, sources);
        start.view_mut((0, START_STATES * 8), (START_STATES, START_STATES)).copy_from(&root);
        let mut views: Vec<(u64, DMatrix<f64>)> = Vec::new();
        for step in 0..8 {
            let used: Vec<u64> =
                views.iter().map(|view| view.0).filter(|n| (n + step as u64).is_multiple_of(2)).collect();
            let by = sensitivity(step, &used);
            consider.advance(&by);
            let mut next = DMatrix::from_fn(START_STATES, START_STATES, |r, c| by.start[(r, c)]) * &start;
            for (number, v) in &by.views {
                let view = &views.iter().find(|view| view.0 == *number).unwrap().1;
                next += DMatrix::from_fn(START_STATES, 6, |r, c| v[(r, c)]) * view;
            }
            let root = by.noise.cholesky().unwrap().l();
            next.view_mut((0, START_STATES * step), (START_STATES, START_STATES)).copy_from(&root);
            start = next;
            if step % 2 == 1 {
                consider.add_view(step as u64);
                views.push((step as u64, start.rows(0, 6).into_owned()));
            }
            if step == 5 {
                consider.remove_view(3);
                views.retain(|view| view.0 != 3);
            }
        }
        let expected = &start * start.transpose();
        for r in 0..START_STATES {
            for c in 0..START_STATES {
                assert_relative_eq!(consider.start[(r, c)], expected[(r, c)], epsilon = 1e-9, max_relative = 1e-9);
            }
        }
    }

    #[test]
    fn a_head_constrained_by_a_map_has_the_covariance_of_the_map() {
        let (found, of_map) = (Matrix6::identity() * 0.3, Matrix6::identity() * 0.02);
        let pose_block = |m: &StartMatrix| m.fixed_view::<6, 6>(0, 0).into_owned();
        let by = |start: f64, map: f64| Sensitivity {
            start: StartMatrix::identity() * start,
            views: vec![(MAP, SMatrix::identity() * map)],
            ..sensitivity(1, &[])
        };
        let noise = pose_block(&sensitivity(1, &[]).noise);
        let after = |step: &Sensitivity| {
            let mut consider = ConsiderCovariance::localised(Vector::zeros(), &StartMatrix::zeros(), &found, &of_map);
            consider.advance(step);
            pose_block(&consider.start)
        };
        assert_relative_eq!(after(&by(0.0, 1.0)), of_map + noise, epsilon = 1e-12);
        assert_relative_eq!(after(&by(1.0, 0.0)), found + of_map + noise, epsilon = 1e-12);
        // With equal weights, the map error is in both parts, the localisation error in one.
        assert_relative_eq!(after(&by(0.5, 0.5)), found * 0.25 + of_map + noise, epsilon = 1e-12);
    }

    #[test]
    fn relocalisation_adds_its_covariance_to_that_of_the_old_surfaces() {
        let root = wave::<START_STATES>(3);
        let before = root * root.transpose();
        let mut consider = ConsiderCovariance::new(Vector::zeros(), &before);
        consider.add_view(0);
        let there = Vector::new(1.0, -2.0, 0.5);
        let (known, found) = (StartMatrix::identity() * 0.7, Matrix6::identity() * 0.2);
        consider.relocalise(there, &known, &found);
        // The error of the old start at that position, and the relocalisation error.
        let old = ConsiderCovariance::new(Vector::zeros(), &before);
        let own = ConsiderCovariance::new(there, &with_pose_covariance(&known, &found));
        let expected = old.covariance_at(&there) + own.covariance_at(&there);
        assert_relative_eq!(consider.covariance_at(&there), expected, epsilon = 1e-12);
        // Velocity and biases are independent of the pose, as at any start.
        assert_relative_eq!(consider.start[(7, 7)], 0.7, epsilon = 1e-12);
        assert_relative_eq!(consider.start[(2, 13)], 0.0, epsilon = 1e-12);
        // The error is correlated with that of the view.
        assert!(consider.views[0].with_start.norm() > 0.1);
    }

    #[test]
    fn a_rotation_error_moves_a_distant_point() {
        // A rotation of variance s^2 about z only, observed 3 m along x: 9 s^2 along y, correlated with the rotation.
        let mut noise = StartMatrix::zeros();
        noise[(2, 2)] = 1e-6;
        let mut consider = ConsiderCovariance::new(Vector::zeros(), &StartMatrix::zeros());
        let by = Sensitivity { pivot: Vector::zeros(), start: StartMatrix::identity(), views: Vec::new(), noise };
        consider.advance(&by);
        let there = consider.covariance_at(&Vector::new(3.0, 0.0, 0.0));
        let moved = DVector::from_vec(vec![0.0, 3.0, 0.0, 0.0, 0.0, 1.0]);
        let expected = &moved * moved.transpose() * 1e-6;
        for r in 0..6 {
            for c in 0..6 {
                assert_relative_eq!(there[(r, c)], expected[(r, c)], epsilon = 1e-18);
            }
        }
    }
}
