//! How uncertain the trajectory is, with all that a window takes for exact.
//!
//! A window is solved with the start and the fixed views held constant. Their errors enter the solution:
//! with the window's answer linear in them, `e' = A e + sum V_k e_k + q`, the joint covariance of the start and of
//! all stored views propagates from window to window (Schmidt's consider covariance, 1966; as in the stochastic
//! cloning of Roumeliotis and Burdick, 2002, a stored view is a copy of the start's error at that time).
//! Without views `A` is the identity and the errors random-walk; where an old view is re-observed, `A` vanishes and the
//! error is the view's.
//!
//! An error of a view is six numbers: a small rotation (rad) of the view about the pivot, then a shift (m), in
//! the map. The error of a start is the same about the IMU's position, with the time derivatives, and the IMU state
//! that the window inherits: biases and gravity's tilt. An error of velocity or bias persists over many windows:
//! without these terms, the vertical drift of a head that observes neither floor nor ceiling for seconds is four times
//! what the covariances of the separate windows predict.

mod gauge;

use self::gauge::{Gauge, Mark};
use super::residual::GYRO_BIAS;
use super::views::{MAP, ViewUpdate};
use crate::geometry::{Vector, skew};
use nalgebra::{Matrix6, SMatrix};

/// How little is known after a silence: turn, rad, and shift, m.
const GAP_SIGMA: (f64, f64) = (1.0, 1.0);

/// The inherited IMU state: the first of the border's unknowns, biases and gravity's tilt.
pub(super) const IMU_STATES: usize = 8;
/// The state at a window's start: rotation and shift, their derivatives, and [`IMU_STATES`].
pub(super) const START_STATES: usize = 12 + IMU_STATES;
/// Index of the IMU part in it.
pub(super) const IMU_OFFSET: usize = 12;
const _: () = assert!(GYRO_BIAS == 0, "the border starts with the inherited unknowns");

/// A matrix over the state at a window's start.
pub(super) type StartMatrix = SMatrix<f64, START_STATES, START_STATES>;

/// Sensitivity of a window's solution to the errors of its fixed quantities.
#[derive(Debug, Clone)]
pub(super) struct Sensitivity {
    /// Reference point of the error: the IMU's position, m.
    pub(super) pivot: Vector,
    /// `A`: by the error of the window's start.
    pub(super) start: StartMatrix,
    /// `V_k`: sensitivity to the error of each view in use, by view number.
    pub(super) views: Vec<(u64, SMatrix<f64, START_STATES, 6>)>,
    /// Covariance added by the window's measurements.
    pub(super) noise: StartMatrix,
}

/// The joint covariance of the window's start and of the stored views.
#[derive(Debug, Clone)]
pub(super) struct Consider {
    pivot: Vector,
    start: StartMatrix,
    views: Vec<View>,
    gauge: Option<Gauge>,
    marks: Vec<Mark>,
}

#[derive(Debug, Clone)]
struct View {
    number: u64,
    /// With the start: `E[e_view e_beginning^T]`.
    with_start: SMatrix<f64, 6, START_STATES>,
    /// With the views before it, then with itself.
    with_views: Vec<Matrix6<f64>>,
}

impl Consider {
    /// For a map with the origin at `pivot`: the pose error there is zero by definition. `known` is the covariance of
    /// the rest of the start's state.
    pub(super) fn new(pivot: Vector, known: &StartMatrix) -> Self {
        Self { pivot, start: *known, views: Vec::new(), gauge: None, marks: Vec::new() }
    }

