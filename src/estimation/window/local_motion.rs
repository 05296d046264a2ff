//! The motion in the middle of a window from the IMU and the window's own surfels, without the fixed views.
//!
//! Views pull the trajectory towards the first map of a place, and repeat its distortion at every later visit. The registration
//! needs the motion that the sensors measured: the solution of the last linearisation without the matches with views, and
//! without the velocity at the start, which earlier windows took from views.

use super::Window;
use super::correspondence::{Counterpart, Match, Matches};
use super::equations::WeightedMatches;
use super::linearised::Linearised;
use crate::layout::Layout;
use crate::nominal::Correction;
use crate::normal_equations::Factor;
use crate::spline::Basis;
use crate::views::Views;
use nalgebra::Matrix6;
use zsim_base::geometry::{Pose, Rotation, skew};

/// The covariance of the motion is that over this time, s: errors of the velocity last longer than a step of the window.
const COVARIANCE_S: f64 = 2.0;

/// Motion of the IMU between two times by a window without views.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalMotion {
    pub(crate) imu_from_later_imu: Pose,
    /// Covariance of rotation (rad), then translation (m), in map axes, per second.
    pub(crate) covariance_per_s: Matrix6<f64>,
}

impl Window {
    /// The motion from `from_s` to `until_s`, trajectory time, without the views.
    ///
    /// `None` if the equations without them are singular. Changes the equations of the workspace.
    pub(crate) fn motion_without_views(
        &mut self,
        from_s: f64,
        until_s: f64,
        at: &Linearised,
        views: &Views,
    ) -> Option<LocalMotion> {
        let is_fixed = |one: &&Match| matches!(one.with, Counterpart::Fixed { .. });
        let fixed: Vec<_> = at.matches.all.iter().filter(is_fixed).copied().collect();
        let matches = Matches::of(fixed, &at.scene, &at.layout);
        let clock_reference_s = self.unknowns.clock.at_s;
        let (scene, robust) = (&at.scene, &at.robust);
        let weighted = WeightedMatches { scene, matches: &matches, views, robust, clock_reference_s, sign: -1.0 };
        weighted.sums(self.spec.extrinsics.estimated).add_to(&mut self.workspace.equations, &at.layout);
        let (total, moved) = (&at.total_before, self.border.total_step());
        let equations = &mut self.workspace.equations;
        self.start.remove_velocity(equations, &at.layout, total, moved, self.spec.knot_spacing_s);
        let mut factor = Factor::default();
        equations.factor(&mut factor).ok()?;
        let x: Vec<f64> = equations.solve(&factor).iter().zip(&at.step).map(|(without, with)| without - with).collect();
        let pose = |u_s: f64| {
            let by = Correction::of_spline(&Basis::at(u_s, self.spec.knot_spacing_s), at.layout.first_knot, &x);
            let now = self.pose_at(u_s);
            let position = now.translation.vector + by.translation;
            Pose::from_parts(position.into(), Rotation::from_scaled_axis(by.rotation) * now.rotation)
        };
        let motion = pose(from_s).inverse() * pose(until_s);
        let middle_s = 0.5 * (from_s + until_s);
        let (early_s, late_s) = (middle_s - COVARIANCE_S / 2.0, middle_s + COVARIANCE_S / 2.0);
        let covered = (early_s.max(self.start.u_s), late_s.min(self.nominal.end_s()));
        let covariance_per_s = self.covariance_of_motion(covered, &at.layout, &factor) / (covered.1 - covered.0);
        Some(LocalMotion { imu_from_later_imu: motion, covariance_per_s })
    }

    /// Covariance of rotation and translation between two times, trajectory time, by the equations of `factor`.
    ///
    /// With the shift `v` between the two, rotation and translation change by `dr_b - dr_a` and `dt_b - dt_a + v x (dr_a + dr_b) / 2`,
    /// as in the residuals of the registration.
    fn covariance_of_motion(&self, (from_s, until_s): (f64, f64), layout: &Layout, factor: &Factor) -> Matrix6<f64> {
        let ends = [from_s, until_s].map(|u_s| Basis::at(u_s, self.spec.knot_spacing_s));
        let shift = self.pose_at(until_s).translation.vector - self.pose_at(from_s).translation.vector;
        let half = skew(&shift) * 0.5;
        let columns: [Vec<f64>; 6] = std::array::from_fn(|row| {
            let mut column = vec![0.0; layout.size()];
            for (basis, sign) in ends.iter().zip([-1.0, 1.0]) {
                let first = layout.knot(basis.first);
                for (a, value) in basis.value.iter().enumerate() {
                    column[first + 6 * a + row] += sign * value;
                    for axis in (0..3).filter(|_| row >= 3) {
                        column[first + 6 * a + axis] += value * half[(row - 3, axis)];
                    }
                }
            }
            column
        });
        let solved = columns.each_ref().map(|column| factor.solve(column));
        Matrix6::from_fn(|r, c| solved[r].iter().zip(&columns[c]).map(|(a, b)| a * b).sum())
    }
}
