//! One estimate of the disturbed recording, and what it is worth.

use super::band::Block;
use super::disturb::Timing;
use super::probe::{Probe, ProbeBeam};
use super::{ClockState, Disturbance};
use crate::estimation::{ClockSpec, Estimator, EstimatorSpec, OpenLoop, smoothed_stamps};
use crate::evaluation::{CloudErrors, Errors, Pairs};
use crate::geometry::{Pose, SmoothCursor, Vector};
use crate::measurement::Calibration;
use crate::random::Seed;
use crate::recording::{Reader, Selection};
use crate::study::StudyError;
use crate::time::Stamp;
use crate::world::World;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// How far from a point a surface is looked for, m.
const REACH_M: f64 = 1.0;

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Judged {
    /// What it is worth, block of time by block.
    pub blocks: Vec<Block>,
    /// Estimated minus true clock offset at the end, ms.
    pub clock_error_ms: f64,
    /// Where the beams of the cut lie in it, along and up, m; NaN for one that the estimate does not cover.
    pub cut_m: Vec<(f32, f32)>,
}

/// The recording, and all that runs have in common.
pub(super) struct Bench<'a> {
    pub reader: &'a Reader,
    pub selection: &'a Selection,
    pub calibration: &'a Calibration,
    pub estimator: &'a EstimatorSpec,
    pub world: &'a World,
    pub probe: &'a Probe,
    pub block_s: f64,
    pub seed: Seed,
}

impl Bench<'_> {
    /// Estimates with a disturbance and judges.
    pub(super) fn run(
        &self,
        disturbance: Disturbance,
        clock: ClockState,
        stop: &AtomicBool,
    ) -> Result<Judged, StudyError> {
        let timing = Timing::new(disturbance, &self.probe.clock, &self.probe.scan_stamps, self.seed);
        let estimator = self.settings(clock, disturbance.noise_ms * 1e-3);
        let estimate = self.estimate(&estimator, &timing, stop)?;
        // The cloud is made with the times that the estimator took the scans for.
        let scan_stamps = smoothed_stamps(timing.scan_stamps(), &estimator);
        let pairs = Pairs::associate(&estimate.trajectory, &self.probe.truth)?;
        let world_from_map = pairs.world_from_map()?;
        let mut blocks = Vec::new();
        let errors = Errors::after(&pairs, &world_from_map);
        for (stamp, error) in errors.stamps.iter().zip(&errors.position_m) {
            let block = self.block_at(&mut blocks, *stamp);
            block.poses += 1.0;
            block.position2_m2 += error.norm_squared();
        }
        self.judge_cloud(&estimate, (&world_from_map, &scan_stamps), &mut blocks);
        let place = |seen: Option<(Vector, Vector)>| {
            let (along, up) = seen.map_or((f64::NAN, f64::NAN), |(point, _)| self.probe.cut.place(&point));
            (along as f32, up as f32)
        };
        let shown = self.project(&self.probe.shown, &estimate, &world_from_map, &scan_stamps);
        let offset_s = estimate.clock_offsets.last().map_or(0.0, |(_, offset_s)| *offset_s);
        Ok(Judged {
            blocks,
            clock_error_ms: offset_s * 1e3 - disturbance.latency_ms,
            cut_m: shown.into_iter().map(place).collect(),
        })
    }

    /// The estimator's settings for a clock state; who lets it smooth stamps tells it by how much they jitter.
    fn settings(&self, clock: ClockState, noise_s: f64) -> EstimatorSpec {
        let own = &self.estimator.clock;
        let clock = match clock {
            ClockState::On => ClockSpec { jitter_s: own.jitter_s.max(noise_s), ..own.clone() },
            ClockState::Off => ClockSpec { estimated: false, start_s: 0.0, jitter_s: 0.0, ..own.clone() },
        };
        EstimatorSpec { clock, ..self.estimator.clone() }
    }

    fn estimate(&self, spec: &EstimatorSpec, timing: &Timing<'_>, stop: &AtomicBool) -> Result<OpenLoop, StudyError> {
        let mut estimator = Estimator::new(spec, self.calibration)?;
        for measurement in timing.put_on(self.reader.measurements(self.selection)) {
            if stop.load(Ordering::Relaxed) {
                return Err(StudyError::Stopped);
            }
            estimator.push(measurement?)?;
        }
        Ok(estimator.finish()?)
    }

    fn judge_cloud(
        &self,
        estimate: &OpenLoop,
        (world_from_map, scan_stamps): (&Pose, &[Stamp]),
        blocks: &mut Vec<Block>,
    ) {
        let beams = &self.probe.judged;
        let seen = self.project(beams, estimate, world_from_map, scan_stamps);
        for (beam, (point, origin)) in beams.iter().zip(seen).filter_map(|(beam, seen)| Some((beam, seen?))) {
            let found = CloudErrors::to_surface(self.world, &[(point, Some(origin))], REACH_M);
            if let Some(distance_m) = found.signed_m.first() {
                let block = self.block_at(blocks, self.probe.scan_stamps[beam.scan]);
                block.points += 1.0;
                block.distance_m += distance_m;
                block.distance2_m2 += distance_m * distance_m;
            }
        }
    }

    /// Where beams end and begin by the estimate, in the world.
    fn project(
        &self,
        beams: &[ProbeBeam],
        estimate: &OpenLoop,
        world_from_map: &Pose,
        scan_stamps: &[Stamp],
    ) -> Vec<Option<(Vector, Vector)>> {
        let mut cursor = SmoothCursor::new(&estimate.trajectory);
        let project = |beam: &ProbeBeam| {
            let map_from_head = cursor.at(scan_stamps[beam.scan] + beam.offset)?;
            let world_from_laser = world_from_map * map_from_head * self.calibration.head_from_laser;
            let end = world_from_laser.transform_point(&beam.point_in_laser.into()).coords;
            Some((end, world_from_laser.translation.vector))
        };
        beams.iter().map(project).collect()
    }

    fn block_at<'b>(&self, blocks: &'b mut Vec<Block>, stamp: Stamp) -> &'b mut Block {
        let (first, last) = self.probe.truth.span().unwrap_or_default();
        let count = ((last.seconds_since(first) / self.block_s).round() as usize).max(1);
        blocks.resize(count, Block::default());
        let index = (stamp.seconds_since(first) / self.block_s).max(0.0) as usize;
        &mut blocks[index.min(count - 1)]
    }
}
