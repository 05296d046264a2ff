//! Pose graph optimisation of the trajectory spline with loop closures.
//!
//! With the accumulated correction `C` and the position `p` of the head, a relative pose between the times `a` and `b` has the
//! residuals
//!
//! ```text
//! e_r = [log(C_b^T C_a Rz^T)]_z          de_r = [C_b^T (dr_a - dr_b)]_z
//! e_t = C_b^T (p_a - p_b) - shift        de_t = C_b^T (dt_a - dt_b + (p_a - p_b) x dr_b)
//! ```
//!
//! Successive nodes are linked with the information of their registration, so the trajectory deforms where this is weak.
//! Loops first have a large standard deviation and a Geman-McClure kernel whose scale decreases in each step (graduated
//! non-convexity: Yang, Antonante, Tzoumas and Carlone, IEEE Robotics and Automation Letters 5(2), 2020). Loops that remain
//! inconsistent are removed as outliers; the others are then applied with their full information.

use super::RelativePose;
use super::alignment::Alignment;
use crate::nominal::Correction;
use crate::registration::corrected_trajectory::CorrectedTrajectory;
use crate::registration::equations::{Equations, PairTerm};
use crate::spline::Basis;
use nalgebra::{Matrix4, Matrix4x6, Vector4};
use zsim_base::geometry::{Rotation, Vector, skew};

/// Kernel scale of the first step, m: the largest expected drift; each step halves it.
const FIRST_SCALE_M: f64 = 10.0;
/// Number of steps with robust loops, and with the full information of the inliers.
const STEPS: (usize, usize) = (8, 4);
/// Standard deviation of a loop in the robust steps, m and rad.
const ROBUST_SIGMA: (f64, f64) = (0.5, 0.09);
/// Fraction of the information of links between successive nodes that is used: their match errors are correlated.
const LINK_INFORMATION: f64 = 0.1;
/// A loop with a larger residual after the robust steps is an outlier, m.
const OUTLIER_M: f64 = 1.0;
/// Lever arm that converts a residual heading to a distance, m: typical distance of surfaces.
const ARM_M: f64 = 4.0;
/// Maximum change of the relative pose of linked nodes, m; if the loops cause more, they are rejected together.
const MAX_STRAIN_M: f64 = 0.25;
/// Weak prior that determines unconstrained knots, 1/m^2 and 1/rad^2.
const PRIOR_INFORMATION: f64 = 1e-3;

/// Current pose of the head at the middle of a node.
#[derive(Debug, Clone)]
struct PlacePose {
    basis: Basis,
    position: Vector,
    turn: Rotation,
}

/// A relative pose with the current poses at both times.
#[derive(Debug, Clone)]
struct Edge {
    times_s: (f64, f64),
    late: PlacePose,
    early: PlacePose,
    alignment: Alignment,
    information: Matrix4<f64>,
    /// Deviation before the optimisation.
    initial: Vector4<f64>,
}

