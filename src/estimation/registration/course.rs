//! The trajectory while it is corrected, and what the open loop says against a correction.
//!
//! ```text
//! e_r = log(C_b C_a^-1)                             deviation from the open loop's turn between two instants
//! e_t = (t'_b - t'_a) - C (t_b - t_a)               and from its shift, as its attitude sees it
//! e_l = (-(C z)_y, (C z)_x)                         deviation of roll and pitch, which gravity held
//! ```
//!
//! with `C = R' R^T` the correction so far, in the middle where nothing else is said; in `e_l` that since the open
//! loop, where the course was bent before. With `d` the next corrections and `v = C (t_b - t_a)`,
//!
//! ```text
//! de_r = dr_b - dr_a       de_t = dt_b - dt_a + v x (dr_a + dr_b) / 2       de_l = [dr]_(x, y)
//! ```

use super::RegistrationSpec;
use super::equations::{Equations, Link, Own};
use crate::estimation::nominal::Correction;
use crate::estimation::spline::Basis;
use crate::geometry::{Pose, PoseCovariance, Rotation, Trajectory, Vector, skew};
use crate::time::{Span, Stamp};
use nalgebra::{Matrix6, Vector6};

/// Where the map begins, by definition: a correction is held there to this, m and rad.
const HELD: (f64, f64) = (1e-4, 1e-5);

/// The trajectory as it stands.
#[derive(Debug, Clone)]
pub(super) struct Course {
    spacing_s: f64,
    times_s: Vec<f64>,
    poses: Vec<Pose>,
    posts: Vec<Post>,
}

/// An instant at which the corrected trajectory is compared with the open loop's.
#[derive(Debug, Clone)]
struct Post {
    stamp: Stamp,
    basis: Basis,
    /// Where the open loop is then, m.
    before: Vector,
    /// Where the corrected trajectory is.
    position: Vector,
    /// `C`.
    turn: Rotation,
    /// What `C` was already when the course was new.
    bent: Rotation,
    /// Variances of the open loop's shift and turn since the post before, on an axis, m^2 and rad^2.
    variances: (f64, f64),
}

impl Course {
    /// The open loop's trajectory; `None` of less than two poses. Posts stand every half of the knots' spacing.
    pub(super) fn new(
        map_from_head: &Trajectory,
        covariances: &[(Stamp, PoseCovariance)],
        origin: Stamp,
        spec: &RegistrationSpec,
    ) -> Option<Self> {
        let (first, last) = map_from_head.span().filter(|(first, last)| first < last)?;
        let seconds = |stamp: Stamp| stamp.seconds_since(origin);
        let (start_s, end_s) = (seconds(first), seconds(last));
        let intervals = ((end_s - start_s) / (0.5 * spec.knot_spacing_s)).ceil().max(1.0) as usize;
        let step_s = (end_s - start_s) / intervals as f64;
        let (walk, twists) = (spec.drift_m_per_sqrt_s.powi(2), spec.turn_deg_per_sqrt_s.to_radians().powi(2));
        let post = |k: usize| {
            let tau_s = (start_s + step_s * k as f64).min(end_s);
            let stamp = (origin + Span::from_seconds(tau_s)).clamp(first, last);
            let before = map_from_head.at(stamp)?.translation.vector;
            let (shift, twist) = drift(covariances, stamp - Span::from_seconds(step_s), stamp, spec.correlation_s);
            let variances = (walk * step_s + shift, twists * step_s + twist);
            let basis = Basis::at(tau_s, spec.knot_spacing_s);
            let (turn, bent) = (Rotation::identity(), Rotation::identity());
            Some(Post { stamp, basis, before, position: before, turn, bent, variances })
        };
        let posts = (0..=intervals).map(post).collect::<Option<_>>()?;
        let times_s = map_from_head.stamps().iter().map(|stamp| seconds(*stamp)).collect();
        Some(Self { spacing_s: spec.knot_spacing_s, times_s, poses: map_from_head.poses().to_vec(), posts })
    }

    /// First and last instant, s.
    pub(super) fn span_s(&self) -> (f64, f64) {
        (self.times_s[0], self.times_s[self.times_s.len() - 1])
    }

    /// Index of the first knot, and how many there are.
    pub(super) fn knots(&self) -> (i64, usize) {
        let (start_s, end_s) = self.span_s();
        let first = Basis::at(start_s, self.spacing_s).first;
        (first, (Basis::at(end_s, self.spacing_s).first + 4 - first) as usize)
    }

    /// The correction spline's basis at `tau_s`.
    pub(super) fn basis_at(&self, tau_s: f64) -> Basis {
        Basis::at(tau_s, self.spacing_s)
    }

