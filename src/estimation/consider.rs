//! How uncertain the trajectory is, with all that a window takes for exact.
//!
//! A window is solved with its beginning and its fixed views held where they stand. Their errors are its errors too: with the
//! window's answer linear in them, `e' = A e + sum V_k e_k + q`, the joint covariance of the beginning and of all views that
//! are kept goes on from window to window (Schmidt's consider covariance, 1966; as in the stochastic cloning of Roumeliotis
//! and Burdick, 2002, a view that is kept is a copy of the beginning's error at that time). Without views `A` is the identity
//! and the errors walk away; where an old view is seen again, `A` vanishes and the error is the view's.
//!
//! An error is six numbers: a small turn (rad) of all that hangs on a part about its pivot, then a shift (m), in the map.

use super::views::{MAP, Taken};
use crate::geometry::{Vector, skew};
use nalgebra::Matrix6;

/// How little is known after a silence: turn, rad, and shift, m.
const LOST: (f64, f64) = (1.0, 1.0);

/// What a window's solution owes to what it held fixed.
#[derive(Debug, Clone)]
pub(super) struct Sensitivity {
    /// Where the error is told, IMU's place, m.
    pub(super) pivot: Vector,
    /// `A`: by the error of the window's beginning.
    pub(super) beginning: Matrix6<f64>,
    /// `V_k`: by the error of each view in use, by its number.
    pub(super) views: Vec<(u64, Matrix6<f64>)>,
    /// Covariance of what the window's own measurements add.
    pub(super) noise: Matrix6<f64>,
}

/// The joint covariance of the window's beginning and of the views that are kept.
#[derive(Debug, Clone)]
pub(super) struct Consider {
    pivot: Vector,
    beginning: Matrix6<f64>,
    views: Vec<View>,
}

#[derive(Debug, Clone)]
struct View {
    number: u64,
    /// With the beginning: `E[e_view e_beginning^T]`.
    with_beginning: Matrix6<f64>,
    /// With the views before it, then with itself.
    with_views: Vec<Matrix6<f64>>,
}

impl Consider {
    /// Of a map that begins at `pivot`: there the error is none, by definition.
    pub(super) fn new(pivot: Vector) -> Self {
        Self { pivot, beginning: Matrix6::zeros(), views: Vec::new() }
    }