/// Optimises `corrected` with `loops` and `links` between successive nodes; returns the times of the inlier loops.
///
/// `None` if the loops contradict the links or the equations are singular; `corrected` is then invalid.
pub(in crate::registration) fn optimise(
    corrected: &mut CorrectedTrajectory,
    loops: &[RelativePose],
    links: &[RelativePose],
    level_sigma_rad: f64,
) -> Option<Vec<(f64, f64)>> {
    let (first_knot, knots) = corrected.knots();
    let edge = |measured: &RelativePose| Edge::new(measured, corrected);
    let mut loops: Vec<Edge> = loops.iter().map(edge).collect();
    let mut links: Vec<Edge> = links.iter().map(edge).collect();
    let mut full_information = false;
    let mut scale_m = FIRST_SCALE_M;
    for step in 0..STEPS.0 + STEPS.1 {
        if step == STEPS.0 {
            loops.retain(|edge| edge.residual_m() < OUTLIER_M);
            full_information = true;
        }
        let linked = links.iter().chain(&loops).map(|edge| (edge.early.basis.first, edge.late.basis.first));
        let mut equations = Equations::new(first_knot, knots, linked);
        corrected.add_to(&mut equations, level_sigma_rad);
        equations.add_diagonal(PRIOR_INFORMATION);
        links.iter().for_each(|link| link.add_to(&mut equations, &(link.information * LINK_INFORMATION)));
        for edge in &loops {
            edge.add_to(
                &mut equations,
                &if full_information { edge.information } else { edge.robust_information(scale_m) },
            );
        }
        let (x, _) = equations.solve()?;
        corrected.correct(&x);
        links.iter_mut().chain(&mut loops).for_each(|edge| edge.correct(first_knot, &x));
        scale_m = (0.5 * scale_m).max(OUTLIER_M);
    }
    let is_contradicted = !loops.is_empty() && links.iter().any(|link| link.strain_m() > MAX_STRAIN_M);
    (!is_contradicted).then(|| loops.iter().map(|edge| edge.times_s).collect())
}

impl Edge {
    fn new(measured: &RelativePose, corrected: &CorrectedTrajectory) -> Self {
        let place_pose = |tau_s: f64| {
            let (basis, position) = (corrected.basis_at(tau_s), corrected.pose_at(tau_s).translation.vector);
            PlacePose { basis, position, turn: Rotation::identity() }
        };
        let (late, early) = (place_pose(measured.times_s.0), place_pose(measured.times_s.1));
        let RelativePose { times_s, alignment, information } = *measured;
        let mut edge = Self { times_s, late, early, alignment, information, initial: Vector4::zeros() };
        edge.initial = edge.deviation();
        edge
    }

    /// `[e_r, e_t]`.
    fn deviation(&self) -> Vector4<f64> {
        let back = self.early.turn.inverse();
        let expected = Rotation::from_scaled_axis(Vector::z() * self.alignment.yaw);
        let twist = (back * self.late.turn * expected.inverse()).scaled_axis();
        let shift = back * (self.late.position - self.early.position) - self.alignment.shift;
        Vector4::new(twist.z, shift.x, shift.y, shift.z)
    }

    /// Norm of the residual, m; the heading is converted with `ARM_M`.
    fn residual_m(&self) -> f64 {
        norm_m(&self.deviation())
    }

    /// Change of the relative pose by the optimisation, m.
    ///
    /// Not the residual: a link may slip along a corridor, with little information but a large residual from the start.
    fn strain_m(&self) -> f64 {
        norm_m(&(self.deviation() - self.initial))
    }

    /// Derivatives of the deviation by the corrections `[dr, dt]` of the later and the earlier node.
    fn derivatives(&self) -> (Matrix4x6<f64>, Matrix4x6<f64>) {
        let back = self.early.turn.inverse().to_rotation_matrix().into_inner();
        let mut by_late = Matrix4x6::zeros();
        by_late.fixed_view_mut::<1, 3>(0, 0).copy_from(&back.row(2));
        by_late.fixed_view_mut::<3, 3>(1, 3).copy_from(&back);
        let mut by_early = -by_late;
        let difference = self.late.position - self.early.position;
        by_early.fixed_view_mut::<3, 3>(1, 0).copy_from(&(back * skew(&difference)));
        (by_late, by_early)
    }

    /// Information of a loop in the robust steps, with the Geman-McClure weight.
    fn robust_information(&self, scale_m: f64) -> Matrix4<f64> {
        let scale2 = scale_m * scale_m;
        let weight = (scale2 / (scale2 + self.residual_m().powi(2))).powi(2);
        let (shift, turn) = (ROBUST_SIGMA.0.powi(-2), ROBUST_SIGMA.1.powi(-2));
        Matrix4::from_diagonal(&Vector4::new(turn, shift, shift, shift)) * weight
    }