    /// For a map that continues at `pivot` after a gap with unknown motion.
    pub(super) fn after_gap(pivot: Vector, known: &StartMatrix) -> Self {
        let mut sigmas = [GAP_SIGMA.0; 6];
        sigmas[3..].fill(GAP_SIGMA.1);
        let place = Matrix6::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into());
        Self::new(pivot, &with_pose_covariance(known, &place))
    }

    /// Of a head that was found at `pivot` in a map, with an error against it of covariance `found`, the map's own
    /// being `of_map`.
    pub(super) fn localised(pivot: Vector, known: &StartMatrix, (found, of_map): (Matrix6<f64>, Matrix6<f64>)) -> Self {
        let mut with_start = SMatrix::<f64, 6, START_STATES>::zeros();
        with_start.fixed_view_mut::<6, 6>(0, 0).copy_from(&of_map);
        let map = View { number: MAP, with_start, with_views: vec![of_map] };
        Self { views: vec![map], ..Self::new(pivot, &with_pose_covariance(known, &(found + of_map))) }
    }

    /// Sets the window's end: the uncertainty of the start, propagated, plus that of the measurements.
    pub(super) fn propagate_to(&mut self, end: &Sensitivity) {
        self.move_rigidly(end.pivot, end.noise);
    }

    /// Relocalised at `pivot` after a gap, with covariance `found`, by surfaces from before the gap, which have the
    /// uncertainty of that time; `known` as for [`Consider::new`].
    pub(super) fn relocalise(&mut self, pivot: Vector, known: &StartMatrix, found: &Matrix6<f64>) {
        self.move_rigidly(pivot, with_pose_covariance(known, found));
    }

    /// A rotation of the start moves `pivot` too; `noise` is the covariance of the remaining state.
    fn move_rigidly(&mut self, pivot: Vector, noise: StartMatrix) {
        let mut place = Matrix6::identity();
        place.fixed_view_mut::<3, 3>(3, 0).copy_from(&-skew(&(pivot - self.pivot)));
        let start = with_pose_covariance(&StartMatrix::zeros(), &place);
        self.advance(&Sensitivity { pivot, start, views: Vec::new(), noise });
    }

    /// Advances the window: the new start depends on the old one and the views as `by` states.
    pub(super) fn advance(&mut self, by: &Sensitivity) {
        let used: Vec<(usize, SMatrix<f64, START_STATES, 6>)> = by
            .views
            .iter()
            .filter_map(|(number, v)| Some((self.views.iter().position(|view| view.number == *number)?, *v)))
            .collect();
        // E[e_view e'^T], then E[e_beginning e'^T].
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

    /// Pivot of the start's rotation error: the IMU's position at that time, m.
    pub(super) fn pivot(&self) -> Vector {
        self.pivot
    }

    /// Updates the stored views: adds and removes.
    pub(super) fn update_views(&mut self, update: ViewUpdate) {
        if let Some(number) = update.removed {
            self.remove_view(number);
        }
        if let Some(number) = update.added {
            self.add_view(number);
        }
    }

    /// Stores a view with the start's error, relative to the current pivot.
    fn add_view(&mut self, number: u64) {
        let with_start = self.start.fixed_rows::<6>(0).into_owned();
        let place = |of: &SMatrix<f64, 6, START_STATES>| of.fixed_columns::<6>(0).into_owned();
        let before = self.views.iter().map(|view| place(&view.with_start).transpose());
        let with_views = before.chain([place(&with_start)]).collect();
        self.views.push(View { number, with_start, with_views });
    }

    /// A view is forgotten.
    fn remove_view(&mut self, number: u64) {
        let Some(at) = self.views.iter().position(|view| view.number == number) else { return };
        self.views.remove(at);
        for view in &mut self.views[at..] {
            view.with_views.remove(at);
        }
    }

    /// Covariance of position and then attitude, in the map's axes, of a point at `place` rigidly connected to the
    /// start: m^2, m rad, rad^2.
    pub(super) fn covariance_at(&self, place: &Vector) -> Matrix6<f64> {
        let by = pose_error_matrix(&(place - self.pivot));
        by * self.start.fixed_view::<6, 6>(0, 0) * by.transpose()
    }

    /// `E[e_a e_b^T]` of two views.
    fn between(&self, a: usize, b: usize) -> Matrix6<f64> {
        if b <= a { self.views[a].with_views[b] } else { self.views[b].with_views[a].transpose() }
    }
}

