//! Progress reports and cancellation of experiments.

use std::sync::atomic::AtomicBool;
use zsim_base::measurement::{Calibration, LidarScan};
use zsim_base::parallel::{Stopped, check};
use zsim_estimation::{EstimatedPose, Evidence};
use zsim_truth::TruthSample;

/// Stage of an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Physics, ray casting and recording.
    Simulating,
    /// Open-loop estimation.
    Estimating,
    /// Global registration with loop closure.
    ClosingLoops,
    /// Comparison with the truth, and writing of the map.
    Evaluating,
    /// Registration of the cloud.
    Registering,
    /// Computation of the information bound.
    Bounding,
    /// Evaluation, plots and report.
    Reporting,
}

/// Progress or note of a running experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunEvent<'a> {
    /// Progress of a stage.
    Progress {
        /// The stage.
        stage: Stage,
        /// Completed fraction, 0 to 1; `None` if the duration of the data is not known.
        fraction: Option<f64>,
        /// Processed data, s.
        done_s: f64,
    },
    /// A message for the user.
    Note(&'a str),
    /// Data of the current stage, for a live view.
    Data(StageData<'a>),
}

/// Data that a stage produces or reads, in the order in which it does so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StageData<'a> {
    /// The stage starts; its scans have this calibration.
    Start {
        /// The stage.
        stage: Stage,
        /// Extrinsics of the sensors.
        calibration: &'a Calibration,
    },
    /// Simulated motion of head and base.
    Truth(&'a TruthSample),
    /// A scan that was simulated, or that the estimator receives next.
    Scan(&'a LidarScan),
    /// Estimated poses that have become final.
    Poses(&'a [EstimatedPose]),
    /// Windows and warnings of the estimator so far, as if the recording ended at the last final pose.
    Evidence(Evidence<'a>),
}

/// Progress callback and stop flag of an experiment.
pub struct ProgressMonitor<'a> {
    /// The caller sets this flag to stop the experiment; open files are completed first.
    pub stop: &'a AtomicBool,
    /// Called with each event.
    pub report: &'a mut dyn FnMut(RunEvent),
}

impl ProgressMonitor<'_> {
    /// Fails if the experiment is to stop.
    ///
    /// # Errors
    /// If the flag is set.
    pub fn check_stop(&self) -> Result<(), Stopped> {
        check(self.stop)
    }

    pub(super) fn progress(&mut self, stage: Stage, done_s: f64, total_s: Option<f64>) {
        let fraction = total_s.filter(|total_s| *total_s > 0.0).map(|total_s| (done_s / total_s).clamp(0.0, 1.0));
        (self.report)(RunEvent::Progress { stage, fraction, done_s });
    }

    pub(super) fn note(&mut self, text: &str) {
        (self.report)(RunEvent::Note(text));
    }

    pub(super) fn data(&mut self, data: StageData) {
        (self.report)(RunEvent::Data(data));
    }
}
