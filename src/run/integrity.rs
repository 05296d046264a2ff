//! Integrity of a result: error bounds (`integrity.csv`), window reports (`windows.csv`) and causes of the status.

use super::closed_loop::ClosedLoopRun;
use super::open_loop::OpenLoopRun;
use std::io::{BufWriter, Write};
use std::path::Path;
use zsim_base::files::AtomicFile;
use zsim_base::files::FileError;
use zsim_base::geometry::{Pose, PoseCovariance, Trajectory, Vector};
use zsim_base::time::{Span, Stamp};
use zsim_estimation::{
    ALIGNMENT_S, Event, EventKind, Evidence, Severity, Status, TURN_LEVER_M, WindowReport, bound_factors,
    covariance_blocks, findings, radius_99,
};
use zsim_evaluation::{Errors, Pairs, align_poses};
use zsim_report::{CauseMetrics, IntegrityMetrics};

/// Floor of the position bound, added in quadrature, m.
const MIN_BOUND_M: f64 = 0.001;
/// Ratio of the error after alignment to the error that the covariance predicts, in runs without findings.
///
/// The covariance treats the matches of a surface as independent, with a standard deviation of 10 mm each; the alignment
/// removes their common error. With 0.55, at least 99 % of the poses are within the bound in 26 of 28 runs in seven scenes
/// and motions; with 0.47 in 25, with 0.36 in 17, with 0.7 in all. Runs shorter than 40 s have a shorter alignment, which
/// removes less: the ratio grows with the inverse square root of its duration, up to 1.
const ALIGNED_ERROR_RATIO: f64 = 0.55;

/// The status is degraded if the bound exceeds both limits: in m, and as a fraction of the path length.
const LARGE_BOUND_M: f64 = 0.05;
const LARGE_BOUND_FRACTION: f64 = 0.01;
/// The status is lost if the bound exceeds both limits by this factor: 1 m and 20 % of the path length.
const LOST_FACTOR: f64 = 20.0;

/// Error bound and standard deviations of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoseBound {
    pub stamp: Stamp,
    /// 99 % bound on the position error, m.
    pub bound_m_99: f64,
    /// Standard deviations of the position in the map frame, m, and of roll, pitch and yaw, degrees.
    pub sigmas: [f64; 6],
}

/// Computes the error bound of each pose of `trajectory`, whose `covariances` have the stamps of the open loop's.
///
/// The bound is that of the open loop: the closed loop is closer, but its matches cannot detect an error that they contain.
fn bounds(run: &OpenLoopRun, trajectory: &Trajectory, covariances: &[(Stamp, PoseCovariance)]) -> Vec<PoseBound> {
    let windows = &run.estimate.windows;
    let doubts = bound_factors(windows);
    let aligned_until = aligned_until(trajectory).unwrap_or(run.recorded.0);
    let ratio = aligned_error_ratio(trajectory);
    let dead_reckoned_until = dead_reckoned_until(windows, aligned_until);
    let radii_m = radii(run);
    let ambiguities = ambiguities(run);
    let mut covariances = covariances.iter().zip(&radii_m).peekable();
    let mut current: Option<(&PoseCovariance, f64)> = None;
    let bound = |stamp: Stamp| {
        while let Some(((_, covariance), radius_m)) = covariances.next_if(|((at, _), _)| *at <= stamp) {
            current = Some((covariance, *radius_m));
        }
        let (covariance, radius_m) = current?;
        let (position, attitude) = covariance_blocks(covariance);
        // The poses of the alignment share the largest doubt factor, that at its end.
        let after =
            doubts.partition_point(|(at, _)| *at < stamp.max(aligned_until)).min(doubts.len().saturating_sub(1));
        let factor = doubts.get(after).map_or(1.0, |(_, factor)| *factor);
        let sigma = |k: usize| {
            if k < 3 { position[(k, k)].sqrt() } else { attitude[(k - 3, k - 3)].sqrt().to_degrees() }
        };
        let sigmas = std::array::from_fn(sigma);
        let relocalised = ambiguities.partition_point(|(at, _)| *at <= stamp.max(aligned_until));
        let ambiguity_m = relocalised.checked_sub(1).map_or(0.0, |last| ambiguities[last].1);
        let ratio = if dead_reckoned_until.is_some_and(|until| stamp <= until) { 1.0 } else { ratio };
        let bound_m_99 = MIN_BOUND_M.hypot(ratio * radius_m * factor).hypot(ambiguity_m);
        Some(PoseBound { stamp, bound_m_99, sigmas })
    };
    trajectory.iter().map(|(stamp, _)| stamp).filter_map(bound).collect()
}

