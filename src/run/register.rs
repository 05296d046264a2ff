//! Registration of the beams into a cloud: output files, points for viewers, and what the evaluation needs of them.

use super::cloud_files::{CloudFiles, CloudOptions};
use super::read_ahead::{MeasurementStream, read_ahead};
use super::truth_cursor::{TrueState, TruthCursor};
use super::viewer_files::write_for_result;
use super::{ProgressMonitor, RunError, Stage};
use std::path::Path;
use zsim_base::geometry::{Pose, PoseCovariance, SmoothCursor, Trajectory, Vector};
use zsim_base::measurement::{Calibration, LidarCorrection, LidarNoise, LidarReturn, LidarScan, Measurement};
use zsim_base::parallel::Stopped;
use zsim_base::time::{Span, Stamp};
use zsim_estimation::{CloudFilter, ProjectedReturn, ReturnClass, point_sigma_m};
use zsim_evaluation::Thinning;
use zsim_recording::{CloudPoint, Reader, RecordingError, Selection, write_result};
use zsim_report::page::MAX_PAGE_POINTS;

/// Maximum number of beams in the sample for the evaluation.
const MAX_SAMPLED_BEAMS: usize = 100_000;
/// Maximum number of points for viewers, in `result.mcap`; the cloud files have all points.
const MAX_VIEWER_POINTS: usize = 1_000_000;
/// Returns between poses farther apart than this, s, are not projected: the estimate has a pose every 10 ms, except in gaps.
pub(super) const MAX_POSE_GAP_S: f64 = 0.1;

/// A projected beam: origin and end point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProjectedBeam {
    pub point: Vector,
    pub origin: Vector,
}

/// A beam of the sample for the evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SampledBeam {
    /// Projected by the estimate, in the map frame.
    pub in_map: ProjectedBeam,
    /// Projected by the true pose, in the world frame, with the true state at that time; `None` without truth.
    pub by_truth: Option<(ProjectedBeam, TrueState)>,
    /// Decision of the outlier filter.
    pub class: ReturnClass,
}

/// Number of returns by decision of the outlier filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ClassCounts {
    pub kept: u64,
    pub mixed: u64,
    pub isolated: u64,
    pub moving: u64,
}

impl ClassCounts {
    /// Total number of returns.
    pub(super) fn all(&self) -> u64 {
        self.kept + self.mixed + self.isolated + self.moving
    }

    fn count(&mut self, class: ReturnClass) {
        *match class {
            ReturnClass::Static => &mut self.kept,
            ReturnClass::MixedPixel => &mut self.mixed,
            ReturnClass::Isolated => &mut self.isolated,
            ReturnClass::Dynamic => &mut self.moving,
        } += 1;
    }
}

/// Result of the registration, from a second pass over the recording.
pub(super) struct RegisteredCloud {
    /// Number of returns by decision of the filter.
    pub class_counts: ClassCounts,
    /// Whether the cloud was filtered.
    pub filtered: bool,
    /// A sample of the beams, before filtering.
    pub sample: Vec<SampledBeam>,
    /// Points for the page, after filtering.
    pub page_points: Vec<CloudPoint>,
}

/// Inputs of the registration.
pub(super) struct Registration<'a> {
    pub reader: &'a Reader,
    pub selection: &'a Selection,
    pub calibration: &'a Calibration,
    pub body_frame: &'a str,
    pub map_from_head: &'a Trajectory,
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// Estimated correction of the lidar calibration.
    pub lidar: &'a LidarCorrection,
    /// Number of returns in the recording.
    pub returns: usize,
    /// Whether to project the sample by the true poses as well.
    pub with_truth: bool,
    /// Options of the cloud.
    pub options: CloudOptions,
}

