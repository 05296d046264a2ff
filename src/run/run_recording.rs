//! A recording of a study, read by one thread, and the estimates from it.

use super::calibration::calibration;
use super::loops::Loops;
use super::open_loop::LoopInputs;
use super::{CalibrationSpec, Manifest, ProgressMonitor, RunError};
use std::fs::File;
use zsim_base::measurement::Calibration;
use zsim_estimation::EstimatorSpec;
use zsim_recording::{Reader, Selection, TopicPreference};

/// A recording of a run, read by one thread.
pub(super) struct RunRecording {
    pub reader: Reader,
    pub selection: Selection,
    pub calibration: Calibration,
}

impl RunRecording {
    /// Opens a recording; sensors without a calibration are those of its manifest, unless this is to be ignored.
    pub(super) fn open(recording: File, ignore_manifest: bool) -> Result<Self, RunError> {
        let reader = Reader::new("the recording", recording)?;
        let selection = reader.select(&TopicPreference::default())?;
        let manifest = Manifest::in_recording(&reader)?.filter(|_| !ignore_manifest);
        let recorded = manifest.as_ref().map(Manifest::sensors).unwrap_or_default();
        let (found, _) = calibration(&reader, &selection, &CalibrationSpec::default(), &recorded, None)?;
        Ok(Self { reader, selection, calibration: found.calibration })
    }

    /// Estimates from the recording.
    ///
    /// # Errors
    /// When the recording cannot be read, the estimation fails, or the run is stopped.
    pub(super) fn estimate(
        &self,
        estimator: &EstimatorSpec,
        closes_loops: bool,
        watch: &mut ProgressMonitor,
    ) -> Result<Loops, RunError> {
        let loops = LoopInputs {
            reader: &self.reader,
            selection: &self.selection,
            calibration: &self.calibration,
            estimator,
            map: None,
            closes_loops,
            keeps_surfels: false,
            has_truth: true,
            folder: None,
            expected_s: None,
        };
        loops.run(None, watch)
    }
}