/// The distances that similar surfaces leave open after the relocalisations so far, in quadrature, m.
fn ambiguities(run: &OpenLoopRun) -> Vec<(Stamp, f64)> {
    let ambiguity = |warning: &Event| match warning.kind {
        EventKind::Relocalised { ambiguity_m, .. } => Some((warning.from, ambiguity_m)),
        _ => None,
    };
    let sum = |sum_m: &mut f64, (stamp, ambiguity_m): (Stamp, f64)| {
        *sum_m = sum_m.hypot(ambiguity_m);
        Some((stamp, *sum_m))
    };
    run.estimate.warnings.iter().filter_map(ambiguity).scan(0.0, sum).collect()
}

/// Ratio of the error after alignment to the predicted error, for the length of a trajectory.
fn aligned_error_ratio(trajectory: &Trajectory) -> f64 {
    let aligned_s = trajectory.stamps().first().zip(aligned_until(trajectory)).map(|(from, until)| until - *from);
    let shorter = ALIGNMENT_S / aligned_s.map_or(ALIGNMENT_S, Span::seconds).max(0.1);
    (ALIGNED_ERROR_RATIO * shorter.sqrt()).min(1.0)
}

/// Until when, during the alignment, the lidar did not constrain the motion of the head, as at a level start.
///
/// The position is then that of the IMU, whose error has the predicted size.
fn dead_reckoned_until(windows: &[WindowReport], aligned_until: Stamp) -> Option<Stamp> {
    let aligned = windows.iter().take_while(|window| window.stamp <= aligned_until);
    let unconstrained = aligned.filter(|window| window.moving && window.problem.is_some());
    unconstrained.last().map(|window| window.stamp)
}

/// Returns the duration of the alignment that the bounds refer to: 20 s, or half of a run of less than 40 s.
pub(super) fn alignment_s(duration_s: f64) -> f64 {
    ALIGNMENT_S.min(0.5 * duration_s)
}

/// End of the alignment.
fn aligned_until(trajectory: &Trajectory) -> Option<Stamp> {
    let (first, last) = trajectory.span()?;
    Some(first + Span::from_seconds(alignment_s(last.seconds_since(first))))
}

/// Computes the 99 % radii of the position error from the covariances, m.
///
/// The alignment is known only at the end of its interval. Within the interval a radius is therefore the larger one of
/// the marked poses before and after; in a run shorter than 40 s this applies to all poses.
fn radii(run: &OpenLoopRun) -> Vec<f64> {
    let mut radii_m = run.radii_m.clone();
    let Some(((first, _), (last, _))) = run.covariances.first().zip(run.covariances.last()) else { return radii_m };
    let is_short = last.seconds_since(*first) < 2.0 * ALIGNMENT_S;
    let marked = &run.estimate.aligned_covariances;
    let marked_m: Vec<f64> = marked.iter().map(|(_, covariance)| radius_99(&covariance_blocks(covariance).0)).collect();
    let is_aligned = |(stamp, _): &(Stamp, PoseCovariance)| is_short || stamp.seconds_since(*first) < ALIGNMENT_S;
    let aligned = run.covariances.partition_point(is_aligned);
    let end_m = aligned.checked_sub(1).filter(|_| !is_short).map_or(0.0, |last| radii_m[last]);
    let largest_m = radii_m[..aligned].iter().copied().fold(0.0, f64::max);
    for (radius_m, (stamp, _)) in radii_m[..aligned].iter_mut().zip(&run.covariances) {
        let after = marked.partition_point(|(at, _)| at <= stamp);
        let before_m = after.checked_sub(1).map(|before| marked_m[before]);
        let adjacent_m = marked_m.get(after).copied().unwrap_or(end_m).max(before_m.unwrap_or(0.0));
        *radius_m = if marked_m.is_empty() { largest_m } else { adjacent_m };
    }
    radii_m
}