impl Registration<'_> {
    /// Projects all beams by the estimate and writes the cloud files, `result.mcap` and its layout to `folder`.
    pub(super) fn run(&self, folder: &Path, watch: &mut ProgressMonitor) -> Result<RegisteredCloud, RunError> {
        read_ahead(self.reader, self.selection, |measurements| self.project(measurements, folder, watch)).0
    }

    fn project(
        &self,
        measurements: &mut MeasurementStream,
        folder: &Path,
        watch: &mut ProgressMonitor,
    ) -> Result<RegisteredCloud, RunError> {
        let noise = self.calibration.lidar;
        let mut beams = BeamProjection {
            measurements,
            cursor: SmoothCursor::with_max_gap(self.map_from_head, Span::from_seconds(MAX_POSE_GAP_S)),
            truth: self.with_truth.then(|| TruthCursor::new(self.reader.truth())),
            calibrated: LidarModel::calibrated(self.calibration),
            corrected: LidarModel::corrected(self.calibration, self.lidar),
            noise,
            covariances: self.covariances,
            filter: (!self.options.keep_outliers).then(|| CloudFilter::new(noise)),
            files: CloudFiles::create(folder, self.options.format)?,
            sampled: Thinning::to_at_most(MAX_SAMPLED_BEAMS, self.returns),
            displayed: Thinning::to_at_most(MAX_VIEWER_POINTS, self.returns),
            on_page: Thinning::to_at_most(MAX_PAGE_POINTS, self.returns),
            ready: Vec::new().into_iter(),
            span: self.map_from_head.span(),
            projected: 0,
            class_counts: ClassCounts::default(),
            sample: Vec::new(),
            page_points: Vec::new(),
            failure: None,
            watch,
        };
        write_for_result(folder)?;
        let result = folder.join("result.mcap");
        write_result(&result, self.body_frame, self.map_from_head, self.covariances, beams.by_ref())?;
        if let Some(failure) = beams.failure {
            return Err(failure);
        }
        beams.files.finish()?;
        let filtered = !self.options.keep_outliers;
        let BeamProjection { class_counts, sample, page_points, .. } = beams;
        Ok(RegisteredCloud { class_counts, filtered, sample, page_points })
    }
}

/// A beam projected by the estimate and by the truth.
type ProjectedPair = (ProjectedBeam, Option<(ProjectedBeam, TrueState)>);

/// A return that waits for the decision of the filter.
struct Pending {
    point: CloudPoint,
    /// Whether it is a point for viewers.
    displayed: bool,
    /// Whether it is a point for the page.
    on_page: bool,
    /// The projected beam if it is in the sample; boxed, because most returns are not.
    sampled: Option<Box<ProjectedPair>>,
}

/// Projects the recording scan by scan, writes the cloud files, and iterates over the points for viewers.
struct BeamProjection<'a, 'm, 'w, 's> {
    measurements: &'m mut MeasurementStream<'m>,
    cursor: SmoothCursor<'a>,
    truth: Option<TruthCursor<'a>>,
    /// The lidar as calibrated, for projection by the truth.
    calibrated: LidarModel,
    /// The lidar with the estimated correction, for projection by the estimate.
    corrected: LidarModel,
    noise: LidarNoise,
    /// Covariances from the current stamp on.
    covariances: &'a [(Stamp, PoseCovariance)],
    filter: Option<CloudFilter<Pending>>,
    files: CloudFiles,
    sampled: Thinning,
    displayed: Thinning,
    on_page: Thinning,
    ready: std::vec::IntoIter<CloudPoint>,
    span: Option<(Stamp, Stamp)>,
    /// Number of projected returns.
    projected: usize,
    class_counts: ClassCounts,
    sample: Vec<SampledBeam>,
    page_points: Vec<CloudPoint>,
    failure: Option<RunError>,
    watch: &'w mut ProgressMonitor<'s>,
}