    fn add_to(&self, equations: &mut Equations, information: &Matrix4<f64>) {
        let (e, (by_late, by_early)) = (self.deviation(), self.derivatives());
        let mut link = PairTerm::default();
        let eigen = information.symmetric_eigen();
        for (axis, weight) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            link.add(&by_late.tr_mul(&axis), &by_early.tr_mul(&axis), axis.dot(&e), weight.max(0.0));
        }
        equations.add_unary(&self.late.basis, &link.first);
        equations.add_unary(&self.early.basis, &link.second);
        equations.add_cross(&self.late.basis, &self.early.basis, &link.cross);
    }

    fn correct(&mut self, first_knot: i64, x: &[f64]) {
        for place_pose in [&mut self.late, &mut self.early] {
            let by = Correction::of_spline(&place_pose.basis, first_knot, x);
            place_pose.turn = Rotation::from_scaled_axis(by.rotation) * place_pose.turn;
            place_pose.position += by.translation;
        }
    }
}

/// Norm of a deviation `[yaw, shift]`, m; the heading is converted with `ARM_M`.
fn norm_m(e: &Vector4<f64>) -> f64 {
    Vector::new(e[1], e[2], e[3]).norm().hypot(ARM_M * e[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;
    use crate::registration::places::with_pose_graph_drift;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Pose, Trajectory, from_roll_pitch_yaw};
    use zsim_base::time::Stamp;

    #[test]
    fn derivatives_match_finite_differences() {
        let place_pose = |seed: f64, yaw: f64| PlacePose {
            basis: Basis::at(0.3, 1.0),
            position: Vector::new(seed.sin(), (2.0 * seed).cos(), 0.3 * seed) * 4.0,
            turn: from_roll_pitch_yaw(1e-3, -2e-3, yaw),
        };
        let alignment = Alignment { yaw: 0.21, shift: Vector::new(0.4, -1.0, 0.1) };
        let information = Matrix4::identity();
        let edge = Edge {
            times_s: (9.0, 1.0),
            late: place_pose(1.0, 0.3),
            early: place_pose(2.5, 0.1),
            alignment,
            information,
            initial: Vector4::zeros(),
        };
        let (by_late, by_early) = edge.derivatives();
        let step = 1e-6;
        for axis in 0..6 {
            let mut x = [0.0; 24];
            (0..4).for_each(|knot| x[6 * knot + axis] = step);
            let back: Vec<f64> = x.iter().map(|value| -value).collect();
            let moved = |late: bool, x: &[f64]| {
                let mut moved = edge.clone();
                moved.correct(0, x);
                let (late, early) =
                    if late { (moved.late, edge.early.clone()) } else { (edge.late.clone(), moved.early) };
                Edge { late, early, ..edge.clone() }.deviation()
            };
            for (late, by) in [(true, &by_late), (false, &by_early)] {
                let difference = (moved(late, &x) - moved(late, &back)) / (2.0 * step);
                // The derivatives neglect products of the remaining twist (0.01 rad) with a correction.
                assert_relative_eq!(difference, by.column(axis).into_owned(), epsilon = 0.02);
            }
        }
    }

    /// A straight trajectory of two minutes at 0.8 m/s, and the middle times of thirty nodes.
    fn straight() -> (CorrectedTrajectory, Vec<f64>) {
        let stamp = |t_s: f64| Stamp::from_nanos((t_s * 1e9) as i64);
        let pose = |t_s: f64| Pose::from_parts(Vector::new(0.8 * t_s, 0.0, 1.2).into(), Rotation::identity());
        let poses = (0..1201).map(|k| 0.1 * f64::from(k)).map(|t_s| (stamp(t_s), pose(t_s)));
        let trajectory = Trajectory::from_poses(poses).unwrap();
        let with_pose_graph_drift = with_pose_graph_drift(&load("default").unwrap().registration);
        let corrected =
            CorrectedTrajectory::new(&trajectory, &trajectory, &[], stamp(0.0), &with_pose_graph_drift).unwrap();
        (corrected, (0..30).map(|k| 2.0 + 4.0 * f64::from(k)).collect())
    }

    /// Relative pose of two nodes that differ by `shift`, with sigmas of 1 cm and 0.1 degrees.
    fn relative_pose(times_s: (f64, f64), shift: Vector) -> RelativePose {
        let information = Matrix4::from_diagonal(&Vector4::new(3e5, 1e4, 1e4, 1e4));
        RelativePose { times_s, alignment: Alignment { yaw: 0.0, shift }, information }
    }

    fn links(at_s: &[f64]) -> Vec<RelativePose> {
        at_s.windows(2).map(|pair| relative_pose((pair[1], pair[0]), Vector::x() * 3.2)).collect()
    }

    fn end_m(corrected: &CorrectedTrajectory) -> Vector {
        corrected.pose_at(118.0).translation.vector
    }

    /// Identical storeys: five successive nodes match the nodes of 24 s before at 3.2 m instead of 19.2 m.
    #[test]
    fn consistent_false_loops_are_rejected_by_the_links() {
        let (mut corrected, at_s) = straight();
        let before = end_m(&corrected);
        let false_loops: Vec<RelativePose> =
            (10..15).map(|k| relative_pose((at_s[k], at_s[k - 6]), Vector::new(16.0, 0.0, 0.0))).collect();
        let closed = optimise(&mut corrected, &false_loops, &links(&at_s), 0.002).unwrap();
        assert!(closed.is_empty(), "{closed:?}");
        assert!((end_m(&corrected) - before).norm() < 0.05, "{}", end_m(&corrected));
    }

    /// Two successive nodes have no link, and the open loop drifted by 80 cm there: consistent loops across the gap are
    /// inliers, and a contradicting one is an outlier.
    #[test]
    fn loops_across_a_missing_link_are_accepted() {
        let (mut corrected, at_s) = straight();
        let before = end_m(&corrected);
        let mut remaining = links(&at_s);
        remaining.remove(14);
        let drift = Vector::new(0.2, 0.8, 0.0);
        let loops = (20..24).map(|k| relative_pose((at_s[k], at_s[k - 15]), Vector::x() * 48.0 + drift));
        let outlier = relative_pose((at_s[25], at_s[5]), Vector::x() * 64.0 - drift * 4.0);
        let loops: Vec<RelativePose> = loops.chain([outlier]).collect();
        let closed = optimise(&mut corrected, &loops, &remaining, 0.002).unwrap();
        assert_eq!(closed.len(), 4, "{closed:?}");
        assert!((end_m(&corrected) - before - drift).norm() < 0.1, "{}", end_m(&corrected) - before);
    }

    /// A corridor: each link is registered 1.6 m along it from the open loop, with little information, and the open loop is
    /// 50 cm too short.
    #[test]
    fn links_that_slipped_along_a_corridor_do_not_reject_loops() {
        let (mut corrected, at_s) = straight();
        let before = end_m(&corrected);
        let slipped = |pair: &[f64]| {
            let information = Matrix4::from_diagonal(&Vector4::new(3e5, 1.0, 1e4, 1e4));
            RelativePose { information, ..relative_pose((pair[1], pair[0]), Vector::x() * 4.8) }
        };
        let links: Vec<RelativePose> = at_s.windows(2).map(slipped).collect();
        let drift = Vector::x() * 0.5;
        let loops: Vec<RelativePose> =
            (25..28).map(|k| relative_pose((at_s[k], at_s[k - 20]), Vector::x() * 64.0 + drift)).collect();
        let closed = optimise(&mut corrected, &loops, &links, 0.002).unwrap();
        assert_eq!(closed.len(), 3, "{closed:?}");
        let moved = end_m(&corrected) - before;
        assert!(moved.x > 0.4 && moved.yz().norm() < 0.01, "{moved}");
    }
}
