//! Estimation from a recording with timing errors, and evaluation of the estimate.

use super::reference::{Reference, SampledReturn};
use super::stamp_errors::DisturbedStamps;
use super::{ClockState, TimingSpec};
use crate::RunError;
use crate::run_recording::RunRecording;
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;
use zsim_base::geometry::{Pose, SmoothCursor, Trajectory, Vector};
use zsim_base::parallel::check;
use zsim_base::time::Stamp;
use zsim_estimation::{ClockSpec, Estimator, EstimatorSpec, OpenLoop, smoothed_stamps};
use zsim_evaluation::{CloudErrors, Errors, Pairs};
use zsim_report::Metrics;
use zsim_simulation::Simulation;

/// Maximum distance from a point to a surface, m: points farther away are outliers.
const REACH_M: f64 = 1.0;

/// Errors of a run and its map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapErrors {
    /// Error sums per block of time.
    pub blocks: Vec<Block>,
    /// Estimated minus true clock offset at the end of the run, ms.
    pub clock_error_ms: f64,
    /// Vertical section through the map, if it is shown.
    pub section: Option<Section>,
}

/// Points in a vertical section through a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Shown range (along the section, up), m.
    pub range_m: ((f64, f64), (f64, f64)),
    /// Coordinates by the estimate (along the section, up), m; NaN outside the estimated time.
    pub points_m: Vec<(f32, f32)>,
    /// True angular rate of the head in the section's plane for each point, degrees/s.
    pub rates_deg_per_s: Vec<f64>,
}

impl MapErrors {
    /// Returns the errors as metrics of a run.
    pub(crate) fn metrics(&self) -> Metrics {
        let sum = pooled(&self.blocks);
        let mut metrics = Metrics::default();
        metrics.open_loop.position_rmse_m = Some(sum.position_variance_m2().sqrt());
        metrics.cloud.sigma_m = Some(sum.cloud_variance_m2().sqrt());
        metrics.cloud.bias_m = Some(sum.cloud_bias_m());
        metrics.clock.offset_end_error_s = Some(self.clock_error_ms * 1e-3);
        metrics
    }
}

/// A recording that is estimated with a timing error.
pub(crate) struct TimingRun<'a> {
    pub recording: &'a RunRecording,
    pub simulation: &'a Simulation,
    pub reference: &'a Reference,
    pub timing: &'a TimingSpec,
}

impl TimingRun<'_> {
    /// Estimates, and evaluates the estimate.
    pub fn evaluate(&self, estimator: &EstimatorSpec, stop: &AtomicBool) -> Result<MapErrors, RunError> {
        let disturbance = self.timing.disturbance();
        let seed = self.simulation.inputs().seed;
        let timing = DisturbedStamps::new(disturbance, &self.reference.clock, &self.reference.scan_stamps, seed);
        let estimator = with_known_jitter(estimator, disturbance.noise_ms * 1e-3);
        let estimate = self.estimate(&estimator, &timing, stop)?;
        // The cloud uses the scan times that the estimator assumed.
        let scan_stamps = smoothed_stamps(timing.scan_stamps(), &estimator);
        let pairs = Pairs::associate(&estimate.trajectory, &self.reference.truth)?;
        let world_from_map = pairs.world_from_map()?;
        let mut blocks = Vec::new();
        let errors = Errors::after(&pairs, &world_from_map);
        for (stamp, error) in errors.stamps.iter().zip(&errors.position_m) {
            let block = self.block_at(&mut blocks, *stamp);
            block.poses += 1.0;
            block.position2_m2 += error.norm_squared();
        }
        let cloud = EstimatedCloud { trajectory: &estimate.trajectory, world_from_map, scan_stamps: &scan_stamps };
        self.evaluate_cloud(&cloud, &mut blocks);
        let offset_s = estimate.clock_offsets.last().map_or(0.0, |(_, offset_s)| *offset_s);
        Ok(MapErrors {
            blocks,
            clock_error_ms: offset_s * 1e3 - disturbance.latency_ms,
            section: self.timing.shown.then(|| self.section(&cloud)),
        })
    }

    fn section(&self, cloud: &EstimatedCloud<'_>) -> Section {
        let coordinates = |projected: Option<(Vector, Vector)>| {
            let (along, up) =
                projected.map_or((f64::NAN, f64::NAN), |(point, _)| self.reference.section.coordinates(&point));
            (along as f32, up as f32)
        };
        let shown = cloud.project(&self.reference.shown, &self.recording.calibration.head_from_laser);
        Section {
            range_m: self.reference.range_m,
            points_m: shown.into_iter().map(coordinates).collect(),
            rates_deg_per_s: self.reference.shown_rates_deg_per_s.clone(),
        }
    }

    /// Runs the estimator on the disturbed recording.
    fn estimate(
        &self,
        spec: &EstimatorSpec,
        timing: &DisturbedStamps<'_>,
        stop: &AtomicBool,
    ) -> Result<OpenLoop, RunError> {
        let RunRecording { reader, selection, calibration } = self.recording;
        let mut estimator = Estimator::new(spec, calibration)?;
        for measurement in timing.apply(reader.measurements(selection)) {
            check(stop)?;
            estimator.push(measurement?)?;
        }
        Ok(estimator.finish()?)
    }

    /// Adds the distances of the cloud to the true surfaces.
    fn evaluate_cloud(&self, cloud: &EstimatedCloud<'_>, blocks: &mut Vec<Block>) {
        let returns = &self.reference.evaluated;
        let projected = cloud.project(returns, &self.recording.calibration.head_from_laser);
        for (hit, (point, origin)) in returns.iter().zip(projected).filter_map(|(hit, ends)| Some((hit, ends?))) {
            let found = CloudErrors::to_surface(self.simulation.world(), &[(point, Some(origin))], REACH_M);
            if let Some(distance_m) = found.signed_m.first() {
                let block = self.block_at(blocks, self.reference.scan_stamps[hit.scan]);
                block.points += 1.0;
                block.distance_m += distance_m;
                block.distance2_m2 += distance_m * distance_m;
            }
        }
    }

    /// The block of time that contains `stamp`.
    fn block_at<'b>(&self, blocks: &'b mut Vec<Block>, stamp: Stamp) -> &'b mut Block {
        let (first, last) = self.reference.truth.span().unwrap_or_default();
        let count = ((last.seconds_since(first) / self.timing.block_s).round() as usize).max(1);
        blocks.resize(count, Block::default());
        let index = (stamp.seconds_since(first) / self.timing.block_s).max(0.0) as usize;
        &mut blocks[index.min(count - 1)]
    }
}

