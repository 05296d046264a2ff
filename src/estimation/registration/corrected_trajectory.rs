//! The trajectory under correction, and the residuals against the motion that the windows measured without views.
//!
//! ```text
//! e_r = log(C_b C_a^-1)                             relative rotation between two nodes
//! e_t = (t'_b - t'_a) - C (t_b - t_a)               relative translation
//! e_l = (-(C z)_y, (C z)_x)                         roll and pitch, which gravity determined
//! ```
//!
//! `C = R' R^T` is the accumulated correction, by default at the middle of the interval; in `e_l` it includes a previous pose graph
//! optimisation. With the next corrections `dr`, `dt` and `v = C (t_b - t_a)`,
//!
//! ```text
//! de_r = dr_b - dr_a       de_t = dt_b - dt_a + v x (dr_a + dr_b) / 2       de_l = [dr]_(x, y)
//! ```

use super::equations::{Equations, PairTerm, UnaryTerm};
use crate::RegistrationSpec;
use crate::nominal::Correction;
use crate::observed::MotionByViews;
use crate::spline::Basis;
use nalgebra::{Matrix6, Vector6};
use zsim_base::geometry::{Pose, PoseCovariance, Rotation, Trajectory, TrajectoryError, Vector, skew};
use zsim_base::time::{Span, Stamp};

/// Standard deviation of position, m, and heading, rad, of the first pose: it defines the map frame.
const START_SIGMA: (f64, f64) = (1e-4, 1e-5);

/// Least variance of the measured motion along any direction, rad^2 or m^2: positive in spite of rounding.
const MIN_VARIANCE: f64 = 1e-14;

/// A trajectory under iterative correction.
#[derive(Debug, Clone)]
pub(super) struct CorrectedTrajectory {
    spacing_s: f64,
    times_s: Vec<f64>,
    poses: Vec<Pose>,
    nodes: Vec<Node>,
}

/// A time at which the corrected trajectory is compared with the open loop.
#[derive(Debug, Clone)]
struct Node {
    stamp: Stamp,
    basis: Basis,
    /// Position of the measured motion, m.
    measured_position: Vector,
    /// Position at the start of the registration, m.
    first_position: Vector,
    /// Corrected position, m.
    position: Vector,
    /// Rotation of the correction.
    correction: Rotation,
    /// Rotation from the measured motion to the start of the registration.
    from_measured: Rotation,
    /// Rotation of a previous pose graph optimisation.
    previous_correction: Rotation,
    /// Covariance of the measured motion since the previous node: rotation (rad), then translation (m), map axes.
    covariance: Matrix6<f64>,
}

/// A time of the corrected trajectory.
#[derive(Debug, Clone)]
pub(super) struct Epoch {
    pub(super) stamp: Stamp,
    pub(super) basis: Basis,
    /// Corrected position, m.
    pub(super) position: Vector,
}

impl CorrectedTrajectory {
    /// Starts with the trajectory `map_from_head`; `None` if it has fewer than two poses. Its motion is to remain that of
    /// `measured`, which has the same stamps.
    ///
    /// The spacing of the nodes is half the knot spacing.
    pub(super) fn new(
        map_from_head: &Trajectory,
        measured: &Trajectory,
        covariances: &[(Stamp, PoseCovariance)],
        origin: Stamp,
        spec: &RegistrationSpec,
    ) -> Option<Self> {
        let (first, last) = map_from_head.span().filter(|(first, last)| first < last)?;
        let seconds = |stamp: Stamp| stamp.seconds_since(origin);
        let (start_s, end_s) = (seconds(first), seconds(last));
        let intervals = ((end_s - start_s) / (0.5 * spec.knot_spacing_s)).ceil().max(1.0) as usize;
        let step_s = (end_s - start_s) / intervals as f64;
        let (translation_walk, rotation_walk) = random_walk(spec);
        let node = |k: usize| {
            let tau_s = (start_s + step_s * k as f64).min(end_s);
            let stamp = (origin + Span::from_seconds(tau_s)).clamp(first, last);
            let (first, measured) = (map_from_head.at(stamp)?, measured.at(stamp)?);
            let (translation, rotation) =
                drift(covariances, stamp - Span::from_seconds(step_s), stamp, spec.correlation_s);
            let covariance = diagonal((translation_walk * step_s + translation, rotation_walk * step_s + rotation));
            let basis = Basis::at(tau_s, spec.knot_spacing_s);
            let (correction, previous_correction) = (Rotation::identity(), Rotation::identity());
            Some(Node {
                stamp,
                basis,
                measured_position: measured.translation.vector,
                first_position: first.translation.vector,
                position: first.translation.vector,
                correction,
                from_measured: first.rotation * measured.rotation.inverse(),
                previous_correction,
                covariance,
            })
        };
        let nodes = (0..=intervals).map(node).collect::<Option<_>>()?;
        let times_s = map_from_head.stamps().iter().map(|stamp| seconds(*stamp)).collect();
        Some(Self { spacing_s: spec.knot_spacing_s, times_s, poses: map_from_head.poses().to_vec(), nodes })
    }

