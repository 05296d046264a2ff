//! How a window's solution hangs on what it was given: its beginning, its views, and its own measurements.

use super::Window;
use super::correspondence::{Match, Matches, With};
use super::equations::Robust;
use crate::estimation::consider::Sensitivity;
use crate::estimation::residual::prior::ByLidar;
use crate::estimation::residual::{LIDAR_TURN, Layout, matched};
use crate::estimation::spline::Basis;
use crate::estimation::surfel::Placed;
use crate::estimation::views::Views;
use crate::geometry::{Vector, skew};
use nalgebra::Matrix6;

/// The last linearisation of a window that was solved, whose factor the workspace still holds.
#[derive(Debug)]
pub(in crate::estimation) struct Linearised {
    pub(super) layout: Layout,
    pub(super) scene: Vec<Placed>,
    pub(super) matches: Matches,
    pub(super) robust: Robust,
}

impl Window {
    /// How the pose at `u_s`, IMU time, hangs on what the window held fixed.
    pub(in crate::estimation) fn sensitivity_at(&self, u_s: f64, at: &Linearised, views: &Views) -> Sensitivity {
        let size = at.layout.size();
        let by_pose = self.columns_of_pose(u_s, &at.layout);
        // H^-1 is symmetric: solving for the pose's six rows serves all that is held.
        let solved: Vec<Vec<f64>> = by_pose.iter().map(|column| self.workspace.factor.solve(column)).collect();
        let times = |columns: &[Vec<f64>; 6]| {
            Matrix6::from_fn(|r, c| (0..size).map(|k| solved[r][k] * columns[c][k]).sum::<f64>())
        };
        let by_views = self.columns_of_views(at, views);
        Sensitivity {
            pivot: self.nominal.at(u_s, &self.biases.gyro).position,
            beginning: times(&self.columns_of_beginning(&at.layout)),
            views: by_views.iter().map(|(number, columns)| (*number, times(columns))).collect(),
            noise: times(&by_pose) * self.spec.solve.covariance_inflation,
        }
    }

    /// How the corrections at `u_s`, IMU time, and their derivatives hang on how the lidar sits on the IMU, all else being solved
    /// for: `P_xl P_ll^-1` of the covariances `P`. Nothing where that is not estimated.
    pub(super) fn hangs_on_lidar(&self, u_s: f64, at: &Linearised) -> Option<ByLidar> {
        if !self.spec.extrinsics.estimated {
            return None;
        }
        let lidar = at.layout.border() + LIDAR_TURN;
        let covariances: [Vec<f64>; 6] = std::array::from_fn(|k| {
            let mut column = vec![0.0; at.layout.size()];
            column[lidar + k] = 1.0;
            self.workspace.factor.solve(&column)
        });
        // In standard deviations: radians and metres are of different size.
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

    /// The six corrections at `u_s`, turn then shift, as rows over the window's unknowns.
    fn columns_of_pose(&self, u_s: f64, layout: &Layout) -> [Vec<f64>; 6] {
        let basis = Basis::at(u_s, self.spec.knot_spacing_s);
        let first = layout.knot(basis.first);
        std::array::from_fn(|axis| {
            let mut column = vec![0.0; layout.size()];
            for (k, value) in basis.value.iter().enumerate() {
                column[first + 6 * k + axis] = *value;
            }
            column
        })
    }

    /// What the right-hand side gains when the window's beginning is turned and shifted: the trajectory begins there, and
    /// leaves in a direction that turned along.
    fn columns_of_beginning(&self, layout: &Layout) -> [Vec<f64>; 6] {
        let motion = self.nominal.at(self.start.u_s, &self.biases.gyro);
        // The shift's rate under a turn theta is theta x v.
        let turning = -skew(&motion.velocity);
        std::array::from_fn(|axis| {
            let mut value = [0.0; 6];
            value[axis] = 1.0;
            let mut rate = [0.0; 6];
            if axis < 3 {
                rate[3..].copy_from_slice(turning.column(axis).as_slice());
            }
            self.start.right_hand_side(layout, (&value, &rate), self.spec.knot_spacing_s)
        })
    }

    /// What the right-hand side gains when a view is turned about its pivot and shifted, for each view in use.
    fn columns_of_views(&self, at: &Linearised, views: &Views) -> Vec<(u64, [Vec<f64>; 6])> {
        let mut columns: Vec<(u32, [Vec<f64>; 6])> = Vec::new();
        for Match { a, with, plane } in &at.matches.all {
            let With::Fixed { view: index, .. } = *with else { continue };
            let found = columns.iter().position(|(other, _)| *other == index);
            let place = found.unwrap_or_else(|| {
                columns.push((index, std::array::from_fn(|_| vec![0.0; at.layout.size()])));
                columns.len() - 1
            });
            let surfel = &at.scene[*a as usize];
            let lever = surfel.patch.centre - views.view(index as usize).pivot;
            let weight = at.robust.weight(plane, plane.distance_m);
            let turn: Vector = lever.cross(&plane.normal) * weight;
            let shift = plane.normal * weight;
            let by = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
            matched::add_scaled_row(&mut columns[place].1, &at.layout, (surfel, &plane.normal), &by, self.clock.at_s);
        }
        columns.into_iter().map(|(index, columns)| (views.view(index as usize).number, columns)).collect()
    }
}
