//! Beams become a cloud: in a file, for viewers, and a sample of it to be judged.

use super::truth_near::{TrueInstant, TruthNear};
use super::{Stage, StudyError, Watch};
use crate::evaluation::{DeadReckoning, EvaluationError, Rest, Thinning};
use crate::geometry::{Pose, PoseCovariance, SmoothCursor, Trajectory, Vector};
use crate::measurement::{Calibration, LidarCorrection, LidarScan, Measurement};
use crate::recording::{CloudPoint, Measurements, PlyWriter, Reader, RecordingError, Selection, write_result};
use crate::time::Stamp;
use std::fs::File;
use std::path::Path;

/// Most points that are judged.
const JUDGED: usize = 100_000;
/// Most points for viewers; `cloud.ply` has them all.
const SHOWN: usize = 1_000_000;

/// A beam of the sample: where it ended and began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beam {
    pub point: Vector,
    pub origin: Vector,
}

/// A beam of the sample, to be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Judged {
    /// By the estimate, in the map.
    pub in_map: Beam,
    /// By the true pose, in the world, and what else is true at its instant; `None` where there is no truth.
    pub by_truth: Option<(Beam, TrueInstant)>,
}

/// The cloud, and what else a second reading of the recording gave.
pub(super) struct Registered {
    /// Points in the cloud.
    pub points: u64,
    /// A sample of the beams.
    pub sample: Vec<Judged>,
    /// What the IMU alone says.
    pub dead_reckoning: Result<Trajectory, EvaluationError>,
}

/// What to register, and by what.
pub(super) struct Registration<'a> {
    pub reader: &'a Reader,
    pub selection: &'a Selection,
    pub calibration: &'a Calibration,
    pub body_frame: &'a str,
    pub map_from_head: &'a Trajectory,
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// What is known of the lidar beyond its calibration.
    pub lidar: &'a LidarCorrection,
    /// Echoes in the recording.
    pub returns: usize,
    /// Whether to project a sample by the truth too.
    pub with_truth: bool,
}

impl Registration<'_> {
    /// Projects every beam by the estimate, into the cloud `ply` and the recording `result`.
    pub(super) fn run(&self, ply: &Path, result: &Path, watch: &mut Watch) -> Result<Registered, StudyError> {
        let mut beams = Beams {
            measurements: self.reader.measurements(self.selection),
            cursor: SmoothCursor::new(self.map_from_head),
            truth: self.with_truth.then(|| TruthNear::new(self.reader.truth())),
            calibrated: Lidar { head_from_laser: self.calibration.head_from_laser, range_m: 0.0 },
            corrected: Lidar {
                head_from_laser: self.calibration.head_from_corrected_laser(self.lidar),
                range_m: self.lidar.range_m,
            },
            ply: PlyWriter::create(ply)?,
            judged: Thinning::to(JUDGED, self.returns),
            shown: Thinning::to(SHOWN, self.returns),
            reckoning: DeadReckoning::new(&self.calibration.head_from_imu, Rest::default()),
            ready: Vec::new().into_iter(),
            span: self.map_from_head.span(),
            points: 0,
            sample: Vec::new(),
            failure: None,
            watch,
        };
        write_result(result, self.body_frame, (self.map_from_head, self.covariances), beams.by_ref())?;
        beams.ply.finish()?;
        if let Some(failure) = beams.failure {
            return Err(failure);
        }
        Ok(Registered { points: beams.points as u64, sample: beams.sample, dead_reckoning: beams.reckoning.finish() })
    }
}

/// Reads scan by scan, writes every point, and gives those for viewers as an iterator.
struct Beams<'a, 'w, 's> {
    measurements: Measurements<'a>,
    cursor: SmoothCursor<'a>,
    truth: Option<TruthNear<'a>>,
    calibrated: Lidar,
    corrected: Lidar,
    ply: PlyWriter<File>,
    judged: Thinning,
    shown: Thinning,
    reckoning: DeadReckoning,
    ready: std::vec::IntoIter<CloudPoint>,
    span: Option<(Stamp, Stamp)>,
    points: usize,
    sample: Vec<Judged>,
    failure: Option<StudyError>,
    watch: &'w mut Watch<'s>,
}

impl Iterator for Beams<'_, '_, '_> {
    type Item = CloudPoint;

    fn next(&mut self) -> Option<CloudPoint> {
        loop {
            if let Some(point) = self.ready.next() {
                return Some(point);
            }
            match self.next_scan() {
                Ok(Some(points)) => self.ready = points.into_iter(),
                Ok(None) => return None,
                Err(failure) => {
                    self.failure = Some(failure);
                    return None;
                }
            }
        }
    }
}

impl Beams<'_, '_, '_> {
    /// The points for viewers of the next scan.
    fn next_scan(&mut self) -> Result<Option<Vec<CloudPoint>>, StudyError> {
        loop {
            match self.measurements.next().transpose()? {
                None => return Ok(None),
                Some(Measurement::Imu(sample)) => self.reckoning.push(&sample),
                Some(Measurement::Lidar(scan)) => {
                    if self.watch.is_stopped() {
                        return Err(StudyError::Stopped);
                    }
                    if let Some((first, last)) = self.span {
                        let (done_s, whole_s) = (scan.stamp.seconds_since(first), last.seconds_since(first));
                        self.watch.progress(Stage::Registering, done_s, Some(whole_s));
                    }
                    return Ok(Some(self.register(&scan)?));
                }
            }
        }
    }

    fn register(&mut self, scan: &LidarScan) -> Result<Vec<CloudPoint>, RecordingError> {
        let mut shown = Vec::new();
        for beam in &scan.returns {
            let stamp = scan.stamp + beam.offset;
            // The estimate begins after the recording and ends before it.
            let Some(map_from_head) = self.cursor.at(stamp) else { continue };
            let index = self.points;
            self.points += 1;
            let point_in_laser: Vector = beam.point_in_laser.cast();
            let in_map = self.corrected.beam(&map_from_head, &point_in_laser);
            let point =
                CloudPoint { point_in_map: in_map.point.cast(), intensity: beam.intensity, stamp, error_m: f32::NAN };
            self.ply.point(&point)?;
            if self.shown.keeps(index) {
                shown.push(point);
            }
            if !self.judged.keeps(index) {
                continue;
            }
            let instant = self.truth.as_mut().map(|truth| truth.at(stamp)).transpose()?.flatten();
            let by_truth =
                instant.map(|instant| (self.calibrated.beam(&instant.world_from_head, &point_in_laser), instant));
            self.sample.push(Judged { in_map, by_truth });
        }
        Ok(shown)
    }
}

/// How the lidar sits in the head, and what its ranges lack.
struct Lidar {
    head_from_laser: Pose,
    range_m: f64,
}

impl Lidar {
    /// A beam that measured `point_in_laser`, where the head is at `frame_from_head`.
    fn beam(&self, frame_from_head: &Pose, point_in_laser: &Vector) -> Beam {
        let frame_from_laser = frame_from_head * self.head_from_laser;
        let origin = frame_from_laser.translation.vector;
        let longer = 1.0 + self.range_m / point_in_laser.norm();
        Beam { point: frame_from_laser.rotation * point_in_laser * longer + origin, origin }
    }
}