/// Error bounds of a result and the causes of its status.
pub(super) struct Integrity {
    bounds: Vec<PoseBound>,
    causes: Vec<Event>,
    path_length_m: f64,
}

impl Integrity {
    /// Computes the integrity of the result `trajectory`: that of the closed loop if there is one, else of the open loop.
    pub fn of(run: &OpenLoopRun, closed: Option<&ClosedLoopRun>, trajectory: &Trajectory) -> Self {
        let covariances = closed.map_or(&run.covariances, |closed| &closed.estimate.covariances);
        let mut bounds = bounds(run, trajectory, covariances);
        let evidence = Evidence {
            windows: &run.estimate.windows,
            warnings: &run.estimate.warnings,
            samples: run.samples,
            recorded: run.recorded,
            estimated: trajectory.span().unwrap_or(run.recorded),
        };
        let mut causes = findings(&evidence);
        causes.extend(closed.and_then(|closed| moved_by_loop_closure(run, closed, &bounds)));
        let path_length_m = path_length_m(trajectory);
        causes.extend(uncertain(&bounds, path_length_m));
        causes.sort_by_key(|cause| std::cmp::Reverse(cause.severity));
        let lost = causes.iter().filter(|cause| cause.severity == Severity::Lost);
        if let Some(lost_from) = lost.map(|cause| cause.from).min() {
            // The error is unbounded after tracking is lost, and everywhere if this happens during the alignment.
            let is_aligned = aligned_until(trajectory).is_some_and(|until| lost_from >= until);
            let from = if is_aligned { bounds.partition_point(|bound| bound.stamp < lost_from) } else { 0 };
            bounds[from..].iter_mut().for_each(|bound| bound.bound_m_99 = f64::INFINITY);
        }
        Self { bounds, causes, path_length_m }
    }

    /// Returns the status of the result.
    pub fn status(&self) -> Status {
        Status::of(&self.causes)
    }

    /// Returns the causes of the status, most severe first.
    pub fn causes(&self) -> &[Event] {
        &self.causes
    }

    /// Bounds and standard deviations of the poses, in order of time.
    pub fn bounds(&self) -> &[PoseBound] {
        &self.bounds
    }

    /// Computes the true errors after the alignment.
    pub fn aligned_errors(pairs: &Pairs) -> Option<Errors> {
        let aligned = pairs.first_seconds(alignment_s(pairs.duration_s()));
        let world_from_map = align_poses(aligned.truth(), aligned.estimate(), TURN_LEVER_M).ok()?;
        Some(Errors::after(pairs, &world_from_map))
    }

    /// The metrics of the result `trajectory` for `metrics.json`; `pairs` are the estimated and true poses, if the truth is known.
    pub fn metrics(&self, run: &OpenLoopRun, trajectory: &Trajectory, pairs: Option<&Pairs>) -> IntegrityMetrics {
        let causes: Vec<CauseMetrics> =
            self.causes.iter().map(|cause| CauseMetrics::new(cause, run.recorded.0)).collect();
        let finite = |bound: f64| Some(bound).filter(|bound| bound.is_finite());
        let mut all: Vec<f64> = self.bounds.iter().map(|bound| bound.bound_m_99).collect();
        let largest = all.iter().copied().filter(|bound| bound.is_finite()).fold(0.0, f64::max);
        IntegrityMetrics {
            bound_m_99: quantile(&mut all, 0.5).and_then(finite),
            largest_bound_m: Some(largest).filter(|bound| *bound > 0.0),
            since_s: causes.iter().map(|cause| cause.from_s).min_by(f64::total_cmp),
            causes,
            path_length_m: Some(self.path_length_m),
            degraded_fraction: self.degraded_fraction(trajectory),
            ..pairs.and_then(|pairs| self.check_bounds(pairs)).unwrap_or_default()
        }
    }

