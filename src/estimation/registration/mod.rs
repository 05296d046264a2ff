//! Global registration: corrects the open-loop trajectory with matches between surfels of any two times.
//!
//! After Bosse, Zlot and Flick (IEEE Transactions on Robotics 28(5), 2012). Their global optimisation minimises match
//! errors, deviations from the open loop's velocities and deviations from gravity; biases and latency come from the open
//! loop. Here the velocities are those that each window measured without its fixed views (`sensed_motion`), with the covariance of
//! that window. The unknowns are a correction of the trajectory, a cubic B-spline with coarse knots as in a window:
//! `R' = exp(dr) R`, `t' = t + dt`; a range bias of the lidar, and one of weak echoes. The lidar extrinsics are those of the open
//! loop, see `lidar_model`. The cost is
//!
//! ```text
//! sum over matches      rho(zeta n^T (mu_i - mu_j))            between any two times, see `matches`
//! + sum over intervals  |e_r / sigma_r|^2 + |e_t / sigma_t|^2  relative motion without views, see `corrected_trajectory`
//! + sum over nodes      |e_l / sigma_l|^2                      open-loop roll and pitch
//! + sum over both |bias / sigma|^2                             prior of the range biases
//! ```
//!
//! 1. The open loop records the *observed surfels*, built from all returns with the final trajectory,
//!    in several resolutions.
//! 2. If the open loop drifted by more than the matching distance, `places` detects loop closures and optimises a pose graph.
//! 3. The surfels are divided into submaps, and pairs of submaps that observe the same cells are selected: `submaps`.
//! 4. Starting with the coarsest resolution: find reciprocal nearest neighbours in six dimensions, match, solve, move
//!    trajectory and surfels; repeat until convergence. Then add the next finer resolution.
//! 5. An implausible or weakly constrained solution is rejected, and the open-loop trajectory is returned.

mod band_cholesky;
mod block_matrix;
mod conjugate_gradients;
mod corrected_trajectory;
mod equations;
mod lidar_model;
mod matches;
mod neighbours;
mod places;
mod reduction;
mod scene;
mod sensed_motion;
mod submaps;
#[cfg(test)]
mod tests;
mod trajectory_difference;
mod uncertainty;

pub use places::LoopReport;

use super::RegistrationSpec;
use super::displacement::Displacement;
use super::gaps::{Gaps, restored};
use super::matching::Matcher;
use super::observed::ObservedSurfels;
use super::{EstimationError, EstimatorSpec};
use corrected_trajectory::CorrectedTrajectory;
use equations::Equations;
use lidar_model::LidarModel;
use matches::{MatchStatistics, Matches};
use neighbours::Neighbours;
use places::PreAligned;
use scene::Scene;
use sensed_motion::{combined_with_open_loop, sensed_motion};
use trajectory_difference::largest_difference;
use zsim_base::geometry::{PoseCovariance, Trajectory, Vector};
use zsim_base::measurement::{Calibration, LidarCorrection};
use zsim_base::time::Stamp;

/// Maximum correction in one solve, m and rad; a larger one is rejected as implausible.
const MAX_CORRECTION: (f64, f64) = (20.0, 1.0);
/// Matches after this number of windows are revisits: the windows of the open loop already use those before.
const REVISIT_WINDOWS: f64 = 2.5;
/// Maximum number of registrations after a loop closure, each with the last result as open loop.
const MAX_ROUNDS: usize = 6;
/// These registrations end when the trajectory moves by less than this, m.
const ROUNDS_CONVERGED_M: f64 = 0.002;

/// Reason of a rejection.
const SINGULAR: &str = "the normal equations are singular";

/// Result of the global registration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClosedLoop {
    /// Loop-closed `map_from_head` at the stamps of the open loop, lidar time.
    pub trajectory: Trajectory,
    /// Covariances of the poses at the stamps of those of the open loop: position, then attitude, relative to the first pose.
    pub covariances: Vec<(Stamp, PoseCovariance)>,
    /// Estimated correction of the lidar calibration.
    pub lidar: LidarCorrection,
    /// The open-loop trajectory, recomputed with the final lidar extrinsics; `None` if these were not estimated.
    pub open_loop_recalibrated: Option<Trajectory>,
    /// Diagnostics.
    pub report: RegistrationReport,
}

