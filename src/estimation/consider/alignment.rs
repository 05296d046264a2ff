//! Covariance of the pose error after alignment of the trajectory with the truth over the first seconds.

use super::gauge::{Gauge, Mark};
use super::{ConsiderCovariance, START_STATES, View, pose_error_matrix};
use crate::output::TURN_LEVER_M;
use nalgebra::{Matrix6, SMatrix};
use zsim_base::geometry::Vector;
use zsim_base::time::Stamp;

/// The view number of the gauge; the last number is that of the map.
const GAUGE: u64 = u64::MAX - 1;
/// The view number of the first window start marked while the gauge is built; later ones count down from it.
const FIRST_MARK: u64 = GAUGE - 1;

impl ConsiderCovariance {
    /// [`ConsiderCovariance::covariance_at`] relative to the gauge; relative to the map if there is no gauge.
    pub(crate) fn covariance_against_gauge(&self, point: &Vector) -> Matrix6<f64> {
        let with_start = |at: usize| self.views[at].with_start.fixed_columns::<6>(0).into_owned();
        let by = pose_error_matrix(&(point - self.pivot));
        self.against_gauge(point, &by, &self.start.fixed_view::<6, 6>(0, 0).into_owned(), with_start)
    }

    /// The same for an error with covariance `own` and effect `by` on `point`; `with` returns the covariance of that error
    /// with the view at an index, here the gauge.
    fn against_gauge(
        &self,
        point: &Vector,
        by: &Matrix6<f64>,
        own: &Matrix6<f64>,
        with: impl Fn(usize) -> Matrix6<f64>,
    ) -> Matrix6<f64> {
        let own = by * own * by.transpose();
        let solved = self.gauge.and_then(|gauge| Some((gauge.pivot, gauge.normal.cholesky()?.inverse())));
        let (Some((pivot, solved)), Some(at)) = (solved, self.gauge_index()) else { return own };
        let by_gauge = pose_error_matrix(&(point - pivot)) * solved;
        let cross = by_gauge * with(at) * by.transpose();
        own + by_gauge * self.between(at, at) * by_gauge.transpose() - cross - cross.transpose()
    }

    /// Adds the current window start to the gauge.
    pub(crate) fn add_start_to_gauge(&mut self) {
        let own = self.start.fixed_view::<6, 6>(0, 0).into_owned();
        let with_start = self.start.fixed_rows::<6>(0).into_owned();
        let with_views: Vec<Matrix6<f64>> =
            self.views.iter().map(|view| view.with_start.fixed_columns::<6>(0).transpose()).collect();
        self.add_to_gauge(self.pivot, own, with_start, &with_views);
    }

    /// Builds the gauge again, from the window starts marked up to `until`.
    pub(crate) fn rebuild_gauge(&mut self, until: Stamp) {
        self.remove_view(GAUGE);
        self.gauge = None;
        for mark in self.marks.clone().iter().take_while(|mark| mark.stamp <= until) {
            let Some(at) = self.views.iter().position(|view| view.number == mark.number) else { continue };
            let with_views: Vec<Matrix6<f64>> = (0..self.views.len()).map(|other| self.between(at, other)).collect();
            self.add_to_gauge(mark.pivot, with_views[at], self.views[at].with_start, &with_views);
        }
    }

    /// Adds an error about `pivot` to the gauge: covariance `own`, and covariances with the window start and the views.
    fn add_to_gauge(
        &mut self,
        pivot: Vector,
        own: Matrix6<f64>,
        with_start: SMatrix<f64, 6, START_STATES>,
        with_views: &[Matrix6<f64>],
    ) {
        let at = self.gauge_index().unwrap_or_else(|| {
            let with_views = vec![Matrix6::zeros(); self.views.len() + 1];
            self.views.push(View { number: GAUGE, with_start: SMatrix::zeros(), with_views });
            self.views.len() - 1
        });
        let gauge = self.gauge.unwrap_or(Gauge { pivot, normal: Matrix6::zeros() });
        // The effect of the gauge on the position, and of the error on the gauge.
        let by = pose_error_matrix(&(pivot - gauge.pivot));
        let mut weight = Matrix6::identity();
        weight.fixed_view_mut::<3, 3>(3, 3).scale_mut(TURN_LEVER_M * TURN_LEVER_M);
        let from = by.transpose() * weight * pose_error_matrix(&Vector::zeros());
        let own = from * own * from.transpose();
        let with_old = from * with_views.get(at).copied().unwrap_or_default();
        for other in (0..self.views.len()).filter(|other| *other != at) {
            let more = from * with_views[other];
            if other < at {
                self.views[at].with_views[other] += more;
            } else {
                self.views[other].with_views[at] += more.transpose();
            }
        }
        self.views[at].with_start += from * with_start;
        self.views[at].with_views[at] += own + with_old + with_old.transpose();
        self.gauge = Some(Gauge { normal: gauge.normal + by.transpose() * weight * by, ..gauge });
    }

    /// Stores the current window start, at `stamp`, until the gauge is complete.
    pub(crate) fn mark_start(&mut self, stamp: Stamp) {
        let number = self.marks.last().map_or(FIRST_MARK, |last| last.number - 1);
        self.add_view(number);
        self.marks.push(Mark { number, pivot: self.pivot, stamp });
    }

