//! A recording of a sweep, read by one thread, and the estimates from it.

use super::tree::Journey;
use crate::calibration::calibration;
use crate::loops::{LoopInputs, Loops};
use crate::sampled_cloud::EstimatedRecording;
use crate::sensor_models::RecordedSensors;
use crate::{CalibrationSpec, Manifest, ProgressMonitor, StudyError};
use std::fs::File;
use zsim_base::measurement::Calibration;
use zsim_recording::{Reader, Selection, TopicPreference};

/// A recording of a journey, read by one thread.
pub(super) struct RunRecording {
    reader: Reader,
    selection: Selection,
    calibration: Calibration,
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
    ///
    /// # Errors
    /// When the recording cannot be read, the estimation fails, or the run is stopped.
    pub(super) fn estimate(
        &self,
        journey: &Journey,
        closes_loops: bool,
        watch: &mut ProgressMonitor,
    ) -> Result<Loops, StudyError> {
        let inputs = LoopInputs {
            reader: &self.reader,
            selection: &self.selection,
            calibration: &self.calibration,
            estimator: &journey.estimator.spec,
            map: None,
            closes_loops,
            keeps_surfels: false,
            has_truth: true,
            folder: None,
            expected_s: None,
        };
        inputs.run(None, watch)
    }

    /// The recording with the best estimate.
    pub(super) fn with<'a>(&'a self, loops: &'a Loops) -> EstimatedRecording<'a> {
        let best = loops.best();
        EstimatedRecording {
            reader: &self.reader,
            selection: &self.selection,
            calibration: &self.calibration,
            map_from_head: best.map_from_head,
            lidar: best.lidar,
            returns: loops.open.returns,
        }
    }
}