    /// Takes the weight of the motion from the windows that measured it; at other times the weight remains.
    ///
    /// The covariance is that of a window without views, because views repeat errors: with them, the motion of every lap errs alike.
    /// It is loose where the window's surfaces and the IMU do not hold the motion, as the height on stairs.
    pub(super) fn weighted_by(mut self, motions: &[MotionByViews], origin: Stamp, spec: &RegistrationSpec) -> Self {
        for k in 1..self.nodes.len() {
            let step_s = self.nodes[k].stamp.seconds_since(self.nodes[k - 1].stamp);
            let middle_s = self.nodes[k].stamp.seconds_since(origin) - 0.5 * step_s;
            let next = motions.partition_point(|motion| motion.until_s < middle_s);
            if let Some(motion) = motions.get(next).filter(|motion| motion.from_s <= middle_s) {
                let walk = random_walk(spec);
                self.nodes[k].covariance = (diagonal(walk) + motion.covariance_per_s) * step_s;
            }
        }
        self
    }

    /// At most `count` of the nodes, evenly distributed, with the first and the last one; `count` is at least 2.
    pub(super) fn epochs(&self, count: usize) -> Vec<Epoch> {
        let last = self.nodes.len() - 1;
        let spaces = (count - 1).min(last);
        let epoch = |k: usize| {
            let Node { stamp, basis, position, .. } = &self.nodes[k * last / spaces];
            Epoch { stamp: *stamp, basis: *basis, position: *position }
        };
        (0..=spaces).map(epoch).collect()
    }

    /// First and last time, s.
    pub(super) fn span_s(&self) -> (f64, f64) {
        (self.times_s[0], self.times_s[self.times_s.len() - 1])
    }

    /// Index of the first knot, and number of knots.
    pub(super) fn knots(&self) -> (i64, usize) {
        let (start_s, end_s) = self.span_s();
        let first = Basis::at(start_s, self.spacing_s).first;
        (first, (Basis::at(end_s, self.spacing_s).first + 4 - first) as usize)
    }

    /// Corrected position in the middle of the time that each knot influences, m.
    pub(super) fn knot_positions(&self) -> Vec<Vector> {
        let (first, count) = self.knots();
        let position = |k| self.pose_at((first + k as i64 - 1) as f64 * self.spacing_s).translation.vector;
        (0..count).map(position).collect()
    }

    /// The correction spline's basis at `tau_s`.
    pub(super) fn basis_at(&self, tau_s: f64) -> Basis {
        Basis::at(tau_s, self.spacing_s)
    }

    /// Takes roll and pitch from `open_loop`; the trajectory was created from `optimised`, the pose graph solution.
    pub(super) fn with_gravity_from(mut self, open_loop: &Trajectory, optimised: &Trajectory) -> Self {
        for node in &mut self.nodes {
            if let (Some(before), Some(now)) = (open_loop.at(node.stamp), optimised.at(node.stamp)) {
                node.previous_correction = now.rotation * before.rotation.inverse();
            }
        }
        self
    }