    /// Computes the fraction of the time of `trajectory` in which a cause degrades it; `None` without two poses.
    fn degraded_fraction(&self, trajectory: &Trajectory) -> Option<f64> {
        let (first, last) = trajectory.span()?;
        let mut intervals: Vec<(Stamp, Stamp)> = self.causes.iter().map(|cause| (cause.from, cause.to)).collect();
        intervals.sort_unstable();
        let (mut until, mut degraded_s) = (first, 0.0);
        for (from, to) in intervals {
            let (from, to) = (from.max(until), to.min(last));
            if to > from {
                degraded_s += to.seconds_since(from);
                until = to;
            }
        }
        Some(degraded_s / last.seconds_since(first)).filter(|fraction| fraction.is_finite())
    }

    /// Compares the bounds with the true errors.
    fn check_bounds(&self, pairs: &Pairs) -> Option<IntegrityMetrics> {
        let errors = Self::aligned_errors(pairs)?;
        let mut bounds = self.bounds.iter();
        let mut current = bounds.next()?;
        let mut ratios = Vec::with_capacity(errors.stamps.len());
        let mut errors_m = Vec::with_capacity(errors.stamps.len());
        let mut within = 0;
        for (stamp, error) in errors.stamps.iter().zip(&errors.position_m) {
            let error_m = error.norm();
            while current.stamp < *stamp {
                let Some(next) = bounds.next() else { break };
                current = next;
            }
            within += usize::from(error_m <= current.bound_m_99);
            errors_m.push(error_m);
            ratios.push(current.bound_m_99 / error_m.max(1e-9));
        }
        Some(IntegrityMetrics {
            within_bound: Some(within as f64 / ratios.len() as f64),
            bound_over_error: Some(quantile(&mut ratios, 0.5)?).filter(|ratio| ratio.is_finite()),
            aligned_rmse_m: Some(errors.position_rmse_m()),
            aligned_p95_m: Some(quantile(&mut errors_m, 0.95)?),
            largest_error_m: Some(*errors_m.last()?),
            ..IntegrityMetrics::default()
        })
    }

    /// Writes `integrity.csv` to `folder`.
    pub fn write(&self, folder: &Path) -> Result<(), FileError> {
        let header = "stamp_s,bound_m_99,sigma_x_m,sigma_y_m,sigma_z_m,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg";
        let rows = self.bounds.iter().map(|PoseBound { stamp, bound_m_99, sigmas }| {
            let [x, y, z, roll, pitch, yaw] = sigmas;
            format!("{},{bound_m_99:.6},{x:.6},{y:.6},{z:.6},{roll:.6},{pitch:.6},{yaw:.6}", seconds(*stamp))
        });
        write(folder, "integrity.csv", header, rows)
    }
}

/// Sorts `values`; returns the first that is above the fraction `at` of them, `None` without values.
fn quantile(values: &mut [f64], at: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get((values.len() as f64 * at) as usize).copied()
}

/// Path length of the head, m, from positions at 1 s intervals, so that the swing on the spring does not count.
fn path_length_m(trajectory: &Trajectory) -> f64 {
    let mut last: Option<(Stamp, Vector)> = None;
    let mut path_m = 0.0;
    for (stamp, pose) in trajectory.iter() {
        let position = pose.translation.vector;
        if last.is_none_or(|(before, _)| stamp.seconds_since(before) >= 1.0) {
            path_m += last.map_or(0.0, |(_, from)| (position - from).norm());
            last = Some((stamp, position));
        }
    }
    path_m
}

/// Maximum bound of a good result over a path of `path_m`, m.
pub fn large_error_m(path_m: f64) -> f64 {
    LARGE_BOUND_M.max(LARGE_BOUND_FRACTION * path_m)
}

/// The interval in which the bound exceeds the limit of a usable result, or else of a good result.
fn uncertain(bounds: &[PoseBound], path_m: f64) -> Option<Event> {
    let lost = above_limit(bounds, LOST_FACTOR * large_error_m(path_m), Severity::Lost);
    lost.or_else(|| above_limit(bounds, large_error_m(path_m), Severity::Degraded))
}

/// The interval from the first to the last pose with a bound above `limit_m`.
fn above_limit(bounds: &[PoseBound], limit_m: f64, severity: Severity) -> Option<Event> {
    let is_large = |bound: &&PoseBound| bound.bound_m_99 > limit_m;
    let from = bounds.iter().find(is_large)?.stamp;
    let to = bounds.iter().rev().find(is_large)?.stamp;
    let bound_m = bounds.iter().map(|bound| bound.bound_m_99).fold(0.0, f64::max);
    Some(Event { from, to, severity, kind: EventKind::Uncertain { bound_m } })
}

