//! Lidars: beams in time, the surfaces they meet, and the echoes that come back.

mod echo;
mod errors;
mod interlaced;
mod measure;
mod pattern;
mod rosette;
mod spec;
mod sweep;

pub use errors::LidarErrors;
pub use pattern::{Beam, PatternSpec};
pub use spec::{DetectionSpec, GlassSpec, GrazingSpec, LidarErrorsSpec, LidarSpec, RangeNoiseSpec, Rays, Switch};
pub use sweep::{Firing, Sweep};

use crate::geometry::{Rotation, Vector};
use crate::measurement::LidarNoise;
use crate::spec::{Source, SpecError};
use crate::time::Span;
use pattern::{Pattern, Plane};
use std::f64::consts::TAU;

/// A lidar: when and where each of its beams goes, and what its errors are like.
#[derive(Debug, Clone)]
pub struct Lidar {
    beams: Vec<Beam>,
    plane: Option<Plane>,
    /// By how much the beams of a scan are turned about z against those of the scan before, turns.
    turns_per_scan: f64,
    /// The rays of one beam after another, unit vectors in the lidar's frame.
    rays: Vec<Vector>,
    /// The share of the beam's light in each of its rays.
    weights: &'static [f64],
    spec: LidarSpec,
}

impl Lidar {
    /// The lidar that `spec`, from `source`, describes.
    ///
    /// # Errors
    /// When its beams do not fit into its turn, its rates are those of no lidar, or its limits contradict each other.
    pub fn new(spec: &LidarSpec, source: &Source) -> Result<Self, SpecError> {
        spec.check(source)?;
        let Pattern { beams, plane, turns_per_scan } = spec.pattern.build(spec.rate_hz, source)?;
        spec.check_beams(beams.len(), source)?;
        let (rays, weights) = spec.rays_of(&beams);
        Ok(Self { beams, plane, turns_per_scan, rays, weights, spec: spec.clone() })
    }

    /// The spec it was built from.
    pub fn spec(&self) -> &LidarSpec {
        &self.spec
    }

    /// The beams of scan 0, in the order in which they are fired. Those of other scans are the same, or turned about z
    /// where the pattern does not repeat.
    pub fn beams(&self) -> &[Beam] {
        &self.beams
    }

    /// Whether its scans have the polar form of a planar scan: one range and intensity for each step in azimuth.
    pub fn is_planar(&self) -> bool {
        self.plane.is_some()
    }

    /// How many rays stand for one beam.
    pub fn rays_per_beam(&self) -> usize {
        self.weights.len()
    }

    /// Time from one scan to the next, s.
    pub fn period_s(&self) -> f64 {
        1.0 / self.spec.rate_hz
    }

    /// Whether it scans a plane, so that its scans have a polar form.
    pub fn scans_plane(&self) -> bool {
        self.plane.is_some()
    }

    /// Time from the first beam of a scan to its last.
    pub fn sweep_span(&self) -> Span {
        self.beams.iter().map(|beam| beam.offset).max().unwrap_or(Span::ZERO)
    }

    /// By what the beams of scan `scan` are turned against those of scan 0, where the pattern does not repeat.
    pub fn turned(&self, scan: u64) -> Option<Rotation> {
        let turns = (self.turns_per_scan.fract() * scan as f64).fract();
        (self.turns_per_scan != 0.0).then(|| Rotation::from_axis_angle(&Vector::z_axis(), TAU * turns))
    }

    /// How well it measures range, for an estimator: by its spec even where its errors are switched off.
    pub fn noise(&self) -> LidarNoise {
        let range = &self.spec.errors.range;
        LidarNoise {
            near_sigma_m: range.near_sigma_m,
            near_m: range.near_m,
            far_sigma_m: range.far_sigma_m,
            far_m: range.far_m,
        }
    }
}