    /// `map_from_head` at `tau_s`, interpolated linearly.
    pub(super) fn pose_at(&self, tau_s: f64) -> Pose {
        let after = self.times_s.partition_point(|t| *t <= tau_s).clamp(1, self.times_s.len() - 1);
        let (t0, t1) = (self.times_s[after - 1], self.times_s[after]);
        let (a, b, x) = (&self.poses[after - 1], &self.poses[after], ((tau_s - t0) / (t1 - t0)).clamp(0.0, 1.0));
        let turn = (a.rotation.inverse() * b.rotation).scaled_axis() * x;
        let position = a.translation.vector.lerp(&b.translation.vector, x);
        Pose::from_parts(position.into(), a.rotation * Rotation::from_scaled_axis(turn))
    }

    /// Adds the residuals against the open loop.
    pub(super) fn add_to(&self, equations: &mut Equations, level_sigma_rad: f64) {
        for pair in self.nodes.windows(2) {
            let pair_term = deviation(&pair[0], &pair[1]).pair_term();
            equations.add_unary(&pair[0].basis, &pair_term.first);
            equations.add_unary(&pair[1].basis, &pair_term.second);
            equations.add_cross(&pair[0].basis, &pair[1].basis, &pair_term.cross);
        }
        for node in &self.nodes {
            let up = node.correction * node.previous_correction * Vector::z();
            let mut unary = UnaryTerm::default();
            for (axis, tilt) in [-up.y, up.x].into_iter().enumerate() {
                unary.add(&unit(axis), tilt, level_sigma_rad.powi(-2));
            }
            equations.add_unary(&node.basis, &unary);
        }
        self.fix_start(equations);
    }

    /// Fixes position and heading of the first pose.
    fn fix_start(&self, equations: &mut Equations) {
        let Some(first) = self.nodes.first() else { return };
        let mut unary = UnaryTerm::default();
        unary.add(&unit(2), first.correction.scaled_axis().z, START_SIGMA.1.powi(-2));
        let moved = first.position - first.first_position;
        for axis in 0..3 {
            unary.add(&unit(3 + axis), moved[axis], START_SIGMA.0.powi(-2));
        }
        equations.add_unary(&first.basis, &unary);
    }

    /// Applies a solution of the equations.
    pub(super) fn correct(&mut self, x: &[f64]) {
        let (first_knot, _) = self.knots();
        for (tau_s, pose) in self.times_s.iter().zip(&mut self.poses) {
            let by = Correction::of_spline(&Basis::at(*tau_s, self.spacing_s), first_knot, x);
            pose.rotation = Rotation::from_scaled_axis(by.rotation) * pose.rotation;
            pose.rotation.renormalize_fast();
            pose.translation.vector += by.translation;
        }
        for node in &mut self.nodes {
            let by = Correction::of_spline(&node.basis, first_knot, x);
            node.correction = Rotation::from_scaled_axis(by.rotation) * node.correction;
            node.position += by.translation;
        }
    }

    /// The corrected trajectory at the stamps of the open loop.
    pub(super) fn into_trajectory(self, stamps: &[Stamp]) -> Result<Trajectory, TrajectoryError> {
        Trajectory::from_poses(stamps.iter().copied().zip(self.poses))
    }
}

/// Residuals `e_r` and `e_t` between two nodes, and derivatives by the next corrections of both.
struct Deviation {
    e: Vector6<f64>,
    by_first: Matrix6<f64>,
    by_second: Matrix6<f64>,
    covariance: Matrix6<f64>,
}

/// Variances per second and axis of the random walk of position and attitude, m^2 and rad^2.
fn random_walk(spec: &RegistrationSpec) -> (f64, f64) {
    (spec.drift_m_per_sqrt_s.powi(2), spec.turn_deg_per_sqrt_s.to_radians().powi(2))
}

fn diagonal((shift, turn): (f64, f64)) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
}

