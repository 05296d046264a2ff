//! Quantises the points of the view: 16 bits a coordinate and time, 8 bits a colour.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use zsim_base::geometry::Vector;

/// Code of a quantity that is not known.
const UNKNOWN: u8 = 255;
/// Largest code of a known quantity.
const MAX_CODE: f64 = 254.0;
/// Fraction of the points with the smallest and the largest values, beyond the colour scale.
const TAIL: f64 = 0.01;

/// A point of the cloud with the quantities that can colour it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewPoint {
    /// Position, m.
    pub position: Vector,
    /// Time, s.
    pub t_s: f64,
    /// Intensity of the return, in the unit of the lidar.
    pub intensity: f64,
    /// Angular velocity of the head, degrees/s.
    pub turn_rate_deg_per_s: f64,
    /// Estimated standard deviation of the position, m; NaN if it is not known.
    pub sigma_m: f64,
    /// Signed distance from the nearest true surface, positive towards the lidar, m; NaN if it is not known.
    pub error_m: f64,
    /// Index of the material of the nearest true surface.
    pub material: Option<usize>,
}

/// The points as arrays of codes, with the ranges that decode them.
pub(super) fn cloud(points: &[ViewPoint]) -> Value {
    let (lower, upper) = bounds(points);
    let duration_s = points.iter().map(|point| point.t_s).fold(0.0, f64::max).max(1e-9);
    let positions = positions(points.iter().map(|point| point.position), lower, upper);
    let times = times(points.iter().map(|point| point.t_s), duration_s);
    let materials: Vec<u8> = points.iter().map(|point| material_code(point.material)).collect();
    json!({
        "count": points.len(),
        "lower": [lower.x, lower.y, lower.z],
        "upper": [upper.x, upper.y, upper.z],
        "duration": duration_s,
        "position": STANDARD.encode(&positions),
        "time": STANDARD.encode(&times),
        "material": STANDARD.encode(&materials),
        "channels": {
            "intensity": channel(points, |point| point.intensity, Scale::Spread),
            "turn_rate": channel(points, |point| point.turn_rate_deg_per_s, Scale::FromZero),
            "sigma": channel(points, |point| point.sigma_m, Scale::FromZero),
            "error": channel(points, |point| point.error_m, Scale::Symmetric),
        },
    })
}

/// Codes of positions between two corners: x, y, z in 16 bits each, little-endian.
pub(super) fn positions(points: impl Iterator<Item = Vector>, lower: Vector, upper: Vector) -> Vec<u8> {
    let coordinate = move |x: f64, k: usize| code16(x, (lower[k], upper[k])).to_le_bytes();
    points.flat_map(|point| (0..3).flat_map(move |k| coordinate(point[k], k))).collect()
}

/// Codes of times from 0 to `duration_s`: 16 bits each, little-endian.
pub(super) fn times(times_s: impl Iterator<Item = f64>, duration_s: f64) -> Vec<u8> {
    times_s.flat_map(|t_s| code16(t_s, (0.0, duration_s)).to_le_bytes()).collect()
}

/// Lower and upper corner of the points, with at least 1 mm between them.
fn bounds(points: &[ViewPoint]) -> (Vector, Vector) {
    let first = points.first().map_or(Vector::zeros(), |point| point.position);
    let corners = points
        .iter()
        .fold((first, first), |(lower, upper), point| (lower.inf(&point.position), upper.sup(&point.position)));
    (corners.0, corners.1.sup(&corners.0.add_scalar(1e-3)))
}

/// Position of `value` in the range, 0 to 65535.
fn code16(value: f64, (lower, upper): (f64, f64)) -> u16 {
    ((value - lower) / (upper - lower) * 65535.0).round().clamp(0.0, 65535.0) as u16
}

fn material_code(material: Option<usize>) -> u8 {
    material.and_then(|index| u8::try_from(index).ok()).unwrap_or(UNKNOWN)
}

/// Range of a colour scale.
#[derive(Clone, Copy)]
enum Scale {
    /// From the small to the large values.
    Spread,
    /// From zero to the large values.
    FromZero,
    /// Zero in the middle.
    Symmetric,
}

/// A quantity of the points in 8 bits; `null` if it is not known for any point.
fn channel(points: &[ViewPoint], quantity: fn(&ViewPoint) -> f64, scale: Scale) -> Value {
    let mut known: Vec<f64> = points.iter().map(quantity).filter(|value| value.is_finite()).collect();
    if let Scale::Symmetric = scale {
        known.iter_mut().for_each(|value| *value = value.abs());
    }
    known.sort_unstable_by(f64::total_cmp);
    let Some(last) = known.len().checked_sub(1) else { return Value::Null };
    let at = |fraction: f64| known[(fraction * last as f64).round() as usize];
    let high = at(1.0 - TAIL);
    let (lower, upper) = match scale {
        Scale::Spread => (at(TAIL), high),
        Scale::FromZero => (0.0, high),
        Scale::Symmetric => (-high, high),
    };
    let upper = if upper > lower { upper } else { lower + 1e-9 };
    let code = |value: f64| match value.is_finite() {
        true => ((value - lower) / (upper - lower) * MAX_CODE).round().clamp(0.0, MAX_CODE) as u8,
        false => UNKNOWN,
    };
    let codes: Vec<u8> = points.iter().map(|point| code(quantity(point))).collect();
    json!({ "lower": lower, "upper": upper, "codes": STANDARD.encode(codes) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;

    fn point(x: f64, error_m: f64) -> ViewPoint {
        let position = Vector::new(x, 0.0, 0.0);
        let (turn_rate_deg_per_s, sigma_m) = (0.0, f64::NAN);
        ViewPoint { position, t_s: x, intensity: 1.0, turn_rate_deg_per_s, sigma_m, error_m, material: None }
    }

    fn bytes(value: &Value) -> Vec<u8> {
        STANDARD.decode(value.as_str().unwrap()).unwrap()
    }

    #[test]
    fn coordinates_decode_to_half_a_step() {
        // A range of 20 m in 65535 steps: the largest rounding error is 20/65535/2 = 0.153 mm.
        let points: Vec<ViewPoint> = (0..=1000).map(|k| point(0.02 * f64::from(k), 0.0)).collect();
        let value = cloud(&points);
        let codes = bytes(&value["position"]);
        for (point, code) in points.iter().zip(codes.chunks(6)) {
            let x = f64::from(u16::from_le_bytes([code[0], code[1]])) / 65535.0 * 20.0;
            assert!((x - point.position.x).abs() <= 20.0 / 65535.0 / 2.0 + 1e-9);
        }
    }

    #[test]
    fn unknown_quantities_have_their_own_code() {
        let value = cloud(&[point(0.0, -0.01), point(1.0, f64::NAN), point(2.0, 0.01)]);
        assert_eq!(bytes(&value["channels"]["error"]["codes"]), [0, UNKNOWN, 254]);
        assert!(value["channels"]["sigma"].is_null());
        assert_eq!(bytes(&value["material"]), [UNKNOWN; 3]);
        assert_eq!(cloud(&[])["count"], 0);
    }
}