/// Diagnostics of a global registration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RegistrationReport {
    /// Number of surfels.
    pub surfels: usize,
    /// Detected loop closures.
    pub loops: LoopReport,
    /// Number of submaps, and of matched pairs of submaps.
    pub submaps: (usize, usize),
    /// Number of knots of the correction.
    pub knots: usize,
    /// Number of matches in the last iteration.
    pub matches: usize,
    /// Weighted root mean square distance of the matches along their normals in the last iteration, m.
    pub residual_rms_m: f64,
    /// Number of iterations of match and solve.
    pub iterations: usize,
    /// Largest translation of the last correction, m.
    pub last_correction_m: f64,
    /// Largest change of a pose by the registration, m and rad.
    pub moved: (f64, f64),
    /// Smallest over largest eigenvalue of the position information of the matches, 0..1.
    pub conditioning: f64,
    /// Fraction of the information along the weakest direction due to revisited surfaces, 0..1.
    pub revisited: f64,
    /// Range correction of an echo of median intensity, proportional to the inverse square of the intensity, m.
    pub weak_range_m: f64,
    /// Reason for returning the open-loop trajectory; `None` if the registration was accepted.
    pub rejected_because: Option<&'static str>,
}

/// Input of the registration: result of the open loop.
#[derive(Debug, Clone, Copy)]
pub struct RegistrationInput<'a> {
    /// Open-loop trajectory, `map_from_head`.
    pub map_from_head: &'a Trajectory,
    /// Pose covariances at some of the stamps.
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// Estimated correction of the lidar calibration.
    pub lidar: &'a LidarCorrection,
    /// Surfels observed along the trajectory.
    pub observed: &'a ObservedSurfels,
}

/// Registers all surfels of an open loop, observed with the sensors of `calibration`.
///
/// The result does not depend on the number of threads. Long gaps in time are shortened first, so that memory grows with the
/// data and not with the time span.
///
/// # Errors
/// When a pose of the open loop is not finite.
pub fn register(
    input: RegistrationInput,
    calibration: &Calibration,
    spec: &EstimatorSpec,
) -> Result<ClosedLoop, EstimationError> {
    // On a thread of the pool, as the open loop.
    rayon::scope(|_| register_on_pool(input, calibration, spec))
}

fn register_on_pool(
    input: RegistrationInput,
    calibration: &Calibration,
    spec: &EstimatorSpec,
) -> Result<ClosedLoop, EstimationError> {
    let stamps = input.map_from_head.stamps();
    let Some(gaps) = Gaps::between(stamps) else { return register_without_gaps(input, calibration, spec) };
    let map_from_head = &gaps.shorten(input.map_from_head)?;
    let covariances = &gaps.shorten_covariances(input.covariances);
    let observed = &gaps.shorten_observed(input.observed);
    let shortened = RegistrationInput { map_from_head, covariances, observed, lidar: input.lidar };
    let closed = register_without_gaps(shortened, calibration, spec)?;
    let trajectory = restored(&closed.trajectory, stamps)?;
    let open_loop_recalibrated =
        closed.open_loop_recalibrated.map(|trajectory| restored(&trajectory, stamps)).transpose()?;
    let covariances = at_stamps_of(input.covariances, closed.covariances.into_iter().map(|(_, covariance)| covariance));
    Ok(ClosedLoop { trajectory, covariances, open_loop_recalibrated, ..closed })
}

/// The covariances `of` at the stamps of `open_loop`.
fn at_stamps_of(
    open_loop: &[(Stamp, PoseCovariance)],
    of: impl IntoIterator<Item = PoseCovariance>,
) -> Vec<(Stamp, PoseCovariance)> {
    open_loop.iter().map(|(stamp, _)| *stamp).zip(of).collect()
}