    /// Keeps the roll and pitch of `open_loop`, from which the course was bent before it was made of `bent`.
    pub(super) fn levelled_as(mut self, open_loop: &Trajectory, bent: &Trajectory) -> Self {
        for post in &mut self.posts {
            if let (Some(before), Some(now)) = (open_loop.at(post.stamp), bent.at(post.stamp)) {
                post.bent = now.rotation * before.rotation.inverse();
            }
        }
        self
    }

    /// `map_from_head` at `tau_s`, on a straight line between poses.
    pub(super) fn pose_at(&self, tau_s: f64) -> Pose {
        let after = self.times_s.partition_point(|t| *t <= tau_s).clamp(1, self.times_s.len() - 1);
        let (t0, t1) = (self.times_s[after - 1], self.times_s[after]);
        let (a, b, x) = (&self.poses[after - 1], &self.poses[after], ((tau_s - t0) / (t1 - t0)).clamp(0.0, 1.0));
        let turn = (a.rotation.inverse() * b.rotation).scaled_axis() * x;
        let position = a.translation.vector.lerp(&b.translation.vector, x);
        Pose::from_parts(position.into(), a.rotation * Rotation::from_scaled_axis(turn))
    }

    /// Adds what the open loop says against a correction.
    pub(super) fn add_to(&self, equations: &mut Equations, level_sigma_rad: f64) {
        for pair in self.posts.windows(2) {
            let link = deviation(&pair[0], &pair[1]).link();
            equations.add_own(&pair[0].basis, &link.first);
            equations.add_own(&pair[1].basis, &link.second);
            equations.add_cross(&pair[0].basis, &pair[1].basis, &link.cross);
        }
        for post in &self.posts {
            let up = post.turn * post.bent * Vector::z();
            let mut own = Own::default();
            for (axis, tilt) in [-up.y, up.x].into_iter().enumerate() {
                own.add(&unit(axis), tilt, level_sigma_rad.powi(-2));
            }
            equations.add_own(&post.basis, &own);
        }
        self.hold_the_beginning(equations);
    }

    /// Position and heading of the first pose are the map's.
    fn hold_the_beginning(&self, equations: &mut Equations) {
        let Some(first) = self.posts.first() else { return };
        let mut own = Own::default();
        own.add(&unit(2), first.turn.scaled_axis().z, HELD.1.powi(-2));
        let moved = first.position - first.before;
        for axis in 0..3 {
            own.add(&unit(3 + axis), moved[axis], HELD.0.powi(-2));
        }
        equations.add_own(&first.basis, &own);
    }

    /// Moves the trajectory by a solution.
    pub(super) fn correct(&mut self, x: &[f64]) {
        let (first_knot, _) = self.knots();
        for (tau_s, pose) in self.times_s.iter().zip(&mut self.poses) {
            let by = Correction::of_spline(&Basis::at(*tau_s, self.spacing_s), first_knot, x);
            pose.rotation = Rotation::from_scaled_axis(by.rotation) * pose.rotation;
            pose.rotation.renormalize_fast();
            pose.translation.vector += by.translation;
        }
        for post in &mut self.posts {
            let by = Correction::of_spline(&post.basis, first_knot, x);
            post.turn = Rotation::from_scaled_axis(by.rotation) * post.turn;
            post.position += by.translation;
        }
    }

    /// The corrected trajectory, at the open loop's stamps.
    pub(super) fn into_trajectory(self, stamps: &[Stamp]) -> Trajectory {
        Trajectory::from_poses(stamps.iter().copied().zip(self.poses)).unwrap_or_default()
    }
}

/// `e_r` and `e_t` between two posts, with their derivatives by the next corrections of both.
struct Deviation {
    e: Vector6<f64>,
    by_first: Matrix6<f64>,
    by_second: Matrix6<f64>,
    variances: (f64, f64),
}

fn deviation(a: &Post, b: &Post) -> Deviation {
    let twist = (b.turn * a.turn.inverse()).scaled_axis();
    let middle = Rotation::from_scaled_axis(twist * 0.5) * a.turn;
    let shift = middle * (b.before - a.before);
    let e_t = (b.position - a.position) - shift;
    let mut by_first = -Matrix6::identity();
    let mut by_second = Matrix6::identity();
    let half = skew(&shift) * 0.5;
    by_first.fixed_view_mut::<3, 3>(3, 0).copy_from(&half);
    by_second.fixed_view_mut::<3, 3>(3, 0).copy_from(&half);
    let e = Vector6::new(twist.x, twist.y, twist.z, e_t.x, e_t.y, e_t.z);
    Deviation { e, by_first, by_second, variances: b.variances }
}

