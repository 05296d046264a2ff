//! Sensitivity of a window's solution to the start, to the views, and to the measurements.

use super::Window;
use super::correspondence::{Counterpart, Match};
use super::linearised::Linearised;
use crate::consider::{IMU_OFFSET, IMU_STATES, START_STATES, Sensitivity, StartMatrix};
use crate::layout::{LIDAR_ROTATION, Layout};
use crate::residual::matched::{self, SurfelJacobian};
use crate::residual::prior::ByLidar;
use crate::spline::Basis;
use crate::vectorised::vectorised;
use crate::views::Views;
use nalgebra::{Matrix6, SMatrix};
use rayon::prelude::*;
use zsim_base::geometry::Vector;

/// Number of a view, and a column of the right-hand side for each component of its error.
type ViewColumns = (u64, [Vec<f64>; 6]);

impl Window {
    /// Sensitivities of the states at `times_s`, trajectory time, to the quantities that this window assumes fixed.
    pub(crate) fn sensitivities_at<const T: usize>(
        &self,
        times_s: [f64; T],
        at: &Linearised,
        views: &Views,
    ) -> [Option<Sensitivity>; T] {
        let by_views = vectorised!(self.columns_of_views(at, views));
        let mut found = [const { None }; T];
        let of_times = found.par_iter_mut().zip(times_s);
        of_times.for_each(|(found, u_s)| *found = self.sensitivity_at(u_s, at, &by_views));
        found
    }

    /// Sensitivity of the states at `u_s`; `by_views` as from [`Self::columns_of_views`].
    fn sensitivity_at(&self, u_s: f64, at: &Linearised, by_views: &[ViewColumns]) -> Option<Sensitivity> {
        let size = at.layout.size();
        let inherited = self.columns_at(u_s, &at.layout);
        // H^-1 is symmetric: the solutions for these rows serve all fixed quantities.
        let solved: Vec<Vec<f64>> = inherited.iter().map(|column| self.workspace.factor.solve(column)).collect();
        let by = |r: usize, column: &[f64]| (0..size).map(|k| solved[r][k] * column[k]).sum::<f64>();
        let by_start = self.columns_of_start(&at.layout);
        let of_start = SMatrix::<f64, START_STATES, 12>::from_fn(|r, c| by(r, &by_start[c]));
        let imu = self.border.imu_information()?;
        let of_imu = SMatrix::<f64, START_STATES, IMU_STATES>::from_fn(|r, c| solved[r][at.layout.border() + c]) * imu;
        let mut start = StartMatrix::zeros();
        start.fixed_columns_mut::<12>(0).copy_from(&of_start);
        start.fixed_columns_mut::<IMU_STATES>(IMU_OFFSET).copy_from(&of_imu);
        // The remainder of the covariance after subtraction of the start's part, which `ConsiderCovariance` propagates.
        let all = StartMatrix::from_fn(|r, c| by(r, &inherited[c]));
        let own = all - start * self.known_at_start()? * start.transpose();
        Some(Sensitivity {
            pivot: self.nominal.at(u_s, &self.unknowns.biases.gyro).position,
            start,
            views: by_views.iter().map(|(number, c)| (*number, SMatrix::from_fn(|r, k| by(r, &c[k])))).collect(),
            noise: own + self.border.imu_random_walk(self.spec.step_s),
        })
    }

    /// Covariance of the start states, as the window's equations assume it.
    pub(crate) fn known_at_start(&self) -> Option<StartMatrix> {
        let sigma = |k: usize| self.start.sigmas[k / 6][k % 6 / 3];
        let mut known = StartMatrix::zeros();
        (0..12).for_each(|k| known[(k, k)] = sigma(k).powi(2));
        let imu = self.border.imu_information()?.try_inverse()?;
        known.fixed_view_mut::<IMU_STATES, IMU_STATES>(IMU_OFFSET, IMU_OFFSET).copy_from(&imu);
        Some(known)
    }