fn register_without_gaps(
    input: RegistrationInput,
    calibration: &Calibration,
    spec: &EstimatorSpec,
) -> Result<ClosedLoop, EstimationError> {
    let matcher = Matcher::new(&spec.matching, &spec.registration.surfels(&spec.surfels));
    let RegistrationInput { map_from_head, lidar, observed, .. } = input;
    let recalibrate = || lidar_model::recalibrated(map_from_head, observed, calibration, lidar);
    let recalibrated = spec.extrinsics.estimated.then(recalibrate).transpose()?;
    let map_from_head = recalibrated.as_ref().unwrap_or(map_from_head);
    let problem = Problem { input: RegistrationInput { map_from_head, ..input }, spec, matcher: &matcher };
    let closed = match problem.solve(LidarModel::new(calibration, lidar, observed, spec)) {
        Ok((Registered { trajectory, covariances, lidar_model }, report)) => {
            let moved = largest_difference(map_from_head, &trajectory);
            let report = RegistrationReport { moved, weak_range_m: lidar_model.weak_range_m, ..report };
            let covariances = at_stamps_of(input.covariances, covariances);
            ClosedLoop {
                trajectory,
                covariances,
                lidar: lidar_model.lidar,
                open_loop_recalibrated: recalibrated,
                report,
            }
        }
        Err(rejection) => {
            let report = RegistrationReport { rejected_because: Some(rejection.1), ..rejection.0 };
            let (trajectory, covariances) = (input.map_from_head.clone(), input.covariances.to_vec());
            ClosedLoop { trajectory, covariances, lidar: *lidar, report, ..ClosedLoop::default() }
        }
    };
    Ok(closed)
}

/// A result with diagnostics, or the diagnostics and the reason of rejection.
type RegistrationResult<T> = Result<(T, RegistrationReport), Box<(RegistrationReport, &'static str)>>;

/// The registration problem: open loop and settings.
#[derive(Clone, Copy)]
struct Problem<'a> {
    input: RegistrationInput<'a>,
    spec: &'a EstimatorSpec,
    matcher: &'a Matcher,
}

/// The registered trajectory and lidar model.
struct Registered {
    trajectory: Trajectory,
    /// At the stamps of the open loop's.
    covariances: Vec<PoseCovariance>,
    lidar_model: LidarModel,
}