/// An estimate that projects returns into the world.
struct EstimatedCloud<'a> {
    /// `map_from_head`.
    trajectory: &'a Trajectory,
    world_from_map: Pose,
    /// Stamps that the estimator assumed, by index of the scan.
    scan_stamps: &'a [Stamp],
}

impl EstimatedCloud<'_> {
    /// End and origin of beams in the world; `None` outside the estimated time.
    fn project(&self, returns: &[SampledReturn], head_from_laser: &Pose) -> Vec<Option<(Vector, Vector)>> {
        let mut cursor = SmoothCursor::new(self.trajectory);
        let project = |hit: &SampledReturn| {
            let map_from_head = cursor.at(self.scan_stamps[hit.scan] + hit.offset)?;
            let world_from_laser = self.world_from_map * map_from_head * head_from_laser;
            let end = world_from_laser.transform_point(&hit.point_in_laser.into()).coords;
            Some((end, world_from_laser.translation.vector))
        };
        returns.iter().map(project).collect()
    }
}

/// The estimator that knows the jitter of the stamps, if it smooths stamps.
fn with_known_jitter(estimator: &EstimatorSpec, noise_s: f64) -> EstimatorSpec {
    let own = &estimator.clock;
    let jitter_s = if own.jitter_s > 0.0 { own.jitter_s.max(noise_s) } else { 0.0 };
    EstimatorSpec { clock: ClockSpec { jitter_s, ..own.clone() }, ..estimator.clone() }
}

impl ClockState {
    /// Whether an estimator estimates clock errors.
    pub fn of(estimator: &EstimatorSpec) -> Self {
        if estimator.clock.estimated { Self::On } else { Self::Off }
    }
}

/// Error sums over one block of time; sums of several blocks are added.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Number of cloud points within reach of a surface.
    pub points: f64,
    /// Sum of the signed distances of the points to the surfaces, m.
    pub distance_m: f64,
    /// Sum of the squared distances, m^2.
    pub distance2_m2: f64,
    /// Number of poses.
    pub poses: f64,
    /// Sum of the squared position errors of the poses, m^2.
    pub position2_m2: f64,
}

impl Block {
    /// Adds another block as often as it is counted.
    pub fn add(&mut self, other: &Block, times: f64) {
        self.points += times * other.points;
        self.distance_m += times * other.distance_m;
        self.distance2_m2 += times * other.distance2_m2;
        self.poses += times * other.poses;
        self.position2_m2 += times * other.position2_m2;
    }

    /// Variance of the signed distances, m^2.
    pub fn cloud_variance_m2(&self) -> f64 {
        let mean = self.distance_m / self.points;
        (self.distance2_m2 / self.points - mean * mean).max(0.0)
    }

    /// Mean of the squared position error, m^2.
    pub fn position_variance_m2(&self) -> f64 {
        self.position2_m2 / self.poses
    }

    /// Mean signed distance, m.
    pub fn cloud_bias_m(&self) -> f64 {
        self.distance_m / self.points
    }
}

/// Returns the sum of all blocks.
pub fn pooled(blocks: &[Block]) -> Block {
    blocks.iter().fold(Block::default(), |mut sum, block| {
        sum.add(block, 1.0);
        sum
    })
}