impl Iterator for BeamProjection<'_, '_, '_, '_> {
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

impl BeamProjection<'_, '_, '_, '_> {
    /// Processes the next scan and returns its points for viewers.
    fn next_scan(&mut self) -> Result<Option<Vec<CloudPoint>>, RunError> {
        loop {
            match self.measurements.next().transpose()? {
                None => {
                    let Some(filter) = self.filter.take() else { return Ok(None) };
                    return Ok(Some(self.settle(filter.finish())?));
                }
                Some(Measurement::Imu(_)) => {}
                Some(Measurement::Lidar(scan)) => {
                    if self.watch.is_stopped() {
                        return Err(Stopped.into());
                    }
                    if let Some((first, last)) = self.span {
                        let (done_s, total_s) = (scan.stamp.seconds_since(first), last.seconds_since(first));
                        self.watch.progress(Stage::Registering, done_s, Some(total_s));
                    }
                    return Ok(Some(self.register(&scan)?));
                }
            }
        }
    }

    /// Projects a scan and returns the points for viewers that the filter has accepted.
    fn register(&mut self, scan: &LidarScan) -> Result<Vec<CloudPoint>, RecordingError> {
        let mut pending = Vec::with_capacity(scan.returns.len());
        for beam in &scan.returns {
            let stamp = scan.stamp + beam.offset;
            // The estimate does not cover the start and the end of the recording, and gaps.
            let Some(map_from_head) = self.cursor.at(stamp) else { continue };
            pending.push(self.project(&map_from_head, beam, stamp)?);
        }
        let decided = match &mut self.filter {
            Some(filter) => filter.push(pending),
            None => pending.into_iter().map(|(_, pending)| (pending, ReturnClass::Static)).collect(),
        };
        self.settle(decided)
    }

    fn project(
        &mut self,
        map_from_head: &Pose,
        beam: &LidarReturn,
        stamp: Stamp,
    ) -> Result<(ProjectedReturn, Pending), RecordingError> {
        let index = self.projected;
        self.projected += 1;
        let point_in_laser: Vector = beam.point_in_laser.cast();
        let in_map = self.corrected.beam(map_from_head, &point_in_laser);
        let arm = in_map.point - map_from_head.translation.vector;
        let range_sigma_m = self.noise.sigma_m(point_in_laser.norm());
        let error_m = self.covariance_at(stamp).map_or(f64::NAN, |c| point_sigma_m(range_sigma_m, c, &arm)) as f32;
        let point = CloudPoint { point_in_map: in_map.point.cast(), intensity: beam.intensity, stamp, error_m };
        let mut sampled = None;
        if self.sampled.keeps(index) {
            let state = self.truth.as_mut().map(|truth| truth.at(stamp)).transpose()?.flatten();
            let by_truth = state.map(|state| (self.calibrated.beam(&state.world_from_head, &point_in_laser), state));
            sampled = Some(Box::new((in_map, by_truth)));
        }
        let hit = ProjectedReturn { stamp, point_in_map: in_map.point, origin_in_map: in_map.origin };
        let (displayed, on_page) = (self.displayed.keeps(index), self.on_page.keeps(index));
        Ok((hit, Pending { point, displayed, on_page, sampled }))
    }

    /// The last covariance at or before `stamp`, or the first one if there is none.
    fn covariance_at(&mut self, stamp: Stamp) -> Option<&'_ PoseCovariance> {
        while let [_, (next, _), ..] = self.covariances
            && *next <= stamp
        {
            self.covariances = &self.covariances[1..];
        }
        self.covariances.first().map(|(_, covariance)| covariance)
    }

    /// Counts the decisions, writes the accepted points and returns those for viewers.
    fn settle(&mut self, decided: Vec<(Pending, ReturnClass)>) -> Result<Vec<CloudPoint>, RecordingError> {
        let mut displayed = Vec::new();
        for (pending, class) in decided {
            self.class_counts.count(class);
            self.sample.extend(pending.sampled.map(|pair| SampledBeam { in_map: pair.0, by_truth: pair.1, class }));
            if class == ReturnClass::Static {
                self.files.point(&pending.point)?;
                self.page_points.extend(pending.on_page.then_some(pending.point));
                displayed.extend(pending.displayed.then_some(pending.point));
            }
        }
        Ok(displayed)
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
    pub(super) fn corrected(calibration: &Calibration, lidar: &LidarCorrection) -> Self {
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