impl Problem<'_> {
    /// Closes loops if necessary, then registers the trajectory and the lidar.
    fn solve(&self, lidar_model: LidarModel) -> RegistrationResult<Registered> {
        let empty = RegistrationReport::default();
        let RegistrationInput { map_from_head, covariances, observed, .. } = self.input;
        let by_views =
            combined_with_open_loop(&observed.by_views, map_from_head, observed.origin, &self.spec.registration);
        let sensed = sensed_motion(map_from_head, &by_views, observed.origin)
            .map_err(|_| Box::new((empty, "the motion is not finite")))?;
        let corrected =
            CorrectedTrajectory::new(map_from_head, &sensed, covariances, observed.origin, &self.spec.registration);
        let corrected = corrected.ok_or_else(|| Box::new((empty, "no trajectory")))?;
        let corrected = corrected.weighted_by(&by_views, observed.origin, &self.spec.registration);
        let (loops, pre_aligned) = places::close_loops(map_from_head, observed, &corrected, self.matcher, self.spec);
        let report = RegistrationReport { loops, ..empty };
        if let Some(pre_aligned) = pre_aligned {
            return self.register_pre_aligned(pre_aligned, lidar_model, report);
        }
        let (Solution { corrected, lidar_model, equations }, report) =
            Registration::run(self, corrected, lidar_model, observed, report)?;
        let RegistrationSpec { weak_conditioning, min_seen_again, .. } = self.spec.registration;
        if report.conditioning < weak_conditioning && report.revisited < min_seen_again {
            return Err(Box::new((report, "too few revisited surfaces constrain the weakest direction")));
        }
        let covariances = self.covariances(&corrected, &equations, report)?;
        let trajectory = trajectory_of(corrected, map_from_head.stamps(), report)?;
        Ok((Registered { trajectory, covariances, lidar_model }, report))
    }

    /// The covariances of the corrected poses at the stamps of the open loop's; those of the open loop if few surfaces were
    /// revisited. The equations count the errors of successive motions as independent, which along a corridor they are not.
    fn covariances(
        &self,
        corrected: &CorrectedTrajectory,
        equations: &Equations,
        report: RegistrationReport,
    ) -> Result<Vec<PoseCovariance>, Box<(RegistrationReport, &'static str)>> {
        let of_open_loop = self.input.covariances;
        if report.revisited < self.spec.registration.min_seen_again {
            return Ok(of_open_loop.iter().map(|(_, covariance)| *covariance).collect());
        }
        uncertainty::covariances(corrected, equations, of_open_loop).ok_or_else(|| Box::new((report, SINGULAR)))
    }

    /// Registers a trajectory that was pre-aligned to loop closures.
    ///
    /// The pre-aligned trajectory still contains drift, which each registration treats as open-loop motion and only partly
    /// corrects. It is therefore repeated, with the last result as open loop, until convergence.
    fn register_pre_aligned(
        &self,
        mut pre_aligned: PreAligned,
        mut lidar_model: LidarModel,
        mut report: RegistrationReport,
    ) -> RegistrationResult<Registered> {
        let RegistrationInput { map_from_head, covariances, .. } = self.input;
        let mut round = 0;
        loop {
            round += 1;
            let (start, origin) = (&pre_aligned.trajectory, pre_aligned.observed.origin);
            let corrected = CorrectedTrajectory::new(start, start, covariances, origin, &self.spec.registration);
            let corrected = corrected.ok_or_else(|| Box::new((report, "no trajectory")))?;
            let corrected = corrected.with_gravity_from(map_from_head, &pre_aligned.trajectory);
            let registered = Registration::run(self, corrected, lidar_model, &pre_aligned.observed, report)?;
            let (Solution { corrected, lidar_model: found, equations }, updated_report) = registered;
            (lidar_model, report) = (found, updated_report);
            let next = trajectory_of(corrected.clone(), map_from_head.stamps(), report)?;
            let (shift_m, _) = largest_difference(&pre_aligned.trajectory, &next);
            if shift_m < ROUNDS_CONVERGED_M || round == MAX_ROUNDS {
                let covariances = self.covariances(&corrected, &equations, report)?;
                return Ok((Registered { trajectory: next, covariances, lidar_model }, report));
            }
            let observed = pre_aligned.observed.along(&pre_aligned.trajectory, &next);
            pre_aligned = PreAligned { trajectory: next, observed };
        }
    }
}

/// The trajectory of `corrected`, or the rejection of the registration if a pose is not finite.
fn trajectory_of(
    corrected: CorrectedTrajectory,
    stamps: &[Stamp],
    report: RegistrationReport,
) -> Result<Trajectory, Box<(RegistrationReport, &'static str)>> {
    corrected.into_trajectory(stamps).map_err(|_| Box::new((report, "the registered poses are not finite")))
}

/// The solution of a registration, with the equations of the last iteration.
struct Solution {
    corrected: CorrectedTrajectory,
    lidar_model: LidarModel,
    equations: Equations,
}

/// State of the iterations.
struct Registration<'a> {
    spec: &'a EstimatorSpec,
    matcher: &'a Matcher,
    corrected: CorrectedTrajectory,
    lidar_model: LidarModel,
    scene: Scene,
    /// Direction in the map with the least position information in the last iteration.
    weakest: Vector,
    report: RegistrationReport,
}

impl<'a> Registration<'a> {
    /// Registers the surfels `observed` along `corrected` by the lidar of `lidar_model`; returns the corrected two.
    fn run(
        problem: &Problem<'a>,
        corrected: CorrectedTrajectory,
        lidar_model: LidarModel,
        observed: &ObservedSurfels,
        report: RegistrationReport,
    ) -> RegistrationResult<Solution> {
        let (spec, matcher) = (problem.spec, problem.matcher);
        let scene = Scene::new(observed, &corrected, &lidar_model, &spec.registration);
        let mut registration = Self { spec, matcher, corrected, lidar_model, scene, weakest: Vector::z(), report };
        match registration.refine() {
            Ok(equations) => {
                let Self { corrected, lidar_model, report, .. } = registration;
                Ok((Solution { corrected, lidar_model, equations }, report))
            }
            Err(why) => Err(Box::new((registration.report, why))),
        }
    }

