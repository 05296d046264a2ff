//! Registration of the beams into a cloud: output files, points for viewers, and what the evaluation needs of them.

use super::RunError;
use super::beams::{BeamReader, EstimatedBeams, LidarModel, ProjectedBeam};
use super::cloud_files::{CloudFiles, CloudOptions};
use super::loops::{BestEstimate, Loops};
use super::result_files::write_for_result;
use super::truth_cursor::{TrueState, TruthCursor};
use std::path::Path;
use zsim_base::geometry::{PoseCovariance, Vector};
use zsim_base::measurement::{LidarNoise, LidarReturn, LidarScan};
use zsim_base::time::Stamp;
use zsim_estimation::{CloudFilter, ProjectedReturn, ReturnClass, point_sigma_m};
use zsim_evaluation::Thinning;
use zsim_recording::{CloudPoint, FoundCalibration, RecordingError, ResultWriter};
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

/// Result of the registration, from a second pass over the recording.
pub(super) struct RegisteredCloud {
    /// Number of returns by decision of the filter, in the order of [`ReturnClass`].
    pub class_counts: [u64; 4],
    /// Whether the cloud was filtered.
    pub filtered: bool,
    /// A sample of the beams, before filtering.
    pub sample: Vec<SampledBeam>,
    /// Points for the page, after filtering.
    pub page_points: Vec<CloudPoint>,
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
    class_counts: [u64; 4],
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

impl<'a> CloudRegistration<'a> {
    /// Creates the files of the cloud of the best estimate, `result.mcap` and its layout in `folder`.
    pub(super) fn start(
        found: &'a FoundCalibration,
        loops: &'a Loops,
        options: CloudOptions,
        folder: &Path,
    ) -> Result<Self, RunError> {
        let BestEstimate { map_from_head, covariances, lidar, .. } = loops.best();
        let (calibration, returns) = (&found.calibration, loops.open.returns);
        write_for_result(folder)?;
        Ok(Self {
            estimate: EstimatedBeams::new(map_from_head, calibration, lidar),
            calibrated: LidarModel::calibrated(calibration),
            noise: calibration.lidar,
            covariances,
            filter: (!options.keep_outliers).then(|| CloudFilter::new(calibration.lidar)),
            files: CloudFiles::create(folder, options.format)?,
            result: ResultWriter::create(&folder.join("result.mcap"), &found.body_frame, map_from_head, covariances)?,
            sampled: Thinning::to_at_most(MAX_SAMPLED_BEAMS, returns),
            displayed: Thinning::to_at_most(MAX_VIEWER_POINTS, returns),
            on_page: Thinning::to_at_most(MAX_PAGE_POINTS, returns),
            projected: 0,
            class_counts: [0; 4],
            sample: Vec::new(),
            page_points: Vec::new(),
        })
    }

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
            self.class_counts[class as usize] += 1;
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
