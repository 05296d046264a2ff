//! The course bent to loops.
//!
//! With `C` the correction so far at an instant, and `p` where the head then is, a tie says of its two instants `a` and
//! `b`
//!
//! ```text
//! e_r = [log(C_b^T C_a Rz^T)]_z          de_r = [C_b^T (dr_a - dr_b)]_z
//! e_t = C_b^T (p_a - p_b) - shift        de_t = C_b^T (dt_a - dt_b + (p_a - p_b) x dr_b)
//! ```
//!
//! Neighbouring places are tied as firmly as what they saw in common says: the course gives way where that is little.
//! Loops pull gently on it, each by Geman and McClure's weight, whose scale shrinks from step to step (graduated
//! non-convexity: Yang, Antonante, Tzoumas and Carlone, IEEE Robotics and Automation Letters 5(2), 2020); what they
//! cannot move near is false. Then those left pull firmly.

use super::{Alignment, Tie};
use crate::estimation::nominal::Correction;
use crate::estimation::registration::course::Course;
use crate::estimation::registration::equations::{Equations, Link};
use crate::estimation::spline::Basis;
use crate::geometry::{Rotation, Vector, skew};
use nalgebra::{Matrix4, Matrix4x6, Vector4};

/// Scale of a loop's deviation at the first step, m; it halves from step to step.
const FIRST_SCALE_M: f64 = 10.0;
/// Steps with gentle loops, and with firm ones.
const STEPS: (usize, usize) = (8, 4);
/// What a gentle loop may err, m and rad.
const GENTLE: (f64, f64) = (0.5, 0.09);
/// Share of what neighbouring places' matches know of the way between them that is believed: they share their errors.
const LINK_SHARE: f64 = 0.1;
/// A loop that is left farther off in the end is false, m; a turn counts by an arm of so much.
const FALSE_M: f64 = 1.0;
const ARM_M: f64 = 4.0;
/// Loops that stretch any way between neighbouring places by more are false together, m.
const STRAINED_M: f64 = 0.25;
/// What holds a knot where nothing else does, 1/m^2 and 1/rad^2.
const HELD: f64 = 1e-3;

/// Where a place is.
#[derive(Debug, Clone)]
struct Stand {
    basis: Basis,
    position: Vector,
    turn: Rotation,
}

/// A tie between two places that move.
#[derive(Debug, Clone)]
struct Stretched {
    instants_s: (f64, f64),
    late: Stand,
    early: Stand,
    alignment: Alignment,
    information: Matrix4<f64>,
}

/// Bends `course` to `loops`, and back where `links` hold it. The instants of those that it then goes through.
///
/// Nothing, and a course to be thrown away, where they contradict what was seen between, or the equations have no
/// solution.
pub(in crate::estimation::registration) fn bend(
    course: &mut Course,
    (loops, links): (&[Tie], &[Tie]),
    level_sigma_rad: f64,
) -> Option<Vec<(f64, f64)>> {
    let (first_knot, knots) = course.knots();
    let stretched = |tie: &Tie| Stretched::new(tie, course);
    let mut loops: Vec<Stretched> = loops.iter().map(stretched).collect();
    let mut links: Vec<Stretched> = links.iter().map(stretched).collect();
    let mut firmly = false;
    let mut scale_m = FIRST_SCALE_M;
    for step in 0..STEPS.0 + STEPS.1 {
        if step == STEPS.0 {
            loops.retain(|tie| tie.off_m() < FALSE_M);
            firmly = true;
        }
        let linked = links.iter().chain(&loops).map(|tie| (tie.early.basis.first, tie.late.basis.first));
        let mut equations = Equations::new(first_knot, knots, linked);
        course.add_to(&mut equations, level_sigma_rad);
        equations.add_diagonal(HELD);
        links.iter().for_each(|link| link.add_to(&mut equations, &(link.information * LINK_SHARE)));
        for tie in &loops {
            tie.add_to(&mut equations, &if firmly { tie.information } else { tie.gentle(scale_m) });
        }
        let (x, _) = equations.solve()?;
        course.correct(&x);
        links.iter_mut().chain(&mut loops).for_each(|tie| tie.correct(first_knot, &x));
        scale_m = (0.5 * scale_m).max(FALSE_M);
    }
    let is_strained = !loops.is_empty() && links.iter().any(|link| link.off_m() > STRAINED_M);
    (!is_strained).then(|| loops.iter().map(|tie| tie.instants_s).collect())
}

