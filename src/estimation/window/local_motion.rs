//! The motion in the middle of a window from the IMU and the window's own surfels, without the fixed views.
//!
//! Views pull the trajectory towards the first map of a place, and repeat its distortion at every later visit. The registration
//! needs the motion that the sensors measured: the solution of the last linearisation without the matches with views, and
//! without the velocity at the start, which earlier windows took from views.

use super::Window;
use super::correspondence::{Counterpart, Match, Matches};
use super::equations::WeightedMatches;
use super::linearised::Linearised;
use crate::estimation::nominal::Correction;
use crate::estimation::normal_equations::Factor;
use crate::estimation::spline::Basis;
use crate::geometry::{Pose, Rotation};

impl Window {
    /// The motion from `from_s` to `until_s`, trajectory time, without the views: `imu_from_later_imu`.
    ///
    /// `None` without views, or if the equations without them are singular. Changes the equations of the workspace.
    pub(in crate::estimation) fn motion_without_views(
        &mut self,
        from_s: f64,
        until_s: f64,
        at: &Linearised,
    ) -> Option<Pose> {
        let is_fixed = |one: &&Match| matches!(one.with, Counterpart::Fixed { .. });
        let fixed: Vec<_> = at.matches.all.iter().filter(is_fixed).copied().collect();
        if fixed.is_empty() {
            return None;
        }
        let matches = Matches::of(fixed, &at.scene);
        let clock_reference_s = self.unknowns.clock.at_s;
        let views =
            WeightedMatches { scene: &at.scene, matches: &matches, robust: &at.robust, clock_reference_s, sign: -1.0 };
        views.add_to(&mut self.workspace.equations, &at.layout, self.spec.extrinsics.estimated);
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
        Some(pose(from_s).inverse() * pose(until_s))
    }
}
