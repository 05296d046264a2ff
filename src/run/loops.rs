//! The estimates of a recording: open loop, closed loop, and their comparison with the truth.

use super::bound::BoundAccumulator;
use super::closed_loop::{ClosedLoopRun, run_closed_loop};
use super::comparison::{self, Comparison};
use super::integrity::Integrity;
use super::open_loop::{LoopInputs, OpenLoopRun, run_open_loop};
use super::sampled_truth::SampledTruth;
use super::{ProgressMonitor, RunError, Stage};
use zsim_base::geometry::{PoseCovariance, Trajectory};
use zsim_base::measurement::LidarCorrection;
use zsim_base::time::Stamp;
use zsim_estimation::OpenLoop;
use zsim_evaluation::{Errors, Pairs};
use zsim_recording::write_tum;
use zsim_report::Metrics;

/// Open loop and closed loop, each with its comparison with the truth.
pub(super) struct Loops {
    pub open: OpenLoopRun,
    pub truth: Option<SampledTruth>,
    pub closed: Option<ClosedLoopRun>,
    comparison: Option<Comparison>,
    closed_comparison: Option<Comparison>,
}

/// The estimate for cloud, result and plots: the closed loop if it was computed, else the open loop.
pub(super) struct BestEstimate<'a> {
    pub map_from_head: &'a Trajectory,
    /// Covariances at some of its stamps.
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// The open-loop trajectory in which the surfels were observed.
    pub observed_trajectory: &'a Trajectory,
    /// Estimated correction of the lidar calibration.
    pub lidar: &'a LidarCorrection,
    /// Comparison with the truth, if it is known.
    pub comparison: Option<&'a Comparison>,
}

impl LoopInputs<'_> {
    /// Runs both loops and writes their trajectories.
    ///
    /// The truth is also added to `bound`.
    ///
    /// # Errors
    /// When the recording cannot be read, the estimation fails, a file cannot be written, or the run is stopped.
    pub fn run(&self, bound: Option<&mut BoundAccumulator>, watch: &mut ProgressMonitor) -> Result<Loops, RunError> {
        let open = run_open_loop(self, watch)?;
        open.notes.iter().for_each(|note| watch.note(&note.line()));
        let closed = self.closes_loops.then(|| self.close(&open, watch)).transpose()?;
        watch.progress(Stage::Evaluating, 0.0, None);
        let truth = if self.has_truth { SampledTruth::read(self.reader, &open, bound)? } else { None };
        let mut compare = |map_from_head, covariances: &[_]| {
            truth.as_ref().map(|truth| Comparison::new(map_from_head, covariances, truth, watch))
        };
        let comparison = compare(&open.estimate.trajectory, &open.covariances);
        let closed_loop = closed.as_ref().map(|closed| &closed.estimate);
        let closed_comparison = closed_loop.and_then(|closed| compare(&closed.trajectory, &closed.covariances));
        Ok(Loops { open, truth, closed, comparison, closed_comparison })
    }

    /// Runs the closed loop and writes its trajectory.
    fn close(&self, open: &OpenLoopRun, watch: &mut ProgressMonitor) -> Result<ClosedLoopRun, RunError> {
        watch.progress(Stage::ClosingLoops, 0.0, None);
        let closed = run_closed_loop(open, self.calibration, self.estimator)?;
        closed.notes.iter().for_each(|note| watch.note(note));
        if let Some(folder) = self.folder {
            write_tum(&folder.join("closed_loop.tum"), &closed.estimate.trajectory)?;
        }
        watch.check_stop()?;
        Ok(closed)
    }
}

impl Loops {
    /// The estimate of the closed loop, or of the open loop if the loops were not closed.
    pub fn best(&self) -> BestEstimate<'_> {
        let OpenLoopRun { estimate: OpenLoop { trajectory: open, lidar, .. }, covariances, .. } = &self.open;
        let (map_from_head, observed_trajectory, comparison) = (open, open, self.comparison.as_ref());
        let of_open_loop = BestEstimate { map_from_head, covariances, observed_trajectory, lidar, comparison };
        self.closed.as_ref().map_or(of_open_loop, |ClosedLoopRun { estimate, .. }| BestEstimate {
            map_from_head: &estimate.trajectory,
            covariances: &estimate.covariances,
            observed_trajectory: estimate.open_loop_recalibrated.as_ref().unwrap_or(open),
            lidar: &estimate.lidar,
            comparison: self.closed_comparison.as_ref(),
        })
    }

    /// Errors of the open loop if a closed loop was computed.
    pub fn open_errors(&self) -> Option<&Errors> {
        self.closed.as_ref()?;
        self.comparison.as_ref()?.errors.as_ref()
    }

    /// Bounds and findings of the best estimate.
    pub fn integrity(&self) -> Integrity {
        Integrity::of(&self.open, self.closed.as_ref(), self.best().map_from_head)
    }

    /// Pairs of the best estimate and the truth, if it is known.
    pub fn pairs(&self) -> Option<Pairs> {
        self.truth.as_ref().map(|truth| Pairs::of(self.best().map_from_head, &truth.heads))
    }

    /// The metrics of both loops, the clock and the integrity.
    pub fn metrics(&self, integrity: &Integrity, pairs: Option<&Pairs>) -> Metrics {
        let closed_loop = self.closed.as_ref().map(|closed| {
            comparison::closed_loop_metrics(closed, self.closed_comparison.as_ref(), self.open.acquisition_s)
        });
        Metrics {
            duration_s: self.open.acquisition_s,
            status: Some(integrity.status().name().to_owned()),
            integrity: integrity.metrics(&self.open, self.best().map_from_head, pairs),
            losses: self.open.losses.clone(),
            notes: self.open.notes.clone(),
            open_loop: comparison::open_loop_metrics(&self.open, self.comparison.as_ref()),
            closed_loop: closed_loop.unwrap_or_default(),
            clock: comparison::clock_metrics(&self.open, self.truth.as_ref()),
            ..Metrics::default()
        }
    }
}