impl Stretched {
    fn new(tie: &Tie, course: &Course) -> Self {
        let stand = |tau_s: f64| {
            let (basis, position) = (course.basis_at(tau_s), course.pose_at(tau_s).translation.vector);
            Stand { basis, position, turn: Rotation::identity() }
        };
        let (late, early) = (stand(tie.instants_s.0), stand(tie.instants_s.1));
        Self { instants_s: tie.instants_s, late, early, alignment: tie.alignment, information: tie.information }
    }

    /// `[e_r, e_t]`.
    fn deviation(&self) -> Vector4<f64> {
        let back = self.early.turn.inverse();
        let expected = Rotation::from_scaled_axis(Vector::z() * self.alignment.yaw);
        let twist = (back * self.late.turn * expected.inverse()).scaled_axis();
        let shift = back * (self.late.position - self.early.position) - self.alignment.shift;
        Vector4::new(twist.z, shift.x, shift.y, shift.z)
    }

    /// How far it is from what it says, m.
    fn off_m(&self) -> f64 {
        let e = self.deviation();
        Vector::new(e[1], e[2], e[3]).norm().hypot(ARM_M * e[0])
    }

    /// The derivatives of the deviation by the corrections `[dr, dt]` of the late place and of the early one.
    fn derivatives(&self) -> (Matrix4x6<f64>, Matrix4x6<f64>) {
        let back = self.early.turn.inverse().to_rotation_matrix().into_inner();
        let mut by_late = Matrix4x6::zeros();
        by_late.fixed_view_mut::<1, 3>(0, 0).copy_from(&back.row(2));
        by_late.fixed_view_mut::<3, 3>(1, 3).copy_from(&back);
        let mut by_early = -by_late;
        let apart = self.late.position - self.early.position;
        by_early.fixed_view_mut::<3, 3>(1, 0).copy_from(&(back * skew(&apart)));
        (by_late, by_early)
    }

    /// What a loop is believed while it may be false.
    fn gentle(&self, scale_m: f64) -> Matrix4<f64> {
        let scale2 = scale_m * scale_m;
        let weight = (scale2 / (scale2 + self.off_m().powi(2))).powi(2);
        let (shift, turn) = (GENTLE.0.powi(-2), GENTLE.1.powi(-2));
        Matrix4::from_diagonal(&Vector4::new(turn, shift, shift, shift)) * weight
    }

