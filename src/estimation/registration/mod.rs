//! The global registration: behind the open loop, what was seen at one time is laid on what was seen of it at any
//! other.
//!
//! After Bosse, Zlot and Flick (IEEE Transactions on Robotics 28(5), 2012), whose global optimisation minimises match
//! errors, deviations from the open loop's velocities and deviations from gravity, and takes biases and latency from
//! the open loop. Unknown is a correction of the whole trajectory, a cubic B-spline of coarse knots, as in a window:
//! `R' = exp(dr) R`, `t' = t + dt`; and of the lidar an offset of its ranges. How it sits on the IMU is as the open
//! loop has found it, see `lidar`. Minimised is
//!
//! ```text
//! sum over matches      rho(zeta n^T (mu_i - mu_j))           between any two times, see `matches`
//! + sum over intervals  |e_r / sigma_r|^2 + |e_t / sigma_t|^2  against the open loop's relative motion, see `course`
//! + sum over instants   |e_l / sigma_l|^2                      against its roll and pitch
//! + |lidar / sigma|^2                                          against the lidar's calibration
//! ```
//!
//! 1. The open loop's *survey* brings surfels of four resolutions, a passing of the beams each, made of all beams by
//!    the trajectory as it became final.
//! 2. Where the open loop has drifted out of the matches' reach, places are recognised and the trajectory is bent to
//!    the loops found: `places`.
//! 3. Surfels are shelved by chapters, and chapters that saw the same places are compared: `chapters`.
//! 4. From the coarsest resolution on: neighbours in six dimensions, found from both sides; match; solve; move the
//!    trajectory and the surfels; until nothing moves. Then the next finer resolution joins in.
//! 5. A solution that is not believed, or that rests on too little, is dropped, and the open loop stays.

mod blocks;
mod chapters;
mod course;
mod equations;
mod gradients;
mod lidar;
mod matches;
mod neighbours;
mod places;
mod scene;
mod spec;
#[cfg(test)]
mod tests;

pub use places::{LoopReport, PlacesSpec};
pub use spec::RegistrationSpec;

use super::EstimatorSpec;
use super::gaps::{Gaps, restored};
use super::matching::Matcher;
use super::survey::Survey;
use super::window::Displacement;
use crate::geometry::{PoseCovariance, Trajectory, Vector};
use crate::measurement::{Calibration, LidarCorrection};
use crate::time::Stamp;
use course::Course;
use equations::Equations;
use lidar::Mount;
use matches::{Matches, Tally};
use neighbours::Neighbours;
use places::Bent;
use scene::Scene;

/// A correction beyond this (m, rad) in one solve is not believed.
const BELIEVABLE: (f64, f64) = (20.0, 1.0);
/// A course that was bent to loops is registered at most so often, each time as if it were the open loop, until it
/// moves by less, m.
const ROUNDS: usize = 6;
const STAYS_M: f64 = 0.002;

/// The whole, registered.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClosedLoop {
    /// `map_from_head` over lidar time, at the open loop's stamps.
    pub trajectory: Trajectory,
    /// What was learnt of the lidar beyond its calibration.
    pub lidar: LidarCorrection,
    /// The open loop's trajectory as it would have been had it known from the start how the lidar sits on the IMU: what
    /// was seen was seen from there. `None` where the two are the same.
    pub open_loop_told_anew: Option<Trajectory>,
    /// What it rests on.
    pub report: RegistrationReport,
}

/// What a registration rested on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RegistrationReport {
    /// Surfels of the survey.
    pub surfels: usize,
    /// Places recognised.
    pub loops: LoopReport,
    /// Chapters, and pairs of them that were compared.
    pub chapters: (usize, usize),
    /// Knots of the correction.
    pub knots: usize,
    /// Matches of the last iteration.
    pub matches: usize,
    /// Weighted root mean square of the matches' distances along their normals in the last iteration, m.
    pub residual_rms_m: f64,
    /// Iterations of match and solve.
    pub iterations: usize,
    /// Size of the last correction, m.
    pub last_correction_m: f64,
    /// By how much the trajectory moved at most, m and rad.
    pub moved: (f64, f64),
    /// Least over greatest information that the matches hold about the position along any direction, 0..1.
    pub conditioning: f64,
    /// Fraction of what they hold along the weakest one by what was seen again after a while, 0..1.
    pub seen_again: f64,
    /// Why the open loop's trajectory stayed, where it did.
    pub left: Option<&'static str>,
}

/// What an open loop leaves to the registration.
#[derive(Debug, Clone, Copy)]
pub struct Travelled<'a> {
    /// Its trajectory, `map_from_head`.
    pub map_from_head: &'a Trajectory,
    /// Its covariances at some of the poses' stamps.
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// What it learnt of the lidar.
    pub lidar: &'a LidarCorrection,
    /// What it saw.
    pub survey: &'a Survey,
}