/// Effect of a rotation and a shift of the map on a point at `from_pivot` from the pivot: on position, then attitude.
fn pose_error_matrix(from_pivot: &Vector) -> Matrix6<f64> {
    // shift = t + theta x (place - pivot)
    let mut by = Matrix6::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-skew(from_pivot));
    by.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    by.fixed_view_mut::<3, 3>(3, 0).fill_with_identity();
    by
}

/// `known`, with `place` as the covariance of the window's pose.
fn with_pose_covariance(known: &StartMatrix, place: &Matrix6<f64>) -> StartMatrix {
    let mut all = *known;
    all.fixed_view_mut::<6, 6>(0, 0).copy_from(place);
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

    /// By the definition: every error as a row of coefficients of independent noises.
    #[test]
    fn the_joint_covariance_is_that_of_the_errors_written_out() {
        // The initial covariance, and the contribution of eight windows.
        let root = wave::<START_STATES>(31);
        let mut consider = Consider::new(Vector::zeros(), &(root * root.transpose()));
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
    fn a_head_that_a_map_holds_is_as_uncertain_as_the_map_whatever_it_was_when_it_was_found() {
        let (found, of_map) = (Matrix6::identity() * 0.3, Matrix6::identity() * 0.02);
        let place = |m: &StartMatrix| m.fixed_view::<6, 6>(0, 0).into_owned();
        let by = |start: f64, map: f64| Sensitivity {
            start: StartMatrix::identity() * start,
            views: vec![(MAP, SMatrix::identity() * map)],
            ..sensitivity(1, &[])
        };
        let noise = place(&sensitivity(1, &[]).noise);
        let after = |step: &Sensitivity| {
            let mut consider = Consider::localised(Vector::zeros(), &StartMatrix::zeros(), (found, of_map));
            consider.advance(step);
            place(&consider.start)
        };
        assert_relative_eq!(after(&by(0.0, 1.0)), of_map + noise, epsilon = 1e-12);
        assert_relative_eq!(after(&by(1.0, 0.0)), found + of_map + noise, epsilon = 1e-12);
        // Half and half: the map's error is in both halves, that of the finding in one.
        assert_relative_eq!(after(&by(0.5, 0.5)), found * 0.25 + of_map + noise, epsilon = 1e-12);
    }

    #[test]
    fn a_head_that_is_found_again_is_as_uncertain_as_what_was_seen_before_and_as_the_finding() {
        let root = wave::<START_STATES>(3);
        let before = root * root.transpose();
        let mut consider = Consider::new(Vector::zeros(), &before);
        consider.add_view(0);
        let there = Vector::new(1.0, -2.0, 0.5);
        let (known, found) = (StartMatrix::identity() * 0.7, Matrix6::identity() * 0.2);
        consider.relocalise(there, &known, &found);
        // The error of the old start at that position, and the relocalisation error.
        let old = Consider::new(Vector::zeros(), &before);
        let own = Consider::new(there, &with_pose_covariance(&known, &found));
        let expected = old.covariance_at(&there) + own.covariance_at(&there);
        assert_relative_eq!(consider.covariance_at(&there), expected, epsilon = 1e-12);
        // Velocity and biases are independent, as at any start.
        assert_relative_eq!(consider.start[(7, 7)], 0.7, epsilon = 1e-12);
        assert_relative_eq!(consider.start[(2, 13)], 0.0, epsilon = 1e-12);
        // The view's error is in it.
        assert!(consider.views[0].with_start.norm() > 0.1);
    }

    #[test]
    fn what_is_away_from_the_pivot_moves_with_its_turn() {
        // A rotation of variance s^2 about z only, observed 3 m along x: 9 s^2 along y, correlated with the rotation.
        let mut noise = StartMatrix::zeros();
        noise[(2, 2)] = 1e-6;
        let mut consider = Consider::new(Vector::zeros(), &StartMatrix::zeros());
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
