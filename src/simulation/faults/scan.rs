//! Faults of lidar ranges.

use super::stage::{Message, Stage};
use super::{FaultKind, MissEncoding};
use zsim_base::measurement::{LidarReturn, LidarScan, Measurement, PlanarScan};
use zsim_base::time::Span;

/// Difference of the encoding `above_max` from the maximum range, m.
const ABOVE_MAX_M: f32 = 1.0;

/// The stage of a fault of this group; `None` for other groups.
pub(super) fn stage(kind: &FaultKind) -> Option<Box<dyn Stage>> {
    Some(match kind {
        FaultKind::ConstantRange { range_m } => Box::new(ConstantRange { range_m: *range_m }),
        FaultKind::Misses { encoding } => Box::new(Misses { encoding: *encoding }),
        _ => return None,
    })
}

/// Sets all ranges to one value; for a planar lidar also those of beams without a return.
struct ConstantRange {
    range_m: f64,
}

impl ConstantRange {
    fn apply(&self, scan: &mut LidarScan) {
        match &mut scan.planar {
            Some(planar) => {
                planar.ranges_m.fill(self.range_m as f32);
                scan.returns = (0..planar.ranges_m.len()).map(|beam| self.beam(planar, beam)).collect();
            }
            None => {
                for beam in &mut scan.returns {
                    let length = f64::from(beam.point_in_laser.norm());
                    if length > 0.0 {
                        beam.point_in_laser *= (self.range_m / length) as f32;
                    }
                }
            }
        }
    }

    fn beam(&self, planar: &PlanarScan, beam: usize) -> LidarReturn {
        let (sin, cos) = (planar.angle_min_rad + beam as f64 * planar.angle_increment_rad).sin_cos();
        LidarReturn {
            offset: Span::from_seconds(beam as f64 * planar.time_increment_s),
            point_in_laser: nalgebra::Vector3::new((self.range_m * cos) as f32, (self.range_m * sin) as f32, 0.0),
            intensity: planar.intensities.get(beam).copied().unwrap_or(0.0),
        }
    }
}

impl Stage for ConstantRange {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        if let Measurement::Lidar(scan) = &mut message.measurement {
            self.apply(scan);
        }
        out.push(message);
    }
}

/// Changes the encoding of beams without a return.
struct Misses {
    encoding: MissEncoding,
}

impl Stage for Misses {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        if let Measurement::Lidar(LidarScan { planar: Some(planar), .. }) = &mut message.measurement {
            let encoded = match self.encoding {
                MissEncoding::RangeMax => planar.range_max_m,
                MissEncoding::AboveMax => planar.range_max_m + ABOVE_MAX_M,
                MissEncoding::Zero => 0.0,
                MissEncoding::Nan => f32::NAN,
                MissEncoding::Inf => f32::INFINITY,
                MissEncoding::MinusInf => f32::NEG_INFINITY,
            };
            planar.ranges_m.iter_mut().filter(|range| **range == f32::INFINITY).for_each(|range| *range = encoded);
        }
        out.push(message);
    }
}