/// The interval in which the loop closure moved the trajectory by more than the error bound.
fn moved_by_loop_closure(run: &OpenLoopRun, closed: &ClosedLoopRun, bounds: &[PoseBound]) -> Option<Event> {
    let open = closed.estimate.open_loop_recalibrated.as_ref().unwrap_or(&run.estimate.trajectory);
    let shift = |((stamp, a), (_, b)): ((Stamp, &Pose), (Stamp, &Pose))| {
        (stamp, (a.translation.vector - b.translation.vector).norm())
    };
    let shifts = open.iter().zip(closed.estimate.trajectory.iter()).map(shift).zip(bounds);
    let moved: Vec<(Stamp, f64)> = shifts
        .filter(|((_, moved_m), bound)| *moved_m > LARGE_BOUND_M.max(2.0 * bound.bound_m_99))
        .map(|(shift, _)| shift)
        .collect();
    let (from, to) = (moved.first()?.0, moved.last()?.0);
    let moved_m = moved.iter().map(|(_, moved_m)| *moved_m).fold(0.0, f64::max);
    Some(Event::over(from, to, EventKind::LoopClosure { moved_m }))
}

/// Writes `windows.csv` to `folder`.
pub(super) fn write_windows(folder: &Path, windows: &[WindowReport]) -> Result<(), FileError> {
    let header = "stamp_s,surfels,matches,view_matches,views,residual_rms_m,iterations,last_correction_m,conditioning,imu_contradiction,\
                  clock_offset_s,clock_rate,range_correction_m,imu_matrix,moving,trouble";
    let rows = windows.iter().map(|w| {
        let problem = w.problem.as_ref().map_or("", EventKind::key);
        format!(
            "{},{},{},{},{},{:.6},{},{:.6},{:.3e},{:.4},{:.9},{:.3e},{:.6},{:.3e},{},{problem}",
            seconds(w.stamp),
            w.surfels,
            w.matches,
            w.view_matches,
            w.views,
            w.residual_rms_m,
            w.iterations,
            w.last_correction_m,
            w.conditioning,
            w.imu_contradiction,
            w.clock_offset_s,
            w.clock_rate,
            w.range_correction_m,
            w.imu_matrix.value,
            u8::from(w.moving),
        )
    });
    write(folder, "windows.csv", header, rows)
}

/// Formats a stamp in seconds with nine decimals, as in TUM files.
fn seconds(stamp: Stamp) -> String {
    let nanos = stamp.nanos();
    let sign = if nanos < 0 { "-" } else { "" };
    format!("{sign}{}.{:09}", nanos.unsigned_abs() / 1_000_000_000, nanos.unsigned_abs() % 1_000_000_000)
}

fn write(folder: &Path, name: &str, header: &str, mut rows: impl Iterator<Item = String>) -> Result<(), FileError> {
    let path = folder.join(name);
    let mut file = BufWriter::new(AtomicFile::new(folder, &path)?);
    let written = writeln!(file, "{header}").and_then(|()| rows.try_for_each(|row| writeln!(file, "{row}")));
    written.map_err(FileError::at(&path))?;
    let file = file.into_inner().map_err(|error| FileError::at(&path)(error.into_error()))?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_causes_degrade_a_time_once() {
        let at = |s: f64| Stamp::from_nanos(0) + Span::from_seconds(s);
        let cause = |from: f64, to: f64| Event::over(at(from), at(to), EventKind::UnknownOffset);
        let trajectory = Trajectory::from_poses([0.0, 20.0].map(|s| (at(s), Pose::identity()))).unwrap();
        let degraded = |causes| {
            Integrity { bounds: Vec::new(), causes, path_length_m: 0.0 }.degraded_fraction(&trajectory).unwrap()
        };
        assert_eq!(degraded(Vec::new()), 0.0);
        // 2 to 8 s, and 15 s to the end.
        let causes = vec![cause(15.0, 30.0), cause(4.0, 8.0), cause(2.0, 6.0), cause(5.0, 5.5)];
        assert!((degraded(causes) - 0.55).abs() < 1e-9);
    }
}