fn deviation(a: &Node, b: &Node) -> Deviation {
    let correction = |node: &Node| node.correction * node.from_measured;
    let rotation_error = (correction(b) * correction(a).inverse()).scaled_axis();
    let middle = Rotation::from_scaled_axis(rotation_error * 0.5) * correction(a);
    let shift = middle * (b.measured_position - a.measured_position);
    let e_t = (b.position - a.position) - shift;
    let mut by_first = -Matrix6::identity();
    let mut by_second = Matrix6::identity();
    let half = skew(&shift) * 0.5;
    by_first.fixed_view_mut::<3, 3>(3, 0).copy_from(&half);
    by_second.fixed_view_mut::<3, 3>(3, 0).copy_from(&half);
    let e = Vector6::new(rotation_error.x, rotation_error.y, rotation_error.z, e_t.x, e_t.y, e_t.z);
    Deviation { e, by_first, by_second, covariance: b.covariance }
}

impl Deviation {
    fn pair_term(&self) -> PairTerm {
        let mut pair_term = PairTerm::default();
        let eigen = self.covariance.symmetric_eigen();
        let (e, by_first, by_second) = (
            eigen.eigenvectors.tr_mul(&self.e),
            eigen.eigenvectors.tr_mul(&self.by_first),
            eigen.eigenvectors.tr_mul(&self.by_second),
        );
        for row in 0..6 {
            let weight = eigen.eigenvalues[row].max(MIN_VARIANCE).recip();
            pair_term.add(&by_first.row(row).transpose(), &by_second.row(row).transpose(), e[row], weight);
        }
        pair_term
    }
}

/// Variances per axis of the open loop's drift of position and attitude between two times, m^2 and rad^2.
///
/// Sum of the growth of the variance, and of the change of a stationary error: a Gauss-Markov process of variance `s^2` and
/// correlation time `tau` changes over `h` with variance `2 s^2 h / tau`. The open loop behaves so when it moves from one
/// fixed view to the next.
fn drift(covariances: &[(Stamp, PoseCovariance)], from: Stamp, to: Stamp, tau_s: f64) -> (f64, f64) {
    let at = |stamp: Stamp| {
        let index = covariances.partition_point(|(s, _)| *s <= stamp).saturating_sub(1);
        let mean = |c: &PoseCovariance, k: usize| (c[(k, k)] + c[(k + 1, k + 1)] + c[(k + 2, k + 2)]) / 3.0;
        covariances.get(index).map_or((0.0, 0.0), |(_, c)| (mean(c, 0), mean(c, 3)))
    };
    let (before, after) = (at(from), at(to));
    let changed_fraction = 2.0 * to.seconds_since(from) / tau_s;
    let drift = |before: f64, after: f64| (after - before).max(0.0) + before.min(after) * changed_fraction;
    (drift(before.0, after.0), drift(before.1, after.1))
}