    /// Regression of the corrections at `u_s` (trajectory time) and of their derivatives on the lidar extrinsics.
    ///
    /// With all other unknowns solved: `P_xl P_ll^-1` of the covariances `P`. None if the extrinsics are not estimated.
    pub(super) fn regression_on_lidar(&self, u_s: f64, at: &Linearised) -> Option<ByLidar> {
        if !self.spec.extrinsics.estimated {
            return None;
        }
        let lidar = at.layout.border() + LIDAR_ROTATION;
        let covariances: [Vec<f64>; 6] = std::array::from_fn(|k| {
            let mut column = vec![0.0; at.layout.size()];
            column[lidar + k] = 1.0;
            self.workspace.factor.solve(&column)
        });
        // In standard deviations, because radians and metres have different magnitudes.
        let sigma = |k: usize| covariances[k][lidar + k].sqrt();
        let of_lidar = Matrix6::from_fn(|r, c| covariances[c][lidar + r] / (sigma(r) * sigma(c)));
        let information = of_lidar.try_inverse()?;
        let basis = Basis::at(u_s, self.spec.knot_spacing_s);
        let first = at.layout.knot(basis.first);
        let by_lidar = |by: [f64; 4]| {
            let with_lidar = Matrix6::from_fn(|axis, k| {
                (0..4).map(|a| by[a] * covariances[k][first + 6 * a + axis]).sum::<f64>() / sigma(k)
            });
            let by_sigmas = with_lidar * information;
            Matrix6::from_fn(|axis, k| by_sigmas[(axis, k)] / sigma(k))
        };
        Some([basis.value, basis.rate, basis.acceleration].map(by_lidar))
    }

    /// The states that the next window inherits at `u_s`, as rows over the window's unknowns: the six corrections,
    /// rotation then translation, the derivatives, and the IMU part of the border.
    fn columns_at(&self, u_s: f64, layout: &Layout) -> [Vec<f64>; START_STATES] {
        let basis = Basis::at(u_s, self.spec.knot_spacing_s);
        let first = layout.knot(basis.first);
        std::array::from_fn(|of| {
            let mut column = vec![0.0; layout.size()];
            if of >= IMU_OFFSET {
                column[layout.border() + of - IMU_OFFSET] = 1.0;
                return column;
            }
            let by = if of < 6 { basis.value } else { basis.rate };
            by.iter().enumerate().for_each(|(k, by)| column[first + 6 * k + of % 6] = *by);
            column
        })
    }

    /// Change of the right-hand side per unit rotation, translation, and rate of each, of the window's start.
    fn columns_of_start(&self, layout: &Layout) -> [Vec<f64>; 12] {
        std::array::from_fn(|of| {
            let mut target = [[0.0; 6]; 2];
            target[of / 6][of % 6] = 1.0;
            self.start.right_hand_side(layout, &target[0], &target[1], self.spec.knot_spacing_s)
        })
    }

    /// Change of the right-hand side per unit rotation about the pivot and translation of each view in use.
    #[inline(always)]
    fn columns_of_views(&self, at: &Linearised, views: &Views) -> Vec<ViewColumns> {
        let mut columns: Vec<(u32, [Vec<f64>; 6])> = Vec::new();
        for Match { a, with, plane } in &at.matches.all {
            let Counterpart::Fixed { view: index, patch } = *with else { continue };
            let found = columns.iter().position(|(other, _)| *other == index);
            let index_in_columns = found.unwrap_or_else(|| {
                columns.push((index, std::array::from_fn(|_| vec![0.0; at.layout.size()])));
                columns.len() - 1
            });
            let (surfel, view) = (&at.scene[*a as usize], views.view(index as usize));
            let lever = surfel.patch.centre - view.pivot;
            let weight = at.robust.weight(plane, plane.distance_m);
            let turn: Vector = lever.cross(&plane.normal) * weight;
            let shift = plane.normal * weight;
            let by = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
            let side = SurfelJacobian::of(surfel, &plane.normal, self.unknowns.clock.at_s);
            let side = view.sighting(patch).map_or(side, |sighting| side.against_fixed(&plane.normal, sighting));
            matched::add_scaled_row(&mut columns[index_in_columns].1, &at.layout, &side, &surfel.basis, &by);
        }
        columns.into_iter().map(|(index, columns)| (views.view(index as usize).number, columns)).collect()
    }
}