    /// Stamp of the first marked window start.
    pub(crate) fn first_mark(&self) -> Option<Stamp> {
        self.marks.first().map(|mark| mark.stamp)
    }

    /// Removes the marks; returns their stamps and the covariances of their errors relative to the gauge.
    pub(crate) fn take_marks(&mut self) -> Vec<(Stamp, Matrix6<f64>)> {
        let marks = std::mem::take(&mut self.marks);
        let covariances = marks.iter().filter_map(|mark| {
            let own = self.views.iter().position(|view| view.number == mark.number)?;
            let with = |at: usize| self.between(at, own);
            let by = pose_error_matrix(&Vector::zeros());
            Some((mark.stamp, self.against_gauge(&mark.pivot, &by, &self.between(own, own), with)))
        });
        let covariances = covariances.collect();
        marks.iter().for_each(|mark| self.remove_view(mark.number));
        covariances
    }

    fn gauge_index(&self) -> Option<usize> {
        self.views.iter().position(|view| view.number == GAUGE)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Sensitivity;
    use super::super::tests::{sensitivity, wave};
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;

    /// Covariance relative to a gauge built from the window starts marked until then.
    fn rebuilt(consider: &ConsiderCovariance, until_ns: i64, point: &Vector) -> Matrix6<f64> {
        let mut of_marks = consider.clone();
        of_marks.rebuild_gauge(Stamp::from_nanos(until_ns));
        of_marks.covariance_against_gauge(point)
    }

    /// Compares with the definition: least-squares alignment of the errors of the window starts, each a row of coefficients
    /// of independent noises, by a singular value decomposition of the stacked equations.
    #[test]
    fn an_error_relative_to_the_gauge_is_the_residual_of_the_alignment() {
        let root = wave::<START_STATES>(31);
        let mut consider = ConsiderCovariance::new(Vector::new(0.3, -0.2, 0.1), &(root * root.transpose()));
        let sources = START_STATES * 7;
        let mut start = DMatrix::<f64>::zeros(START_STATES, sources);
        start.view_mut((0, 0), (START_STATES, START_STATES)).copy_from(&root);
        let point = Vector::new(4.0, -3.0, 1.0);
        let at = |start: &DMatrix<f64>, pivot: &Vector| {
            let by = pose_error_matrix(&(point - pivot));
            DMatrix::from_fn(6, 6, |r, c| by[(r, c)]) * start.rows(0, 6)
        };
        let mut weight = DMatrix::<f64>::identity(6, 6);
        (3..6).for_each(|k| weight[(k, k)] = TURN_LEVER_M);
        let (mut equations, mut errors) = (DMatrix::<f64>::zeros(24, 6), DMatrix::<f64>::zeros(24, sources));
        let mut marked = None;
        for step in 0..6 {
            let pivot = Vector::new(step as f64, 0.5 * step as f64, 0.1);
            let by = Sensitivity { pivot, ..sensitivity(step, &[]) };
            consider.advance(&by);
            start = DMatrix::from_fn(START_STATES, START_STATES, |r, c| by.start[(r, c)]) * &start;
            let root = by.noise.cholesky().unwrap().l();
            start.view_mut((0, START_STATES * (step + 1)), (START_STATES, START_STATES)).copy_from(&root);
            if step < 4 {
                consider.add_start_to_gauge();
                let (by, own) = (pose_error_matrix(&pivot), pose_error_matrix(&Vector::zeros()));
                let own = DMatrix::from_fn(6, 6, |r, c| own[(r, c)]) * start.rows(0, 6);
                equations.rows_mut(6 * step, 6).copy_from(&(&weight * DMatrix::from_fn(6, 6, |r, c| by[(r, c)])));
                errors.rows_mut(6 * step, 6).copy_from(&(&weight * &own));
                consider.mark_start(Stamp::from_nanos(step as i64));
                if step == 2 {
                    marked = Some((pivot, own));
                }
            }
            if step == 1 {
                consider.add_view(7);
            }
        }
        let pivot = consider.pivot();
        let aligned = equations.svd(true, true).solve(&errors, 1e-12).unwrap();
        let left = |error: &DMatrix<f64>, point: &Vector| {
            let by = pose_error_matrix(point);
            let error = error - DMatrix::from_fn(6, 6, |r, c| by[(r, c)]) * &aligned;
            &error * error.transpose()
        };
        let incremental = consider.covariance_against_gauge(&point);
        let (mark, own) = marked.unwrap();
        // Rebuilt from the same window starts, the gauge is the same; from half of them it differs.
        assert!((rebuilt(&consider, 1, &point) - incremental).norm() > 0.01 * incremental.norm());
        let rebuilt = rebuilt(&consider, 3, &point);
        let marks = consider.take_marks();
        assert_eq!(marks[2].0, Stamp::from_nanos(2));
        let expected = left(&at(&start, &pivot), &point);
        let pairs = [(incremental, expected.clone()), (rebuilt, expected), (marks[2].1, left(&own, &mark))];
        for (computed, expected) in pairs {
            for (r, c) in (0..6).flat_map(|r| (0..6).map(move |c| (r, c))) {
                assert_relative_eq!(computed[(r, c)], expected[(r, c)], epsilon = 1e-8, max_relative = 1e-8);
            }
        }
    }
}
