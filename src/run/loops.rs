//! The estimates of a recording: open loop, closed loop, and their comparison with the truth.

use super::bound::BoundAccumulator;
use super::closed_loop::{ClosedLoopRun, run_closed_loop};
use super::comparison::{self, Comparison};
use super::integrity::Integrity;
use super::map_options::MapOptions;
use super::open_loop::{OpenLoopOptions, OpenLoopRun, run_open_loop};
use super::sampled_truth::SampledTruth;
use super::{ProgressMonitor, RunError, Stage};
use std::path::Path;
use zsim_base::geometry::{PoseCovariance, Trajectory};
use zsim_base::measurement::{Calibration, LidarCorrection};
use zsim_base::time::Stamp;
use zsim_estimation::EstimatorSpec;
use zsim_evaluation::{Errors, Pairs};
use zsim_recording::{Reader, Selection, write_tum};
use zsim_report::Metrics;

/// What is estimated, and how.
#[derive(Clone, Copy)]
pub(super) struct LoopInputs<'a> {
    pub reader: &'a Reader,
    pub selection: &'a Selection,
    pub calibration: &'a Calibration,
    pub estimator: &'a EstimatorSpec,
    /// The map in which to localise the head; `None` to start a new map.
    pub map: Option<&'a MapOptions>,
    pub closes_loops: bool,
    /// Whether to keep the observed surfaces also without closing loops, for a map.
    pub keeps_surfels: bool,
    /// Whether the true poses in the recording are those of the estimated frame.
    pub has_truth: bool,
    /// Folder for `open_loop.tum` and `closed_loop.tum`; `None` to write no files.
    pub folder: Option<&'a Path>,
    /// Length of the recording, s, if it is known, for the progress.
    pub expected_s: Option<f64>,
}

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
        let Self { reader, selection, calibration, estimator, map, .. } = *self;
        let options =
            OpenLoopOptions { estimator, calibration, recording_surfels: self.closes_loops || self.keeps_surfels, map };
        let tum = self.folder.map(|folder| folder.join("open_loop.tum"));
        let open = run_open_loop(reader, selection, options, tum.as_deref(), self.expected_s, watch)?;
        open.notes.iter().for_each(|note| watch.note(&note.line()));
        let closed = self.closes_loops.then(|| self.close(&open, watch)).transpose()?;
        watch.progress(Stage::Evaluating, 0.0, None);
        let truth = if self.has_truth { SampledTruth::read(reader, &open, bound)? } else { None };
        let mut compare = |map_from_head, covariances: &[_]| {
            truth.as_ref().map(|truth| Comparison::new(map_from_head, covariances, truth, watch))
        };
        let comparison = compare(&open.map_from_head, &open.covariances);
        let closed_comparison = closed.as_ref().and_then(|closed| compare(&closed.map_from_head, &closed.covariances));
        Ok(Loops { open, truth, closed, comparison, closed_comparison })
    }

    /// Runs the closed loop and writes its trajectory.
    fn close(&self, open: &OpenLoopRun, watch: &mut ProgressMonitor) -> Result<ClosedLoopRun, RunError> {
        watch.progress(Stage::ClosingLoops, 0.0, None);
        let closed = run_closed_loop(open, self.calibration, self.estimator)?;
        closed.notes.iter().for_each(|note| watch.note(note));
        if let Some(folder) = self.folder {
            write_tum(&folder.join("closed_loop.tum"), &closed.map_from_head)?;
        }
        watch.check_stop()?;
        Ok(closed)
    }
}

impl Loops {
    /// The estimate of the closed loop, or of the open loop if the loops were not closed.
    pub fn best(&self) -> BestEstimate<'_> {
        let open = &self.open.map_from_head;
        match &self.closed {
            Some(ClosedLoopRun { map_from_head, covariances, lidar, open_loop_recalibrated, .. }) => BestEstimate {
                map_from_head,
                covariances,
                observed_trajectory: open_loop_recalibrated.as_ref().unwrap_or(open),
                lidar,
                comparison: self.closed_comparison.as_ref(),
            },
            None => BestEstimate {
                map_from_head: open,
                covariances: &self.open.covariances,
                observed_trajectory: open,
                lidar: &self.open.lidar,
                comparison: self.comparison.as_ref(),
            },
        }
    }

    /// Errors of the open loop if a closed loop was computed.
    pub fn open_errors(&self) -> Option<&Errors> {
        self.closed.as_ref()?;
        Some(&self.comparison.as_ref()?.errors.as_ref()?.decimated)
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
