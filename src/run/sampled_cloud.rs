//! A sample of the cloud of a simulated recording, projected by an estimate and by the truth.

use super::cloud::Surroundings;
use super::register::{LidarModel, MAX_POSE_GAP_S, ProjectedBeam};
use super::truth_cursor::TruthCursor;
use super::{ProgressMonitor, RunError};
use zsim_base::geometry::{SmoothCursor, Trajectory, Vector};
use zsim_base::measurement::{Calibration, LidarCorrection, Measurement};
use zsim_base::parallel::Stopped;
use zsim_base::time::Span;
use zsim_evaluation::Thinning;
use zsim_recording::{Reader, Selection};

/// A recording with its estimate.
pub(super) struct EstimatedRecording<'a> {
    pub reader: &'a Reader,
    pub selection: &'a Selection,
    pub calibration: &'a Calibration,
    pub map_from_head: &'a Trajectory,
    /// Estimated correction of the lidar calibration.
    pub lidar: &'a LidarCorrection,
    /// Number of returns in the recording.
    pub returns: usize,
}

/// A beam projected by the estimate, in the map frame, and by the truth, in the world frame.
pub(super) type BeamPair = (ProjectedBeam, ProjectedBeam);

impl EstimatedRecording<'_> {
    /// About `limit` beams, evenly over the recording, of those that end on static surfaces.
    ///
    /// # Errors
    /// If the recording cannot be read, or if the run is stopped.
    pub(super) fn static_beams(
        &self,
        surroundings: Surroundings,
        limit: usize,
        watch: &ProgressMonitor,
    ) -> Result<Vec<BeamPair>, RunError> {
        let calibrated = LidarModel::calibrated(self.calibration);
        let corrected = LidarModel::corrected(self.calibration, self.lidar);
        let mut estimate = SmoothCursor::with_max_gap(self.map_from_head, Span::from_seconds(MAX_POSE_GAP_S));
        let mut truth = TruthCursor::new(self.reader.truth());
        let sampled = Thinning::to_at_most(limit, self.returns);
        let (mut index, mut beams) = (0, Vec::new());
        for measurement in self.reader.measurements(self.selection) {
            let Measurement::Lidar(scan) = measurement? else { continue };
            if watch.is_stopped() {
                return Err(Stopped.into());
            }
            for beam in &scan.returns {
                index += 1;
                if !sampled.keeps(index) {
                    continue;
                }
                let stamp = scan.stamp + beam.offset;
                let (Some(map_from_head), Some(state)) = (estimate.at(stamp), truth.at(stamp)?) else { continue };
                let point_in_laser: Vector = beam.point_in_laser.cast();
                let by_truth = calibrated.beam(&state.world_from_head, &point_in_laser);
                if surroundings.hits_static_surface(&by_truth.point, &state) {
                    beams.push((corrected.beam(&map_from_head, &point_in_laser), by_truth));
                }
            }
        }
        Ok(beams)
    }
}
