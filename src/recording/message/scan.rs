//! `sensor_msgs/LaserScan`: one sweep in a plane (REP-103, REP-117).

use crate::measurement::{LidarReturn, LidarScan, PlanarScan};
use crate::recording::RecordingError;
use crate::recording::wire::{DecodeError, Decoder, Encoder, Payload};
use crate::time::{Span, Stamp};

/// Writes a sweep of the lidar in `frame` that began at `stamp`.
///
/// # Errors
/// When the stamp or the number of beams does not fit a message.
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

/// Reads the polar form of a sweep: its stamp, and the sweep.
///
/// # Errors
/// When the bytes are not a `LaserScan`, or its angles or times are not finite.
pub fn decode(message: Payload<'_>) -> Result<(Stamp, PlanarScan), DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    let [angle_min_rad, _, angle_increment_rad, time_increment_s, scan_time_s] = [
        f64::from(input.f32()?),
        f64::from(input.f32()?),
        f64::from(input.f32()?),
        f64::from(input.f32()?),
        f64::from(input.f32()?),
    ];
    let (range_min_m, range_max_m) = (input.f32()?, input.f32()?);
    let ranges_m = input.f32_sequence()?;
    let intensities = input.f32_sequence()?;
    if ![angle_min_rad, angle_increment_rad, time_increment_s, scan_time_s].iter().all(|x| x.is_finite()) {
        return Err(DecodeError::Contradiction("a scan's angles or times are not finite"));
    }
    if !intensities.is_empty() && intensities.len() != ranges_m.len() {
        return Err(DecodeError::Contradiction("a scan has another number of intensities than of ranges"));
    }
    let planar = PlanarScan {
        angle_min_rad,
        angle_increment_rad,
        time_increment_s,
        scan_time_s,
        range_min_m,
        range_max_m,
        ranges_m,
        intensities,
    };
    Ok((stamp, planar))
}

/// Time between beams, s: as the sweep says, or, where it says nothing, what its angles and its period imply for a
/// mirror that turns evenly.
pub fn time_increment_s(scan: &PlanarScan) -> f64 {
    if scan.time_increment_s != 0.0 {
        return scan.time_increment_s;
    }
    scan.scan_time_s * scan.angle_increment_rad.abs() / std::f64::consts::TAU
}

/// Turns sweeps to points; keeps the beams' directions from sweep to sweep.
#[derive(Debug, Default)]
pub struct Projector {
    angle_min_rad: f64,
    angle_increment_rad: f64,
    directions: Vec<(f64, f64)>,
}

impl Projector {
    /// The scan of a sweep that began at `stamp`: the beams that came back as points, in the order in which they were
    /// fired.
    pub fn project(&mut self, stamp: Stamp, planar: PlanarScan) -> LidarScan {
        self.prepare(&planar);
        let step_s = time_increment_s(&planar);
        let mut returns = Vec::with_capacity(planar.ranges_m.len());
        for (k, (range, (cos, sin))) in planar.ranges_m.iter().zip(&self.directions).enumerate() {
            // REP-117: infinities and NaN are beams without a return.
            if range.is_finite() && (planar.range_min_m..=planar.range_max_m).contains(range) {
                let r = f64::from(*range);
                returns.push(LidarReturn {
                    offset: Span::from_seconds(k as f64 * step_s),
                    point_in_laser: nalgebra::Vector3::new((r * cos) as f32, (r * sin) as f32, 0.0),
                    intensity: planar.intensities.get(k).copied().unwrap_or(0.0),
                });
            }
        }
        let stamped_after = if step_s < 0.0 { from_earliest(&mut returns) } else { Span::ZERO };
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

/// Puts returns in the order in which they were fired, offsets counted from the earliest where that was fired before
/// the message's stamp: by how much before, or zero.
pub fn from_earliest(returns: &mut [LidarReturn]) -> Span {
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
