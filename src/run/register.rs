//! Registration of the beams into a cloud: output files, points for viewers, and what the evaluation needs of them.

use super::RunError;
use super::beams::{BeamReader, EstimatedBeams, LidarModel, ProjectedBeam};
use super::cloud_files::{CloudFiles, CloudOptions};
use super::truth_cursor::{TrueState, TruthCursor};
use super::viewer_files::write_for_result;
use std::path::Path;
use zsim_base::geometry::{PoseCovariance, Trajectory, Vector};
use zsim_base::measurement::{Calibration, LidarCorrection, LidarNoise, LidarReturn, LidarScan};
use zsim_base::time::Stamp;
use zsim_estimation::{CloudFilter, ProjectedReturn, ReturnClass, point_sigma_m};
use zsim_evaluation::Thinning;
use zsim_recording::{CloudPoint, RecordingError, ResultWriter};
use zsim_report::page::MAX_PAGE_POINTS;

/// Maximum number of beams in the sample for the evaluation.
const MAX_SAMPLED_BEAMS: usize = 100_000;
/// Maximum number of points for viewers, in `result.mcap`; the cloud files have all points.
const MAX_VIEWER_POINTS: usize = 1_000_000;
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
#[derive(Clone, Copy)]
pub(super) struct Registration<'a> {
    pub calibration: &'a Calibration,
    pub body_frame: &'a str,
    pub map_from_head: &'a Trajectory,
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// Estimated correction of the lidar calibration.
    pub lidar: &'a LidarCorrection,
    /// Number of returns in the recording.
    pub returns: usize,
    /// Options of the cloud.
    pub options: CloudOptions,
}

impl<'a> Registration<'a> {
    /// Creates the files of the cloud, `result.mcap` and its layout in `folder`, and the reader of beams that writes them.
    pub(super) fn start(self, folder: &Path) -> Result<CloudRegistration<'a>, RunError> {
        let noise = self.calibration.lidar;
        write_for_result(folder)?;
        let result = folder.join("result.mcap");
        Ok(CloudRegistration {
            estimate: EstimatedBeams::new(self.map_from_head, self.calibration, self.lidar),
            calibrated: LidarModel::calibrated(self.calibration),
            noise,
            covariances: self.covariances,
            filter: (!self.options.keep_outliers).then(|| CloudFilter::new(noise)),
            files: CloudFiles::create(folder, self.options.format)?,
            result: ResultWriter::create(&result, self.body_frame, self.map_from_head, self.covariances)?,
            sampled: Thinning::to_at_most(MAX_SAMPLED_BEAMS, self.returns),
            displayed: Thinning::to_at_most(MAX_VIEWER_POINTS, self.returns),
            on_page: Thinning::to_at_most(MAX_PAGE_POINTS, self.returns),
            projected: 0,
            class_counts: ClassCounts::default(),
            sample: Vec::new(),
            page_points: Vec::new(),
        })
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

/// Projects the beams scan by scan, and writes the points that the filter accepts.
pub(super) struct CloudRegistration<'a> {
    estimate: EstimatedBeams<'a>,
    /// The lidar as calibrated, for projection by the truth.
    calibrated: LidarModel,
    noise: LidarNoise,
    /// Covariances from the current stamp on.
    covariances: &'a [(Stamp, PoseCovariance)],
    filter: Option<CloudFilter<Pending>>,
    files: CloudFiles,
    result: ResultWriter<'a>,
    sampled: Thinning,
    displayed: Thinning,
    on_page: Thinning,
    /// Number of projected returns.
    projected: usize,
    class_counts: ClassCounts,
    sample: Vec<SampledBeam>,
    page_points: Vec<CloudPoint>,
}

impl BeamReader for CloudRegistration<'_> {
    fn scan(&mut self, scan: &LidarScan, mut truth: Option<&mut TruthCursor>) -> Result<(), RunError> {
        let mut pending = Vec::with_capacity(scan.returns.len());
        for beam in &scan.returns {
            pending.extend(self.project(beam, scan.stamp + beam.offset, truth.as_deref_mut())?);
        }
        let decided = match &mut self.filter {
            Some(filter) => filter.push(pending),
            None => pending.into_iter().map(|(_, pending)| (pending, ReturnClass::Static)).collect(),
        };
        Ok(self.settle(decided)?)
    }
}

impl CloudRegistration<'_> {
    /// Writes the remaining points and completes the files.
    pub(super) fn finish(mut self) -> Result<RegisteredCloud, RunError> {
        let filtered = self.filter.is_some();
        if let Some(filter) = self.filter.take() {
            self.settle(filter.finish())?;
        }
        self.result.finish()?;
        self.files.finish()?;
        let Self { class_counts, sample, page_points, .. } = self;
        Ok(RegisteredCloud { class_counts, filtered, sample, page_points })
    }

    fn project(
        &mut self,
        beam: &LidarReturn,
        stamp: Stamp,
        truth: Option<&mut TruthCursor>,
    ) -> Result<Option<(ProjectedReturn, Pending)>, RecordingError> {
        let Some((map_from_head, in_map)) = self.estimate.project(beam, stamp) else { return Ok(None) };
        let index = self.projected;
        self.projected += 1;
        let point_in_laser: Vector = beam.point_in_laser.cast();
        let arm = in_map.point - map_from_head.translation.vector;
        let range_sigma_m = self.noise.sigma_m(point_in_laser.norm());
        let error_m = self.covariance_at(stamp).map_or(f64::NAN, |c| point_sigma_m(range_sigma_m, c, &arm)) as f32;
        let point = CloudPoint { point_in_map: in_map.point.cast(), intensity: beam.intensity, stamp, error_m };
        let mut sampled = None;
        if self.sampled.keeps(index) {
            let state = truth.map(|truth| truth.at(stamp)).transpose()?.flatten();
            let by_truth = state.map(|state| (self.calibrated.beam(&state.world_from_head, &point_in_laser), state));
            sampled = Some(Box::new((in_map, by_truth)));
        }
        let hit = ProjectedReturn { stamp, point_in_map: in_map.point, origin_in_map: in_map.origin };
        let (displayed, on_page) = (self.displayed.keeps(index), self.on_page.keeps(index));
        Ok(Some((hit, Pending { point, displayed, on_page, sampled })))
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

    /// Counts the decisions and writes the accepted points.
    fn settle(&mut self, decided: Vec<(Pending, ReturnClass)>) -> Result<(), RecordingError> {
        for (pending, class) in decided {
            self.class_counts.count(class);
            self.sample.extend(pending.sampled.map(|pair| SampledBeam { in_map: pair.0, by_truth: pair.1, class }));
            if class == ReturnClass::Static {
                self.files.point(&pending.point)?;
                self.page_points.extend(pending.on_page.then_some(pending.point));
                if pending.displayed {
                    self.result.point(pending.point)?;
                }
            }
        }
        Ok(())
    }
}