/// Registers the whole of what an open loop saw with the sensors of `calibration`.
///
/// The same for any number of threads. Memory follows the data: long gaps in time are shortened first.
pub fn register(travelled: Travelled, calibration: &Calibration, spec: &EstimatorSpec) -> ClosedLoop {
    let stamps = travelled.map_from_head.stamps();
    let Some(gaps) = Gaps::between(stamps) else { return register_without_gaps(travelled, calibration, spec) };
    let map_from_head = &gaps.shorten(travelled.map_from_head);
    let covariances = &gaps.shorten_covariances(travelled.covariances);
    let survey = &gaps.shorten_survey(travelled.survey);
    let shortened = Travelled { map_from_head, covariances, survey, lidar: travelled.lidar };
    let closed = register_without_gaps(shortened, calibration, spec);
    let trajectory = restored(&closed.trajectory, stamps);
    let open_loop_told_anew = closed.open_loop_told_anew.map(|anew| restored(&anew, stamps));
    ClosedLoop { trajectory, open_loop_told_anew, ..closed }
}

fn register_without_gaps(travelled: Travelled, calibration: &Calibration, spec: &EstimatorSpec) -> ClosedLoop {
    let of_all = &spec.registration;
    let matcher = Matcher::new(&of_all.matching(&spec.matching), &of_all.surfels(&spec.surfels));
    let Travelled { map_from_head, lidar, survey, .. } = travelled;
    let told_anew = spec.extrinsics.estimated.then(|| lidar::remounted(map_from_head, survey, (calibration, lidar)));
    let map_from_head = told_anew.as_ref().unwrap_or(map_from_head);
    let open = OpenLoop { travelled: Travelled { map_from_head, ..travelled }, spec: of_all, matcher: &matcher };
    match open.close(Mount::new(calibration, (lidar, survey.ranges_are_held), spec)) {
        Ok((Closed { trajectory, mount }, report)) => {
            let report = RegistrationReport { moved: moved(map_from_head, &trajectory), ..report };
            ClosedLoop { trajectory, lidar: mount.lidar, open_loop_told_anew: told_anew, report }
        }
        Err(left) => {
            let report = RegistrationReport { left: Some(left.1), ..left.0 };
            ClosedLoop { trajectory: travelled.map_from_head.clone(), lidar: *lidar, report, ..ClosedLoop::default() }
        }
    }
}

/// What came of it and what it rests on, or that, and why it is not believed.
type Told<T> = Result<(T, RegistrationReport), Box<(RegistrationReport, &'static str)>>;

/// An open loop to be closed.
#[derive(Clone, Copy)]
struct OpenLoop<'a> {
    travelled: Travelled<'a>,
    spec: &'a RegistrationSpec,
    matcher: &'a Matcher,
}

/// By what what was seen lies on itself.
struct Closed {
    trajectory: Trajectory,
    mount: Mount,
}

impl OpenLoop<'_> {
    /// The trajectory and the lidar by which what was seen lies on itself.
    fn close(&self, mount: Mount) -> Told<Closed> {
        let nothing = RegistrationReport::default();
        let Travelled { map_from_head, covariances, survey, .. } = self.travelled;
        let course = Course::new(map_from_head, covariances, survey.origin, self.spec);
        let course = course.ok_or_else(|| Box::new((nothing, "there is no trajectory")))?;
        let (loops, bent) = places::into_reach((map_from_head, survey), &course, self.matcher, self.spec);
        let report = RegistrationReport { loops, ..nothing };
        if let Some(bent) = bent {
            return self.close_bent(bent, mount, report);
        }
        let ((course, mount), report) = Registration::run(self, (course, mount), survey, report)?;
        if report.conditioning < self.spec.weak_conditioning && report.seen_again < self.spec.min_seen_again {
            return Err(Box::new((report, "too little that tells of a direction was seen again")));
        }
        Ok((Closed { trajectory: course.into_trajectory(map_from_head.stamps()), mount }, report))
    }

    /// The same of a course that was bent to loops. It is registered again and again, each time as if it were the open
    /// loop, until it stays: of the open loop's drift some is left in it, as firmly believed as the open loop.
    fn close_bent(&self, mut bent: Bent, mut mount: Mount, mut report: RegistrationReport) -> Told<Closed> {
        let Travelled { map_from_head, covariances, .. } = self.travelled;
        for _ in 0..ROUNDS {
            let course = Course::new(&bent.trajectory, covariances, bent.survey.origin, self.spec);
            let course = course.ok_or_else(|| Box::new((report, "there is no trajectory")))?;
            let course = course.levelled_as(map_from_head, &bent.trajectory);
            let registered = Registration::run(self, (course, mount), &bent.survey, report)?;
            let ((course, found), told) = registered;
            (mount, report) = (found, told);
            let next = course.into_trajectory(map_from_head.stamps());
            let (shift_m, _) = moved(&bent.trajectory, &next);
            let survey = bent.survey.along(&bent.trajectory, &next);
            bent = Bent { trajectory: next, survey };
            if shift_m < STAYS_M {
                break;
            }
        }
        Ok((Closed { trajectory: bent.trajectory, mount }, report))
    }
}