impl Deviation {
    fn link(&self) -> Link {
        let mut link = Link::default();
        let (shift, turn) = self.variances;
        for row in 0..6 {
            let weight = if row < 3 { 1.0 / turn } else { 1.0 / shift };
            let by = (&self.by_first.row(row).transpose(), &self.by_second.row(row).transpose());
            link.add(by, self.e[row], weight);
        }
        link
    }
}

/// Variances of the open loop's drift between two instants, of position and attitude on an axis, m^2 and rad^2: by how
/// much its error grew, and how much of it was exchanged for another. An error that stays of variance `s^2` and is
/// forgotten in `tau` (Gauss-Markov) changes in `h` by `2 s^2 h / tau`, as that of an open loop does which goes from
/// view to view.
fn drift(covariances: &[(Stamp, PoseCovariance)], from: Stamp, to: Stamp, tau_s: f64) -> (f64, f64) {
    let at = |stamp: Stamp| {
        let index = covariances.partition_point(|(s, _)| *s <= stamp).saturating_sub(1);
        let mean = |c: &PoseCovariance, k: usize| (c[(k, k)] + c[(k + 1, k + 1)] + c[(k + 2, k + 2)]) / 3.0;
        covariances.get(index).map_or((0.0, 0.0), |(_, c)| (mean(c, 0), mean(c, 3)))
    };
    let (before, after) = (at(from), at(to));
    let exchanged = 2.0 * to.seconds_since(from) / tau_s;
    let drift = |before: f64, after: f64| (after - before).max(0.0) + before.min(after) * exchanged;
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
    use crate::geometry::from_roll_pitch_yaw;
    use approx::assert_relative_eq;

    fn post(seed: f64) -> Post {
        let wave = |k: f64| (seed * 1.7 + k).sin();
        Post {
            stamp: Stamp::from_nanos(0),
            bent: Rotation::identity(),
            basis: Basis::at(0.3, 1.0),
            before: Vector::new(wave(0.0), wave(1.0), wave(2.0)) * 3.0,
            position: Vector::new(wave(3.0), wave(4.0), wave(5.0)) * 3.0,
            turn: from_roll_pitch_yaw(0.001 * wave(6.0), 0.001 * wave(7.0), 0.2 + 0.001 * wave(8.0)),
            variances: (1e-6, 1e-8),
        }
    }

    fn moved(post: &Post, by: &Vector6<f64>) -> Post {
        let turn = Rotation::from_scaled_axis(Vector::new(by[0], by[1], by[2])) * post.turn;
        Post { turn, position: post.position + Vector::new(by[3], by[4], by[5]), ..post.clone() }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (a, b) = (post(1.0), post(2.0));
        let at = deviation(&a, &b);
        let step = 1e-6;
        for axis in 0..6 {
            let by = unit(axis) * step;
            let difference = |there: Deviation, back: Deviation| (there.e - back.e) / (2.0 * step);
            let first = difference(deviation(&moved(&a, &by), &b), deviation(&moved(&a, &-by), &b));
            let second = difference(deviation(&a, &moved(&b, &by)), deviation(&a, &moved(&b, &-by)));
            // Left out are products of the twist (0.002 rad) with a correction, by a shift of up to 10 m at most.
            assert_relative_eq!(first, at.by_first.column(axis).into_owned(), epsilon = 0.02);
            assert_relative_eq!(second, at.by_second.column(axis).into_owned(), epsilon = 0.02);
        }
    }

    #[test]
    fn a_trajectory_turned_and_shifted_as_a_whole_does_not_deviate() {
        let turn = from_roll_pitch_yaw(0.1, -0.2, 1.3);
        let rigidly = |post: &Post| Post { position: turn * post.before + Vector::x(), turn, ..post.clone() };
        let at = deviation(&rigidly(&post(1.0)), &rigidly(&post(2.0)));
        assert!(at.e.norm() < 1e-12, "{}", at.e);
    }

    #[test]
    fn drift_is_growth_and_what_is_forgotten() {
        let covariance =
            |k: i64, variance: f64| (Stamp::from_nanos(k * 1_000_000_000), PoseCovariance::identity() * variance);
        let covariances = [covariance(0, 0.0), covariance(1, 2e-6), covariance(2, 1e-6)];
        let at = |k: i64| Stamp::from_nanos(k * 1_000_000_000);
        assert_relative_eq!(drift(&covariances, at(0), at(1), 20.0).0, 2e-6);
        // Shrunk: what is left of it is forgotten by 2 h / tau.
        assert_relative_eq!(drift(&covariances, at(1), at(2), 20.0).0, 1e-7, max_relative = 1e-12);
        assert_eq!(drift(&[], at(0), at(1), 20.0), (0.0, 0.0));
    }
}
