//! BeamProjection become a cloud: in files, for viewers, and a sample of it to be judged.

use super::cloud_files::{CloudFiles, CloudOptions};
use super::truth_cursor::{TrueState, TruthCursor};
use super::{Stage, StudyError, Watch};
use crate::estimation::{CloudFilter, Fate, ProjectedReturn, point_sigma_m};
use crate::evaluation::{DeadReckoning, EvaluationError, Rest, Thinning};
use crate::geometry::{Pose, PoseCovariance, SmoothCursor, Trajectory, Vector};
use crate::measurement::{Calibration, LidarCorrection, LidarNoise, LidarReturn, LidarScan, Measurement};
use crate::recording::{CloudPoint, Measurements, Reader, RecordingError, Selection, write_result};
use crate::time::Stamp;
use std::path::Path;

/// Most points that are judged.
const JUDGED: usize = 100_000;
/// Most points for viewers; the cloud's files have them all.
const SHOWN: usize = 1_000_000;

/// A beam of the sample: where it ended and began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProjectedBeam {
    pub point: Vector,
    pub origin: Vector,
}

/// A beam of the sample, to be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SampledBeam {
    /// By the estimate, in the map.
    pub in_map: ProjectedBeam,
    /// By the true pose, in the world, and what else is true at its instant; `None` where there is no truth.
    pub by_truth: Option<(ProjectedBeam, TrueState)>,
    /// What became of it.
    pub fate: Fate,
}

/// How many echoes there were, and what became of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FateCounts {
    pub kept: u64,
    pub mixed: u64,
    pub isolated: u64,
    pub moving: u64,
}

impl FateCounts {
    /// All echoes.
    pub(super) fn all(&self) -> u64 {
        self.kept + self.mixed + self.isolated + self.moving
    }

    fn count(&mut self, fate: Fate) {
        *match fate {
            Fate::Kept => &mut self.kept,
            Fate::Mixed => &mut self.mixed,
            Fate::Isolated => &mut self.isolated,
            Fate::Moving => &mut self.moving,
        } += 1;
    }
}

/// The cloud, and what else a second reading of the recording gave.
pub(super) struct Registered {
    /// What became of the echoes.
    pub fates: FateCounts,
    /// Whether the cloud was filtered.
    pub filtered: bool,
    /// A sample of the beams, whatever became of them.
    pub sample: Vec<SampledBeam>,
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
    /// What is asked of the cloud.
    pub wishes: CloudOptions,
}

impl Registration<'_> {
    /// Projects every beam by the estimate, into the cloud's files and `result.mcap` in `folder`.
    pub(super) fn run(&self, folder: &Path, watch: &mut Watch) -> Result<Registered, StudyError> {
        let noise = self.calibration.lidar;
        let mut beams = BeamProjection {
            measurements: self.reader.measurements(self.selection),
            cursor: SmoothCursor::new(self.map_from_head),
            truth: self.with_truth.then(|| TruthCursor::new(self.reader.truth())),
            calibrated: Lidar { head_from_laser: self.calibration.head_from_laser, range_m: 0.0 },
            corrected: Lidar {
                head_from_laser: self.calibration.head_from_corrected_laser(self.lidar),
                range_m: self.lidar.range_m,
            },
            noise,
            covariances: self.covariances,
            filter: (!self.wishes.keep_outliers).then(|| CloudFilter::new(noise)),
            files: CloudFiles::create(folder, self.wishes.format)?,
            judged: Thinning::to(JUDGED, self.returns),
            shown: Thinning::to(SHOWN, self.returns),
            reckoning: DeadReckoning::new(&self.calibration.head_from_imu, Rest::default()),
            ready: Vec::new().into_iter(),
            span: self.map_from_head.span(),
            echoes: 0,
            fates: FateCounts::default(),
            sample: Vec::new(),
            failure: None,
            watch,
        };
        let (result, poses) = (folder.join("result.mcap"), (self.map_from_head, self.covariances));
        write_result(&result, self.body_frame, poses, beams.by_ref())?;
        if let Some(failure) = beams.failure {
            return Err(failure);
        }
        beams.files.finish()?;
        let filtered = !self.wishes.keep_outliers;
        let dead_reckoning = beams.reckoning.finish();
        Ok(Registered { fates: beams.fates, filtered, sample: beams.sample, dead_reckoning })
    }
}

/// Where a beam begins and ends by the estimate, and by the truth.
type Ends = (ProjectedBeam, Option<(ProjectedBeam, TrueState)>);

/// An echo whose fate is not known yet.
struct Pending {
    point: CloudPoint,
    /// Whether viewers are to see it.
    shown: bool,
    /// Its ends by the estimate and by the truth, where it is of the sample, as one in fifty is.
    judged: Option<Box<Ends>>,
}

