//! A recording of a sweep, read by one thread, and the estimates from it.

use super::tree::Journey;
use crate::calibration::calibration;
use crate::closed_loop::{ClosedLoopRun, run_closed_loop};
use crate::integrity::Integrity;
use crate::open_loop::{OpenLoopOptions, OpenLoopRun, run_open_loop};
use crate::sampled_cloud::EstimatedRecording;
use crate::sampled_truth::SampledTruth;
use crate::sensor_models::RecordedSensors;
use crate::{CalibrationSpec, Manifest, ProgressMonitor, StudyError};
use std::fs::File;
use zsim_base::geometry::Trajectory;
use zsim_base::measurement::Calibration;
use zsim_estimation::Status;
use zsim_evaluation::Pairs;
use zsim_recording::{Reader, Selection, TopicPreference};

/// A recording of a journey, read by one thread.
pub(super) struct RunRecording {
    reader: Reader,
    selection: Selection,
    calibration: Calibration,
}

/// Estimates of both loops, with the truth at their stamps.
pub(super) struct Estimates {
    pub(super) open: OpenLoopRun,
    pub(super) closed: Option<ClosedLoopRun>,
    pub(super) truth: Option<SampledTruth>,
}

impl RunRecording {
    /// Opens a recording; sensors without a calibration are those of its manifest, unless this is to be ignored.
    pub(super) fn open(recording: File, ignore_manifest: bool) -> Result<Self, StudyError> {
        let reader = Reader::new("the recording", recording)?;
        let selection = reader.select(&TopicPreference::default())?;
        let manifest = Manifest::in_recording(&reader)?.filter(|_| !ignore_manifest);
        let recorded = manifest.as_ref().and_then(|manifest| manifest.run.as_ref()).map(RecordedSensors::of);
        let recorded = recorded.unwrap_or_default();
        let (found, _) = calibration(&reader, &selection, &CalibrationSpec::default(), recorded, None)?;
        Ok(Self { reader, selection, calibration: found.calibration })
    }

    /// Estimates from the recording.
    pub(super) fn estimate(
        &self,
        journey: &Journey,
        closes_loops: bool,
        watch: &mut ProgressMonitor,
    ) -> Result<Estimates, StudyError> {
        let (estimator, calibration) = (&journey.estimator.spec, &self.calibration);
        let how = OpenLoopOptions { estimator, calibration, recording_surfels: closes_loops, map: None };
        let open = run_open_loop(&self.reader, &self.selection, how, None, None, watch)?;
        let truth = SampledTruth::read(&self.reader, &open, None)?;
        let closed = closes_loops.then(|| run_closed_loop(&open, calibration, estimator)).transpose()?;
        Ok(Estimates { open, closed, truth })
    }

    /// The recording with the best estimate.
    pub(super) fn with<'a>(&'a self, estimates: &'a Estimates) -> EstimatedRecording<'a> {
        let lidar = estimates.closed.as_ref().map_or(&estimates.open.lidar, |closed| &closed.lidar);
        EstimatedRecording {
            reader: &self.reader,
            selection: &self.selection,
            calibration: &self.calibration,
            map_from_head: estimates.map_from_head(),
            lidar,
            returns: estimates.open.returns,
        }
    }
}

impl Estimates {
    /// The estimate of the closed loop, or of the open loop if the loops were not closed.
    pub(super) fn map_from_head(&self) -> &Trajectory {
        self.closed.as_ref().map_or(&self.open.map_from_head, |closed| &closed.map_from_head)
    }

    /// The verdict on that estimate.
    pub(super) fn status(&self) -> Status {
        Integrity::of(&self.open, self.closed.as_ref(), self.map_from_head()).status()
    }

    /// Pairs of that estimate and the truth.
    pub(super) fn pairs(&self) -> Pairs {
        self.truth.as_ref().map(|truth| Pairs::of(self.map_from_head(), &truth.heads)).unwrap_or_default()
    }
}
