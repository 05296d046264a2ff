//! A sample of the cloud of a simulated recording, projected by an estimate and by the truth.

use super::RunError;
use super::beams::{BeamReader, EstimatedBeams, LidarModel, ProjectedBeam, read_beams};
use super::cloud::Surroundings;
use super::loops::Loops;
use super::run_recording::RunRecording;
use super::truth_cursor::TruthCursor;
use zsim_base::measurement::LidarScan;
use zsim_base::parallel::Stopped;
use zsim_evaluation::Thinning;

/// A beam projected by the estimate, in the map frame, and by the truth, in the world frame.
pub(super) type BeamPair = (ProjectedBeam, ProjectedBeam);

impl RunRecording {
    /// About `limit` beams of the best estimate, evenly over the recording, of those that end on static surfaces.
    ///
    /// # Errors
    /// If the recording cannot be read, or if `check` fails.
    pub(super) fn static_beams(
        &self,
        loops: &Loops,
        surroundings: Surroundings,
        limit: usize,
        check: impl Fn() -> Result<(), Stopped>,
    ) -> Result<Vec<BeamPair>, RunError> {
        let best = loops.best();
        let mut sample = StaticSample {
            estimate: EstimatedBeams::new(best.map_from_head, &self.calibration, best.lidar),
            calibrated: LidarModel::calibrated(&self.calibration),
            surroundings,
            sampled: Thinning::to_at_most(limit, loops.open.returns),
            read: 0,
            beams: Vec::new(),
        };
        read_beams((&self.reader, &self.selection), true, vec![&mut sample], &mut |_| check())?;
        Ok(sample.beams)
    }
}

/// Gathers beams on static surfaces.
struct StaticSample<'a> {
    estimate: EstimatedBeams<'a>,
    calibrated: LidarModel,
    surroundings: Surroundings<'a>,
    sampled: Thinning,
    /// Number of returns that were read.
    read: usize,
    beams: Vec<BeamPair>,
}

impl BeamReader for StaticSample<'_> {
    fn scan(&mut self, scan: &LidarScan, truth: Option<&mut TruthCursor>) -> Result<(), RunError> {
        let Some(truth) = truth else { return Ok(()) };
        for beam in &scan.returns {
            self.read += 1;
            if !self.sampled.keeps(self.read) {
                continue;
            }
            let stamp = scan.stamp + beam.offset;
            let (Some((_, in_map)), Some(state)) = (self.estimate.project(beam, stamp), truth.at(stamp)?) else {
                continue;
            };
            let by_truth = self.calibrated.beam(&state.world_from_head, &beam.point_in_laser.cast());
            if self.surroundings.hits_static_surface(&by_truth.point, &state) {
                self.beams.push((in_map, by_truth));
            }
        }
        Ok(())
    }
}