/// Reads scan by scan, writes the points that are kept, and gives those for viewers as an iterator.
struct BeamProjection<'a, 'w, 's> {
    measurements: Measurements<'a>,
    cursor: SmoothCursor<'a>,
    truth: Option<TruthCursor<'a>>,
    calibrated: Lidar,
    corrected: Lidar,
    noise: LidarNoise,
    /// Those of the poses from here on.
    covariances: &'a [(Stamp, PoseCovariance)],
    filter: Option<CloudFilter<Pending>>,
    files: CloudFiles,
    judged: Thinning,
    shown: Thinning,
    reckoning: DeadReckoning,
    ready: std::vec::IntoIter<CloudPoint>,
    span: Option<(Stamp, Stamp)>,
    /// Echoes so far.
    echoes: usize,
    fates: FateCounts,
    sample: Vec<SampledBeam>,
    failure: Option<StudyError>,
    watch: &'w mut Watch<'s>,
}

impl Iterator for BeamProjection<'_, '_, '_> {
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

impl BeamProjection<'_, '_, '_> {
    /// The points for viewers of the next scan.
    fn next_scan(&mut self) -> Result<Option<Vec<CloudPoint>>, StudyError> {
        loop {
            match self.measurements.next().transpose()? {
                None => {
                    let Some(filter) = self.filter.take() else { return Ok(None) };
                    return Ok(Some(self.settle(filter.finish())?));
                }
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

    /// Projects a scan; the points for viewers that are known to be kept by now.
    fn register(&mut self, scan: &LidarScan) -> Result<Vec<CloudPoint>, RecordingError> {
        let mut pending = Vec::with_capacity(scan.returns.len());
        for beam in &scan.returns {
            let stamp = scan.stamp + beam.offset;
            // The estimate begins after the recording and ends before it.
            let Some(map_from_head) = self.cursor.at(stamp) else { continue };
            pending.push(self.project(&map_from_head, beam, stamp)?);
        }
        let told = match &mut self.filter {
            Some(filter) => filter.push(pending),
            None => pending.into_iter().map(|(_, pending)| (pending, Fate::Kept)).collect(),
        };
        self.settle(told)
    }

    fn project(
        &mut self,
        map_from_head: &Pose,
        beam: &LidarReturn,
        stamp: Stamp,
    ) -> Result<(ProjectedReturn, Pending), RecordingError> {
        let index = self.echoes;
        self.echoes += 1;
        let point_in_laser: Vector = beam.point_in_laser.cast();
        let in_map = self.corrected.beam(map_from_head, &point_in_laser);
        let arm = in_map.point - map_from_head.translation.vector;
        let range_sigma_m = self.noise.sigma_m(point_in_laser.norm());
        let error_m = self.covariance_at(stamp).map_or(f64::NAN, |c| point_sigma_m(range_sigma_m, c, &arm)) as f32;
        let point = CloudPoint { point_in_map: in_map.point.cast(), intensity: beam.intensity, stamp, error_m };
        let mut judged = None;
        if self.judged.keeps(index) {
            let instant = self.truth.as_mut().map(|truth| truth.at(stamp)).transpose()?.flatten();
            let by_truth =
                instant.map(|instant| (self.calibrated.beam(&instant.world_from_head, &point_in_laser), instant));
            judged = Some(Box::new((in_map, by_truth)));
        }
        let hit = ProjectedReturn { stamp, point_in_map: in_map.point, origin_in_map: in_map.origin };
        Ok((hit, Pending { point, shown: self.shown.keeps(index), judged }))
    }

    /// The covariance of the last pose before `stamp` that has one; of the first, where there is none before.
    fn covariance_at(&mut self, stamp: Stamp) -> Option<&'_ PoseCovariance> {
        while let [_, (next, _), ..] = self.covariances
            && *next <= stamp
        {
            self.covariances = &self.covariances[1..];
        }
        self.covariances.first().map(|(_, covariance)| covariance)
    }

    /// Writes the points that are kept, and counts the others; those for viewers.
    fn settle(&mut self, told: Vec<(Pending, Fate)>) -> Result<Vec<CloudPoint>, RecordingError> {
        let mut shown = Vec::new();
        for (pending, fate) in told {
            self.fates.count(fate);
            self.sample.extend(pending.judged.map(|ends| SampledBeam { in_map: ends.0, by_truth: ends.1, fate }));
            if fate == Fate::Kept {
                self.files.point(&pending.point)?;
                shown.extend(pending.shown.then_some(pending.point));
            }
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
    fn beam(&self, frame_from_head: &Pose, point_in_laser: &Vector) -> ProjectedBeam {
        let frame_from_laser = frame_from_head * self.head_from_laser;
        let origin = frame_from_laser.translation.vector;
        let longer = 1.0 + self.range_m / point_in_laser.norm();
        ProjectedBeam { point: frame_from_laser.rotation * point_in_laser * longer + origin, origin }
    }
}