    fn add_to(&self, equations: &mut Equations, information: &Matrix4<f64>) {
        let (e, (by_late, by_early)) = (self.deviation(), self.derivatives());
        let mut link = Link::default();
        let eigen = information.symmetric_eigen();
        for (axis, weight) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            let by = (&by_late.tr_mul(&axis), &by_early.tr_mul(&axis));
            link.add(by, axis.dot(&e), weight.max(0.0));
        }
        equations.add_own(&self.late.basis, &link.first);
        equations.add_own(&self.early.basis, &link.second);
        equations.add_cross(&self.late.basis, &self.early.basis, &link.cross);
    }

    fn correct(&mut self, first_knot: i64, x: &[f64]) {
        for stand in [&mut self.late, &mut self.early] {
            let by = Correction::of_spline(&stand.basis, first_knot, x);
            stand.turn = Rotation::from_scaled_axis(by.rotation) * stand.turn;
            stand.position += by.translation;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::load;
    use crate::estimation::registration::places::loose;
    use crate::geometry::{Pose, Trajectory, from_roll_pitch_yaw};
    use crate::time::Stamp;
    use approx::assert_relative_eq;

    #[test]
    fn derivatives_are_those_of_differences() {
        let stand = |seed: f64, yaw: f64| Stand {
            basis: Basis::at(0.3, 1.0),
            position: Vector::new(seed.sin(), (2.0 * seed).cos(), 0.3 * seed) * 4.0,
            turn: from_roll_pitch_yaw(1e-3, -2e-3, yaw),
        };
        let alignment = Alignment { yaw: 0.21, shift: Vector::new(0.4, -1.0, 0.1) };
        let information = Matrix4::identity();
        let tie =
            Stretched { instants_s: (9.0, 1.0), late: stand(1.0, 0.3), early: stand(2.5, 0.1), alignment, information };
        let (by_late, by_early) = tie.derivatives();
        let step = 1e-6;
        for axis in 0..6 {
            let mut x = [0.0; 24];
            (0..4).for_each(|knot| x[6 * knot + axis] = step);
            let back: Vec<f64> = x.iter().map(|value| -value).collect();
            let moved = |late: bool, x: &[f64]| {
                let mut moved = tie.clone();
                moved.correct(0, x);
                let (late, early) =
                    if late { (moved.late, tie.early.clone()) } else { (tie.late.clone(), moved.early) };
                Stretched { late, early, ..tie.clone() }.deviation()
            };
            for (late, by) in [(true, &by_late), (false, &by_early)] {
                let difference = (moved(late, &x) - moved(late, &back)) / (2.0 * step);
                // Left out are products of the twist that is left (0.01 rad) with a correction.
                assert_relative_eq!(difference, by.column(axis).into_owned(), epsilon = 0.02);
            }
        }
    }

    /// A straight walk of two minutes, 0.8 m/s, in thirty places.
    fn straight() -> (Course, Vec<f64>) {
        let stamp = |t_s: f64| Stamp::from_nanos((t_s * 1e9) as i64);
        let pose = |t_s: f64| Pose::from_parts(Vector::new(0.8 * t_s, 0.0, 1.2).into(), Rotation::identity());
        let poses = (0..1201).map(|k| 0.1 * f64::from(k)).map(|t_s| (stamp(t_s), pose(t_s)));
        let trajectory = Trajectory::from_poses(poses).unwrap();
        let loose = loose(&load("default").unwrap().registration);
        let course = Course::new(&trajectory, &[], stamp(0.0), &loose).unwrap();
        (course, (0..30).map(|k| 2.0 + 4.0 * f64::from(k)).collect())
    }

    /// What two places say that see what is `shift` apart, to a centimetre and a tenth of a degree.
    fn tie(instants_s: (f64, f64), shift: Vector) -> Tie {
        let information = Matrix4::from_diagonal(&Vector4::new(3e5, 1e4, 1e4, 1e4));
        Tie { instants_s, alignment: Alignment { yaw: 0.0, shift }, information }
    }

    fn links(at_s: &[f64]) -> Vec<Tie> {
        at_s.windows(2).map(|pair| tie((pair[1], pair[0]), Vector::x() * 3.2)).collect()
    }

    fn end_m(course: &Course) -> Vector {
        course.pose_at(118.0).translation.vector
    }

    /// Storeys that are the same: five places in a row look like those of 24 s before, 3.2 m away and not 19.2 m.
    #[test]
    fn false_loops_that_agree_among_themselves_break_on_what_was_seen_between() {
        let (mut course, at_s) = straight();
        let before = end_m(&course);
        let false_loops: Vec<Tie> =
            (10..15).map(|k| tie((at_s[k], at_s[k - 6]), Vector::new(16.0, 0.0, 0.0))).collect();
        let closed = bend(&mut course, (&false_loops, &links(&at_s)), 0.002).unwrap();
        assert!(closed.is_empty(), "{closed:?}");
        assert!((end_m(&course) - before).norm() < 0.05, "{}", end_m(&course));
    }

    /// Between two places nothing was seen in common, and the open loop lost 80 cm there: loops across it are believed,
    /// and one among them that says something else is not.
    #[test]
    fn loops_are_believed_where_nothing_was_seen_between() {
        let (mut course, at_s) = straight();
        let before = end_m(&course);
        let mut held = links(&at_s);
        held.remove(14);
        let lost = Vector::new(0.2, 0.8, 0.0);
        let loops = (20..24).map(|k| tie((at_s[k], at_s[k - 15]), Vector::x() * 48.0 + lost));
        let wrong = tie((at_s[25], at_s[5]), Vector::x() * 64.0 - lost * 4.0);
        let loops: Vec<Tie> = loops.chain([wrong]).collect();
        let closed = bend(&mut course, (&loops, &held), 0.002).unwrap();
        assert_eq!(closed.len(), 4, "{closed:?}");
        assert!((end_m(&course) - before - lost).norm() < 0.1, "{}", end_m(&course) - before);
    }
}
