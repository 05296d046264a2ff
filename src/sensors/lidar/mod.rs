//! Lidars: beam pattern and timing, ray intersections, echoes and range errors.

mod beam;
mod canopy;
mod draws;
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
pub use spec::{
    BeamModel, DetectionSpec, FarRange, GlassSpec, GrazingSpec, LidarErrorsSpec, LidarSpec, RangeNoiseSpec, RangeSigma,
    Switch,
};
pub use sweep::{ScanTiming, Sweep};

use pattern::{Pattern, Plane};
use std::f64::consts::TAU;
use zsim_base::geometry::{Rotation, Vector};
use zsim_base::measurement::LidarNoise;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, parse_named};
use zsim_base::time::Span;

/// Maximum number of rays of a beam.
const MAX_RAYS: usize = 7;

/// A lidar: beam pattern, timing and error model.
#[derive(Debug, Clone)]
pub struct Lidar {
    beams: Vec<Beam>,
    plane: Option<Plane>,
    /// Rotation of the pattern about z from one scan to the next, turns.
    turns_per_scan: f64,
    /// The rays, grouped by beam: unit vectors in the lidar frame.
    rays: Vec<Vector>,
    /// Fraction of the light of a beam in each ray.
    weights: &'static [f64],
    spec: LidarSpec,
}

impl Lidar {
    /// The lidar that `spec`, from `source`, describes.
    ///
    /// # Errors
    /// If the beams do not fit into a turn, a rate is out of range, or limits contradict each other.
    pub fn new(spec: &LidarSpec, source: &Source) -> Result<Self, SpecError> {
        spec.check(source)?;
        let Pattern { beams, plane, turns_per_scan } = spec.pattern.build(spec.rate_hz, source)?;
        spec.check_beams(beams.len(), source)?;
        let (rays, weights) = spec.rays(&beams);
        Ok(Self { beams, plane, turns_per_scan, rays, weights, spec: spec.clone() })
    }

    /// The spec from which it was built.
    pub fn spec(&self) -> &LidarSpec {
        &self.spec
    }

    /// The beams of scan 0 in firing order. Other scans have the same beams, rotated about z if the pattern does not
    /// repeat.
    pub fn beams(&self) -> &[Beam] {
        &self.beams
    }

    /// Whether scans have the form of a planar scan: one range and intensity per azimuth step.
    pub fn is_planar(&self) -> bool {
        self.plane.is_some()
    }

    /// Number of rays that represent one beam.
    pub fn rays_per_beam(&self) -> usize {
        self.weights.len()
    }

    /// Scan period, s.
    pub fn period_s(&self) -> f64 {
        1.0 / self.spec.rate_hz
    }

    /// Time from the first to the last beam of a scan.
    pub fn sweep_span(&self) -> Span {
        self.beams.iter().map(|beam| beam.offset).max().unwrap_or(Span::ZERO)
    }

    /// Rotation of the beams of scan `scan` relative to scan 0, if the pattern does not repeat.
    pub fn scan_rotation(&self, scan: u64) -> Option<Rotation> {
        let turns = (self.turns_per_scan.fract() * scan as f64).fract();
        (self.turns_per_scan != 0.0).then(|| Rotation::from_axis_angle(&Vector::z_axis(), TAU * turns))
    }

    /// Range noise for an estimator: as in the spec, also if the errors are switched off.
    pub fn noise(&self) -> LidarNoise {
        self.spec.range_noise()
    }
}

impl NamedSpec for LidarSpec {
    const KIND: Kind = Kind::Lidar;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        Lidar::new(self, source).map(|_| Vec::new())
    }
}