    /// Of a map that goes on at `pivot` after a silence, in which the head went nobody knows where.
    pub(super) fn lost(pivot: Vector) -> Self {
        let mut sigmas = [LOST.0; 6];
        sigmas[3..].fill(LOST.1);
        let beginning = Matrix6::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into());
        Self { beginning, ..Self::new(pivot) }
    }

    /// Of a head that was found at `pivot` in a map, with an error against it of covariance `found`, the map's own being
    /// `of_map`.
    pub(super) fn found(pivot: Vector, found: Matrix6<f64>, of_map: Matrix6<f64>) -> Self {
        let map = View { number: MAP, with_beginning: of_map, with_views: vec![of_map] };
        Self { pivot, beginning: found + of_map, views: vec![map] }
    }

    /// The window's end is as uncertain as its beginning, which carries it along, and what measurements add by there.
    pub(super) fn carry(&mut self, end: &Sensitivity) {
        let mut rigidly = Matrix6::identity();
        rigidly.fixed_view_mut::<3, 3>(3, 0).copy_from(&-skew(&(end.pivot - self.pivot)));
        self.advance(&Sensitivity { beginning: rigidly, views: Vec::new(), ..end.clone() });
    }

    /// The window moves on: its new beginning is what `by` says of the old one and the views.
    pub(super) fn advance(&mut self, by: &Sensitivity) {
        let used: Vec<(usize, Matrix6<f64>)> = by
            .views
            .iter()
            .filter_map(|(number, v)| Some((self.views.iter().position(|view| view.number == *number)?, *v)))
            .collect();
        // E[e_view e'^T], then E[e_beginning e'^T].
        let with_new: Vec<Matrix6<f64>> = (0..self.views.len())
            .map(|k| {
                let start = self.views[k].with_beginning * by.beginning.transpose();
                used.iter().fold(start, |sum, (other, v)| sum + self.between(k, *other) * v.transpose())
            })
            .collect();
        let old_with_new = used.iter().fold(self.beginning * by.beginning.transpose(), |sum, (other, v)| {
            sum + self.views[*other].with_beginning.transpose() * v.transpose()
        });
        let start = by.beginning * old_with_new + by.noise;
        let new = used.iter().fold(start, |sum, (other, v)| sum + v * with_new[*other]);
        self.beginning = (new + new.transpose()) * 0.5;
        self.pivot = by.pivot;
        for (view, with_new) in self.views.iter_mut().zip(with_new) {
            view.with_beginning = with_new;
        }
    }

    /// About what the beginning's error turns: where the IMU was then, m.
    pub(super) fn pivot(&self) -> Vector {
        self.pivot
    }

    /// Views were kept and forgotten.
    pub(super) fn take(&mut self, taken: Taken) {
        if let Some(number) = taken.forgotten {
            self.forget(number);
        }
        if let Some(number) = taken.kept {
            self.keep(number);
        }
    }

    /// A view is kept that shares the beginning's error; told about where its pivot is now.
    fn keep(&mut self, number: u64) {
        let with_beginning = self.beginning;
        let before = self.views.iter().map(|view| view.with_beginning.transpose());
        let with_views = before.chain([self.beginning]).collect();
        self.views.push(View { number, with_beginning, with_views });
    }

    /// A view is forgotten.
    fn forget(&mut self, number: u64) {
        let Some(at) = self.views.iter().position(|view| view.number == number) else { return };
        self.views.remove(at);
        for view in &mut self.views[at..] {
            view.with_views.remove(at);
        }
    }

    /// Covariance of position and then attitude, in the map's axes, of what hangs on the beginning at `place`: m^2, m rad,
    /// rad^2.
    pub(super) fn covariance_at(&self, place: &Vector) -> Matrix6<f64> {
        // shift = t + theta x (place - pivot)
        let mut by = Matrix6::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-skew(&(place - self.pivot)));
        by.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        by.fixed_view_mut::<3, 3>(3, 0).fill_with_identity();
        by * self.beginning * by.transpose()
    }

    /// `E[e_a e_b^T]` of two views.
    fn between(&self, a: usize, b: usize) -> Matrix6<f64> {
        if b <= a { self.views[a].with_views[b] } else { self.views[b].with_views[a].transpose() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    fn wave(seed: usize) -> Matrix6<f64> {
        Matrix6::from_fn(|r, c| 0.4 * ((seed * 7 + r * 5 + c * 3) as f64 * 0.61).sin())
    }

    fn sensitivity(seed: usize, views: &[u64]) -> Sensitivity {
        let root = wave(seed + 50);
        Sensitivity {
            pivot: Vector::zeros(),
            beginning: wave(seed),
            views: views.iter().map(|number| (*number, wave(seed + 9 + *number as usize))).collect(),
            noise: root * root.transpose() + Matrix6::identity() * 0.1,
        }
    }

    /// The same by the definition: every error as a row of coefficients of independent noises.
    #[test]
    fn the_joint_covariance_is_that_of_the_errors_written_out() {
        let mut consider = Consider::new(Vector::zeros());
        let sources = 6 * 8;
        let mut beginning = DMatrix::<f64>::zeros(6, sources);
        let mut views: Vec<(u64, DMatrix<f64>)> = Vec::new();
        for step in 0..8 {
            let used: Vec<u64> =
                views.iter().map(|view| view.0).filter(|n| (n + step as u64).is_multiple_of(2)).collect();
            let by = sensitivity(step, &used);
            consider.advance(&by);
            let mut next = DMatrix::from_fn(6, 6, |r, c| by.beginning[(r, c)]) * &beginning;
            for (number, v) in &by.views {
                let view = &views.iter().find(|view| view.0 == *number).unwrap().1;
                next += DMatrix::from_fn(6, 6, |r, c| v[(r, c)]) * view;
            }
            let root = by.noise.cholesky().unwrap().l();
            next.view_mut((0, 6 * step), (6, 6)).copy_from(&root);
            beginning = next;
            if step % 2 == 1 {
                consider.keep(step as u64);
                views.push((step as u64, beginning.clone()));
            }
            if step == 5 {
                consider.forget(3);
                views.retain(|view| view.0 != 3);
            }
        }
        let expected = &beginning * beginning.transpose();
        for r in 0..6 {
            for c in 0..6 {
                assert_relative_eq!(consider.beginning[(r, c)], expected[(r, c)], epsilon = 1e-12, max_relative = 1e-9);
            }
        }
    }

    #[test]
    fn a_head_that_a_map_holds_is_as_uncertain_as_the_map_whatever_it_was_when_it_was_found() {
        let (found, of_map) = (Matrix6::identity() * 0.3, Matrix6::identity() * 0.02);
        let by = |beginning: f64, map: f64| Sensitivity {
            beginning: Matrix6::identity() * beginning,
            views: vec![(MAP, Matrix6::identity() * map)],
            ..sensitivity(1, &[])
        };
        let noise = sensitivity(1, &[]).noise;
        let after = |step: &Sensitivity| {
            let mut consider = Consider::found(Vector::zeros(), found, of_map);
            consider.advance(step);
            consider.beginning
        };
        assert_relative_eq!(after(&by(0.0, 1.0)), of_map + noise, epsilon = 1e-12);
        assert_relative_eq!(after(&by(1.0, 0.0)), found + of_map + noise, epsilon = 1e-12);
        // Half and half: the map's error is in both halves, that of the finding in one.
        assert_relative_eq!(after(&by(0.5, 0.5)), found * 0.25 + of_map + noise, epsilon = 1e-12);
    }

    #[test]
    fn what_is_away_from_the_pivot_moves_with_its_turn() {
        // A turn of variance s^2 about z alone, seen 3 m along x: 9 s^2 along y, correlated with the turn.
        let mut noise = Matrix6::zeros();
        noise[(2, 2)] = 1e-6;
        let mut consider = Consider::new(Vector::zeros());
        let by = Sensitivity { pivot: Vector::zeros(), beginning: Matrix6::identity(), views: Vec::new(), noise };
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
