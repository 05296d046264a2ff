//! `sensor_msgs/LaserScan`: one planar sweep (REP-103, REP-117).

use crate::RecordingError;
use crate::message::no_returns::RangeLimits;
use crate::wire::{DecodeError, Decoder, Encoder, Payload};
use zsim_base::measurement::{LidarReturn, LidarScan, PlanarScan};
use zsim_base::time::{Span, Stamp};

/// Maximum credible duration of a sweep, s.
const MAX_SWEEP_S: f64 = 60.0;

/// Encodes a sweep of the lidar in `frame` that starts at `stamp`.
///
/// # Errors
/// When the stamp or the number of beams does not fit into a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, stamp: Stamp, scan: &PlanarScan) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    let last = scan.ranges_m.len().saturating_sub(1) as f64;
    for value in [
        scan.angle_min_rad,
        scan.angle_min_rad + last * scan.angle_increment_rad,
        scan.angle_increment_rad,
        scan.time_increment_s,
        scan.scan_time_s,
    ] {
        out.f32(value as f32);
    }
    out.f32(scan.range_min_m);
    out.f32(scan.range_max_m);
    out.f32_sequence(&scan.ranges_m)?;
    out.f32_sequence(&scan.intensities)
}

/// Fields of a sweep before the ranges.
#[derive(Debug, Clone, Copy)]
pub struct ScanHeader {
    angle_min_rad: f64,
    angle_increment_rad: f64,
    time_increment_s: f64,
    scan_time_s: f64,
    range_min_m: f32,
    range_max_m: f32,
}

impl ScanHeader {
    /// Decodes the fields from `angle_min` to `range_max`.
    ///
    /// # Errors
    /// When the message is truncated, or an angle or a time is not finite.
    pub fn decode(input: &mut Decoder<'_>) -> Result<Self, DecodeError> {
        let mut finite = |field: &'static str| {
            let value = f64::from(input.f32()?);
            if value.is_finite() { Ok(value) } else { Err(DecodeError::NotFinite { field }) }
        };
        let angle_min_rad = finite("angle_min")?;
        // Unused: in some drivers it does not match the number of ranges.
        let _ = finite("angle_max");
        let angle_increment_rad = finite("angle_increment")?;
        let (time_increment_s, scan_time_s) = (finite("time_increment")?, finite("scan_time")?);
        let (range_min_m, range_max_m) = (input.f32()?, input.f32()?);
        Ok(Self { angle_min_rad, angle_increment_rad, time_increment_s, scan_time_s, range_min_m, range_max_m })
    }
}

/// Combines the fields of a sweep.
///
/// # Errors
/// When they are inconsistent.
pub fn build_planar(header: ScanHeader, ranges_m: Vec<f32>, intensities: Vec<f32>) -> Result<PlanarScan, DecodeError> {
    let ScanHeader { angle_min_rad, angle_increment_rad, time_increment_s, scan_time_s, range_min_m, range_max_m } =
        header;
    if !intensities.is_empty() && intensities.len() != ranges_m.len() {
        return Err(DecodeError::Contradiction("a scan has different numbers of intensities and ranges"));
    }
    if angle_increment_rad == 0.0 && ranges_m.len() > 1 {
        return Err(DecodeError::Contradiction("angle_increment is 0 with several ranges"));
    }
    if time_increment_s.abs() * ranges_m.len() as f64 > MAX_SWEEP_S || scan_time_s.abs() > MAX_SWEEP_S {
        return Err(DecodeError::Contradiction("time_increment or scan_time give a scan of more than 60 s"));
    }
    Ok(PlanarScan {
        angle_min_rad,
        angle_increment_rad,
        time_increment_s,
        scan_time_s,
        range_min_m,
        range_max_m,
        ranges_m,
        intensities,
    })
}

/// Decodes a sweep in polar form, with the stamp.
///
/// # Errors
/// When the bytes are not a `LaserScan`, or its angles or times are unusable.
pub fn decode(message: Payload<'_>) -> Result<(Stamp, PlanarScan), DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    let header = ScanHeader::decode(&mut input)?;
    let ranges_m = input.f32_sequence()?;
    let intensities = input.f32_sequence()?;
    Ok((stamp, build_planar(header, ranges_m, intensities)?))
}

/// Time between beams, s.
///
/// If the sweep does not state it, it follows from the angles and the period of a uniformly rotating mirror.
pub fn time_increment_s(scan: &PlanarScan) -> f64 {
    if scan.time_increment_s != 0.0 {
        return scan.time_increment_s;
    }
    scan.scan_time_s * scan.angle_increment_rad.abs() / std::f64::consts::TAU
}

/// Converts sweeps to points; caches the beam directions between sweeps.
#[derive(Debug, Default)]
pub struct Projector {
    angle_min_rad: f64,
    angle_increment_rad: f64,
    directions: Vec<(f64, f64)>,
}

impl Projector {
    /// Converts a sweep to points in the laser frame, in firing order; the result also contains the sweep as it is.
    ///
    /// `stamp` is that of the message, the time of the first range. If the time increment is negative, the last range was fired
    /// first: the stamp of the result is earlier by `stamped_after`. `no_return_range_m` is the range that means no return.
    pub fn project(&mut self, stamp: Stamp, planar: PlanarScan, no_return_range_m: Option<f32>) -> LidarScan {
        self.prepare(&planar);
        let step_s = time_increment_s(&planar);
        let limits = RangeLimits::new(planar.range_min_m, planar.range_max_m, no_return_range_m);
        let mut returns = Vec::with_capacity(planar.ranges_m.len());
        for (k, (range, (cos, sin))) in planar.ranges_m.iter().zip(&self.directions).enumerate() {
            if limits.is_return(*range) {
                let r = f64::from(*range);
                returns.push(LidarReturn {
                    offset: Span::from_seconds(k as f64 * step_s),
                    point_in_laser: nalgebra::Vector3::new((r * cos) as f32, (r * sin) as f32, 0.0),
                    intensity: planar.intensities.get(k).copied().unwrap_or(0.0),
                });
            }
        }
        let stamped_after = if step_s < 0.0 { sort_by_firing_time(&mut returns) } else { Span::ZERO };
        LidarScan { stamp: stamp - stamped_after, stamped_after, returns, planar: Some(planar) }
    }

    fn prepare(&mut self, planar: &PlanarScan) {
        let same = self.angle_min_rad == planar.angle_min_rad && self.angle_increment_rad == planar.angle_increment_rad;
        if !same {
            self.directions.clear();
            (self.angle_min_rad, self.angle_increment_rad) = (planar.angle_min_rad, planar.angle_increment_rad);
        }
        for k in self.directions.len()..planar.ranges_m.len() {
            let (sin, cos) = (self.angle_min_rad + k as f64 * self.angle_increment_rad).sin_cos();
            self.directions.push((cos, sin));
        }
    }
}

/// Sorts returns by firing time.
///
/// The result is how long before the message's stamp the first beam was fired, or zero.
///
/// If it was fired before the stamp, times are relative to it afterwards.
pub fn sort_by_firing_time(returns: &mut [LidarReturn]) -> Span {
    if !returns.is_sorted_by_key(|r| r.offset) {
        returns.sort_by_key(|r| r.offset);
    }
    let first = returns.first().map_or(Span::ZERO, |r| r.offset).min(Span::ZERO);
    if first < Span::ZERO {
        for r in &mut *returns {
            r.offset = r.offset - first;
        }
    }
    Span::ZERO - first
}