fn unit(axis: usize) -> Vector6<f64> {
    let mut unit = Vector6::zeros();
    unit[axis] = 1.0;
    unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::from_roll_pitch_yaw;

    fn node(seed: f64) -> Node {
        let wave = |k: f64| (seed * 1.7 + k).sin();
        Node {
            stamp: Stamp::from_nanos(0),
            previous_correction: Rotation::identity(),
            basis: Basis::at(0.3, 1.0),
            measured_position: Vector::new(wave(0.0), wave(1.0), wave(2.0)) * 3.0,
            first_position: Vector::zeros(),
            from_measured: from_roll_pitch_yaw(0.001 * wave(9.0), 0.002, -0.1),
            position: Vector::new(wave(3.0), wave(4.0), wave(5.0)) * 3.0,
            correction: from_roll_pitch_yaw(0.001 * wave(6.0), 0.001 * wave(7.0), 0.2 + 0.001 * wave(8.0)),
            covariance: diagonal((1e-6, 1e-8)),
        }
    }

    fn moved(node: &Node, by: &Vector6<f64>) -> Node {
        let correction = Rotation::from_scaled_axis(Vector::new(by[0], by[1], by[2])) * node.correction;
        Node { correction, position: node.position + Vector::new(by[3], by[4], by[5]), ..node.clone() }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let (a, b) = (node(1.0), node(2.0));
        let at = deviation(&a, &b);
        let step = 1e-6;
        for axis in 0..6 {
            let by = unit(axis) * step;
            let difference = |there: Deviation, back: Deviation| (there.e - back.e) / (2.0 * step);
            let first = difference(deviation(&moved(&a, &by), &b), deviation(&moved(&a, &-by), &b));
            let second = difference(deviation(&a, &moved(&b, &by)), deviation(&a, &moved(&b, &-by)));
            // The derivatives neglect products of the twist (0.002 rad) with a correction, at a lever arm of up to 10 m.
            assert_relative_eq!(first, at.by_first.column(axis).into_owned(), epsilon = 0.02);
            assert_relative_eq!(second, at.by_second.column(axis).into_owned(), epsilon = 0.02);
        }
    }

    #[test]
    fn rigidly_transformed_trajectory_has_no_residual() {
        let correction = from_roll_pitch_yaw(0.1, -0.2, 1.3);
        let rigidly = |node: &Node| Node {
            position: correction * node.measured_position + Vector::x(),
            correction: correction * node.from_measured.inverse(),
            ..node.clone()
        };
        let at = deviation(&rigidly(&node(1.0)), &rigidly(&node(2.0)));
        assert!(at.e.norm() < 1e-12, "{}", at.e);
    }

    #[test]
    fn the_motion_of_a_window_has_its_covariance() {
        let spec = crate::load("default").unwrap().registration;
        let at = |k: i64| Stamp::from_nanos(k * 100_000_000);
        let poses = (0..41).map(|k| (at(k), Pose::translation(0.1 * k as f64, 0.0, 0.0)));
        let trajectory = Trajectory::from_poses(poses).unwrap();
        let covariance_per_s = Matrix6::from_fn(|r, c| if r == c { 1e-5 } else { 2e-6 * (r + c) as f64 / 10.0 });
        let motion = MotionByViews { from_s: 1.0, until_s: 2.5, change: Pose::identity(), covariance_per_s };
        let before = CorrectedTrajectory::new(&trajectory, &trajectory, &[], at(0), &spec).unwrap();
        let after = before.clone().weighted_by(&[motion], at(0), &spec);
        // Nodes every 0.5 s: the intervals that end with the nodes 3 to 5 are within the motion.
        for (k, (before, after)) in before.nodes.iter().zip(&after.nodes).enumerate() {
            let added = if (3..=5).contains(&k) { covariance_per_s * 0.5 } else { Matrix6::zeros() };
            assert_relative_eq!(after.covariance, before.covariance + added, epsilon = 1e-15);
        }
    }

    /// A motion that is certain along one direction has no weight along another.
    #[test]
    fn weights_are_the_inverse_covariance() {
        let mixed = Matrix6::from_fn(|r, c| ((r * 7 + c * 3) as f64).sin());
        let covariance = (mixed * mixed.transpose() + Matrix6::identity()) * 1e-6;
        let (a, b) = (node(1.0), Node { covariance, ..node(2.0) });
        let deviation = deviation(&a, &b);
        let expected = deviation.by_second.transpose() * covariance.try_inverse().unwrap() * deviation.by_second;
        assert_relative_eq!(deviation.pair_term().second.square, expected, max_relative = 1e-9, epsilon = 1e-3);
    }

    #[test]
    fn drift_is_variance_growth_plus_stationary_change() {
        let covariance =
            |k: i64, variance: f64| (Stamp::from_nanos(k * 1_000_000_000), PoseCovariance::identity() * variance);
        let covariances = [covariance(0, 0.0), covariance(1, 2e-6), covariance(2, 1e-6)];
        let at = |k: i64| Stamp::from_nanos(k * 1_000_000_000);
        assert_relative_eq!(drift(&covariances, at(0), at(1), 20.0).0, 2e-6);
        // The variance shrank: only the stationary change remains.
        assert_relative_eq!(drift(&covariances, at(1), at(2), 20.0).0, 1e-7, max_relative = 1e-12);
        assert_eq!(drift(&[], at(0), at(1), 20.0), (0.0, 0.0));
    }
}
