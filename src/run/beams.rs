//! The beams of a recording: one pass over them, and their projection by an estimate or by the truth.

use super::RunError;
use super::read_ahead::{MeasurementStream, read_ahead};
use super::truth_cursor::TruthCursor;
use zsim_base::geometry::{Pose, SmoothCursor, Trajectory, Vector};
use zsim_base::measurement::{Calibration, ImuSample, LidarCorrection, LidarReturn, LidarScan, Measurement};
use zsim_base::parallel::Stopped;
use zsim_base::time::{Span, Stamp};
use zsim_recording::{Reader, Selection};

/// Returns between poses farther apart than this, s, are not projected: the estimate has a pose every 10 ms, except in gaps.
const MAX_POSE_GAP_S: f64 = 0.1;

/// What reads the measurements of a recording in their order.
pub(super) trait BeamReader {
    /// Reads the next IMU sample.
    fn imu(&mut self, _sample: &ImuSample) {}

    /// Reads the next scan; `truth` is that of the recording, if it is wanted.
    fn scan(&mut self, scan: &LidarScan, truth: Option<&mut TruthCursor>) -> Result<(), RunError>;
}

/// Calls `readers` with all measurements of a recording, and with its truth if `with_truth`, in one pass.
///
/// `on_scan` is called with the stamp of each scan.
///
/// # Errors
/// If the recording cannot be read, or if a reader or `on_scan` fails.
pub(super) fn read_beams(
    (reader, selection): (&Reader, &Selection),
    with_truth: bool,
    readers: &mut [&mut dyn BeamReader],
    on_scan: &mut dyn FnMut(Stamp) -> Result<(), Stopped>,
) -> Result<(), RunError> {
    let pass = |measurements: &mut MeasurementStream| {
        let mut truth = with_truth.then(|| TruthCursor::new(reader.truth()));
        for measurement in measurements {
            match measurement? {
                Measurement::Imu(sample) => readers.iter_mut().for_each(|reader| reader.imu(&sample)),
                Measurement::Lidar(scan) => {
                    on_scan(scan.stamp)?;
                    readers.iter_mut().try_for_each(|reader| reader.scan(&scan, truth.as_mut()))?;
                }
            }
        }
        Ok(())
    };
    read_ahead(reader, selection, pass).0
}

/// A projected beam: origin and end point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProjectedBeam {
    pub point: Vector,
    pub origin: Vector,
}

/// Projects beams by an estimate, in order of time.
pub(super) struct EstimatedBeams<'a> {
    map_from_head: SmoothCursor<'a>,
    lidar: LidarModel,
}

impl<'a> EstimatedBeams<'a> {
    /// Beams by the poses `map_from_head`, with the estimated correction of the lidar.
    pub(super) fn new(map_from_head: &'a Trajectory, calibration: &Calibration, lidar: &LidarCorrection) -> Self {
        let max_gap = Span::from_seconds(MAX_POSE_GAP_S);
        let lidar = LidarModel::corrected(calibration, lidar);
        Self { map_from_head: SmoothCursor::with_max_gap(map_from_head, max_gap), lidar }
    }

    /// The beam in the map; `None` at the start and the end of the recording, and in gaps of the estimate.
    pub(super) fn project(&mut self, beam: &LidarReturn, stamp: Stamp) -> Option<(Pose, ProjectedBeam)> {
        let map_from_head = self.map_from_head.at(stamp)?;
        Some((map_from_head, self.lidar.beam(&map_from_head, &beam.point_in_laser.cast())))
    }
}

/// Extrinsics and range correction of the lidar.
pub(super) struct LidarModel {
    head_from_laser: Pose,
    /// Added to each range, m.
    range_m: f64,
}

impl LidarModel {
    /// The lidar as calibrated, for projection by the truth.
    pub(super) fn calibrated(calibration: &Calibration) -> Self {
        Self { head_from_laser: calibration.head_from_laser, range_m: 0.0 }
    }

    /// The lidar with the estimated correction, for projection by the estimate.
    fn corrected(calibration: &Calibration, lidar: &LidarCorrection) -> Self {
        Self { head_from_laser: calibration.head_from_corrected_laser(lidar), range_m: lidar.range_m }
    }

    /// Projects the beam that measured `point_in_laser` from the head pose `frame_from_head`.
    pub(super) fn beam(&self, frame_from_head: &Pose, point_in_laser: &Vector) -> ProjectedBeam {
        let frame_from_laser = frame_from_head * self.head_from_laser;
        let origin = frame_from_laser.translation.vector;
        let scale = 1.0 + self.range_m / point_in_laser.norm();
        ProjectedBeam { point: frame_from_laser.rotation * point_in_laser * scale + origin, origin }
    }
}