    /// Iterates from the coarsest resolution to the finest; returns the equations of the last iteration.
    fn refine(&mut self) -> Result<Equations, &'static str> {
        let (first_knot, knots) = self.corrected.knots();
        self.report.surfels = self.scene.patches.len();
        self.report.submaps = (self.scene.submaps.len(), self.scene.pairs.len());
        self.report.knots = knots;
        let max_distance_m = self.scene.max_distance_m();
        let mut neighbours = Neighbours::new(self.matcher.levels);
        let mut equations: Option<Equations> = None;
        for finest in (0..self.matcher.levels).rev() {
            let coarser = f64::from(1_u32 << finest);
            for _ in 0..self.spec.solve.max_iterations {
                let changed = neighbours.update(finest, &self.scene, self.matcher, self.spec.views.neighbours);
                let equations = match &mut equations {
                    Some(same) if !changed => {
                        same.clear();
                        same
                    }
                    other => other.insert(self.empty_equations(&neighbours)),
                };
                let statistics = self.assemble(&neighbours, coarser, equations);
                let (x, step) = equations.solve().ok_or(SINGULAR)?;
                let three = Vector::from_column_slice;
                let knots = x.chunks_exact(6).map(|knot| (three(&knot[..3]), three(&knot[3..])));
                let Displacement { translation_m, rotation_rad } = Displacement::max_of(knots);
                if !(translation_m < MAX_CORRECTION.0 && rotation_rad < MAX_CORRECTION.1) {
                    return Err("the correction is implausibly large");
                }
                self.corrected.correct(&x);
                self.lidar_model.correct(&step);
                self.scene.correct(first_knot, &x, &step);
                let by_lidar_m = step.abs().sum();
                neighbours.add_motion(translation_m + max_distance_m * rotation_rad + by_lidar_m);
                self.report.iterations += 1;
                self.describe(&statistics);
                self.report.last_correction_m = translation_m;
                if translation_m.max(by_lidar_m) < self.spec.solve.settled_m * coarser {
                    break;
                }
            }
        }
        equations.filter(|_| self.report.matches > 0).ok_or("no surface was observed twice")
    }

    fn describe(&mut self, statistics: &MatchStatistics) {
        (self.report.matches, self.report.residual_rms_m) = (statistics.matches, statistics.rms_m());
        let eigen = statistics.information.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        self.report.conditioning = if largest > 0.0 { statistics.weak_information / largest } else { 0.0 };
        self.report.revisited = if statistics.weak_information > 0.0 {
            statistics.revisited_information / statistics.weak_information
        } else {
            0.0
        };
        self.weakest = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    }

    fn empty_equations(&self, neighbours: &Neighbours) -> Equations {
        let (first_knot, knots) = self.corrected.knots();
        let pairs = &neighbours.active.pairs;
        let segment = |surfel: u32| self.scene.bin_bases[self.scene.bins[surfel as usize] as usize].first;
        let linked =
            neighbours.active.runs.iter().map(|run| (segment(pairs[run.start].0), segment(pairs[run.start].1)));
        Equations::new(first_knot, knots, linked)
    }

    /// Adds all terms to `equations`; matches with a gate that is `coarser` than that of the finest resolution.
    fn assemble(&self, neighbours: &Neighbours, coarser: f64, equations: &mut Equations) -> MatchStatistics {
        let (scene, matcher, spec) = (&self.scene, self.matcher, &self.spec.registration);
        let gate_m = spec.max_plane_distance_m * coarser;
        let (neighbours, weakest) = (&neighbours.active, self.weakest);
        let revisit_s = REVISIT_WINDOWS * self.spec.window_s;
        let matches = Matches { scene, neighbours, matcher, spec, gate_m, revisit_s, weakest };
        let statistics = matches.add_to(equations);
        self.corrected.add_to(equations, spec.level_sigma_deg.to_radians());
        self.lidar_model.add_to(&mut equations.shared_term);
        // A weak prior of 1 m and 1 rad determines the outermost knots.
        equations.add_diagonal(1.0);
        statistics
    }
}