/// By how much a trajectory moved at most, m and rad.
fn moved(from: &Trajectory, to: &Trajectory) -> (f64, f64) {
    from.poses().iter().zip(to.poses()).fold((0.0, 0.0), |(shift, turn): (f64, f64), (from, to)| {
        let apart = to.translation.vector - from.translation.vector;
        (shift.max(apart.norm()), turn.max(from.rotation.angle_to(&to.rotation)))
    })
}

/// A registration under way.
struct Registration<'a> {
    spec: &'a RegistrationSpec,
    matcher: &'a Matcher,
    course: Course,
    mount: Mount,
    scene: Scene,
    /// The direction in the map of which the matches of the last iteration said least.
    weakest: Vector,
    report: RegistrationReport,
}

impl<'a> Registration<'a> {
    /// Registers `survey`, seen along `course` by the lidar of `mount`: both as they became.
    fn run(
        of: &OpenLoop<'a>,
        (course, mount): (Course, Mount),
        survey: &Survey,
        report: RegistrationReport,
    ) -> Told<(Course, Mount)> {
        let (spec, matcher) = (of.spec, of.matcher);
        let scene = Scene::new(survey, &course, &mount, spec);
        let mut registration = Self { spec, matcher, course, mount, scene, weakest: Vector::z(), report };
        match registration.refine() {
            Ok(()) => Ok(((registration.course, registration.mount), registration.report)),
            Err(why) => Err(Box::new((registration.report, why))),
        }
    }

    /// From coarse to fine.
    fn refine(&mut self) -> Result<(), &'static str> {
        let (first_knot, knots) = self.course.knots();
        self.report.surfels = self.scene.patches.len();
        self.report.chapters = (self.scene.chapters.len(), self.scene.pairs.len());
        self.report.knots = knots;
        let farthest_m = self.scene.farthest_m();
        let mut neighbours = Neighbours::unknown(self.spec.levels);
        let mut equations: Option<Equations> = None;
        for finest in (0..self.spec.levels).rev() {
            let coarser = f64::from(1_u32 << finest);
            for _ in 0..self.spec.max_iterations {
                let changed = neighbours.use_from(finest, &self.scene, self.matcher, self.spec.neighbours);
                let equations = match &mut equations {
                    Some(same) if !changed => {
                        same.clear();
                        same
                    }
                    other => other.insert(self.empty_equations(&neighbours)),
                };
                let tally = self.assemble(&neighbours, self.spec.max_plane_distance_m * coarser, equations);
                let (x, step) = equations.solve().ok_or("its equations are singular")?;
                let three = Vector::from_column_slice;
                let knots = x.chunks_exact(6).map(|knot| (three(&knot[..3]), three(&knot[3..])));
                let Displacement { shift, turn } = Displacement::max_of(knots);
                if !(shift < BELIEVABLE.0 && turn < BELIEVABLE.1) {
                    return Err("its correction is too large");
                }
                self.course.correct(&x);
                self.mount.correct(&step);
                self.scene.correct(first_knot, &x, &step);
                let by_lidar_m = step[0].abs();
                neighbours.moved(shift + farthest_m * turn + by_lidar_m);
                self.report.iterations += 1;
                self.describe(&tally);
                self.report.last_correction_m = shift;
                if shift.max(by_lidar_m) < self.spec.settled_m * coarser {
                    break;
                }
            }
        }
        if self.report.matches == 0 { Err("nothing was seen twice") } else { Ok(()) }
    }

    fn describe(&mut self, tally: &Tally) {
        (self.report.matches, self.report.residual_rms_m) = (tally.matches, tally.rms_m());
        let eigen = tally.information.symmetric_eigen();
        let greatest = eigen.eigenvalues.max();
        self.report.conditioning = if greatest > 0.0 { tally.held / greatest } else { 0.0 };
        self.report.seen_again = if tally.held > 0.0 { tally.held_again / tally.held } else { 0.0 };
        self.weakest = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    }

    fn empty_equations(&self, neighbours: &Neighbours) -> Equations {
        let (first_knot, knots) = self.course.knots();
        let pairs = &neighbours.in_use.pairs;
        let segment = |surfel: u32| self.scene.middles[self.scene.slots[surfel as usize] as usize].first;
        let linked =
            neighbours.in_use.runs.iter().map(|run| (segment(pairs[run.start].0), segment(pairs[run.start].1)));
        Equations::new(first_knot, knots, linked)
    }

    fn assemble(&self, neighbours: &Neighbours, gate_m: f64, equations: &mut Equations) -> Tally {
        let (scene, matcher, spec) = (&self.scene, self.matcher, self.spec);
        let (neighbours, weakest) = (&neighbours.in_use, self.weakest);
        let matches = Matches { scene, neighbours, matcher, spec, gate_m, weakest };
        let tally = matches.add_to(equations);
        self.course.add_to(equations, spec.level_sigma_deg.to_radians());
        self.mount.add_to(&mut equations.beside);
        // A metre and a radian keep the outermost knots where nothing else does.
        equations.add_diagonal(1.0);
        tally
    }
}
