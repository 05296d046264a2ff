//! Detection of mixed pixels: a beam split by an edge can return a range between the two surfaces (Tuley, Vandapel and
//! Hebert, ICRA 2005).
//!
//! The range of a mixed pixel is between those of the two neighbours and differs from both by many standard deviations. The
//! same holds on a surface at grazing incidence; but there `1 / r` is linear in the (small) angle between beams, so two
//! neighbours on one side predict the range.

use super::ProjectedReturn;
use zsim_base::geometry::Vector;
use zsim_base::measurement::LidarNoise;

/// Maximum angle between neighbouring beams, rad.
const MAX_NEIGHBOUR_RAD: f64 = 0.02;
/// Minimum range difference of a mixed pixel to both neighbours, in standard deviations of the difference.
const GAP_SIGMAS: f64 = 5.0;
/// Maximum deviation from the line through two neighbours, in standard deviations of the prediction.
const LINE_SIGMAS: f64 = 3.0;

/// A return by angle and range.
struct PolarReturn {
    /// Cumulative angle between successive beams, rad.
    angle: f64,
    range_m: f64,
    sigma_m: f64,
}

/// Flags the mixed pixels of a scan; `hits` are in order of emission.
pub(super) fn find_mixed(hits: &[ProjectedReturn], noise: &LidarNoise) -> Vec<bool> {
    let mut beams: Vec<PolarReturn> = Vec::with_capacity(hits.len());
    let mut before: Option<Vector> = None;
    for hit in hits {
        let ray = hit.point_in_map - hit.origin_in_map;
        let range_m = ray.norm();
        let direction = ray.try_normalize(0.0).unwrap_or_default();
        // For small angles the chord equals the arc.
        let step = before.map_or(0.0, |before| (direction - before).norm());
        let angle = beams.last().map_or(0.0, |last| last.angle) + step;
        beams.push(PolarReturn { angle, range_m, sigma_m: noise.sigma_m(range_m) });
        before = Some(direction);
    }
    (0..beams.len()).map(|k| is_mixed(&beams, k)).collect()
}

fn is_mixed(beams: &[PolarReturn], k: usize) -> bool {
    let beam = &beams[k];
    let neighbour = |other: Option<usize>| {
        let other = beams.get(other?)?;
        ((other.angle - beam.angle).abs() < MAX_NEIGHBOUR_RAD).then_some(other)
    };
    let (Some(before), Some(after)) = (neighbour(k.checked_sub(1)), neighbour(k.checked_add(1))) else { return false };
    let normalised_difference = |other: &PolarReturn| {
        let sigma_m = beam.sigma_m.hypot(other.sigma_m);
        (beam.range_m - other.range_m) / sigma_m
    };
    let (from_before, from_after) = (normalised_difference(before), normalised_difference(after));
    let is_between = from_before * from_after < 0.0 && from_before.abs().min(from_after.abs()) > GAP_SIGMAS;
    let predicted = |one: &PolarReturn, two: Option<&PolarReturn>| two.is_some_and(|two| is_on_line(beam, one, two));
    is_between && !predicted(before, neighbour(k.checked_sub(2))) && !predicted(after, neighbour(k.checked_add(2)))
}

/// Whether a return is on the line through two others, the nearer neighbour first.
fn is_on_line(beam: &PolarReturn, one: &PolarReturn, two: &PolarReturn) -> bool {
    let step = one.angle - two.angle;
    if step == 0.0 {
        return false;
    }
    let steps = (beam.angle - one.angle) / step;
    let inverse = |beam: &PolarReturn| (1.0 / beam.range_m, beam.sigma_m / (beam.range_m * beam.range_m));
    let ((d0, s0), (d1, s1), (d2, s2)) = (inverse(beam), inverse(one), inverse(two));
    let predicted = d1 + (d1 - d2) * steps;
    let variance = s0 * s0 + (s1 * (1.0 + steps)).powi(2) + (s2 * steps).powi(2);
    (d0 - predicted).abs() <= LINE_SIGMAS * variance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Stamp;

    const NOISE: LidarNoise = LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 };

    /// Indices of the mixed pixels in a scan with beams 0.25 degrees apart.
    fn mixed(ranges_m: &[f64]) -> Vec<usize> {
        let hit = |(k, range_m): (usize, &f64)| {
            let angle = 0.25_f64.to_radians() * k as f64;
            let point_in_map = Vector::new(angle.cos(), angle.sin(), 0.0) * *range_m;
            ProjectedReturn { stamp: Stamp::default(), point_in_map, origin_in_map: Vector::zeros() }
        };
        let hits: Vec<ProjectedReturn> = ranges_m.iter().enumerate().map(hit).collect();
        let flags = find_mixed(&hits, &NOISE);
        flags.iter().enumerate().filter(|(_, mixed)| **mixed).map(|(k, _)| k).collect()
    }

    #[test]
    fn return_between_two_surfaces_at_an_edge_is_mixed() {
        assert_eq!(mixed(&[2.0, 2.0, 2.0, 2.6, 4.0, 4.0, 4.0]), [3]);
        assert_eq!(mixed(&[4.0, 4.0, 3.1, 2.0, 2.0]), [2]);
        assert_eq!(mixed(&[2.0, 2.0, 2.0, 4.0, 4.0, 4.0]), [0; 0], "a clean edge has no mixed pixel");
        assert_eq!(mixed(&[2.0, 2.0, 2.03, 2.05, 2.05]), [0; 0], "noise is not a mixed pixel");
    }

    #[test]
    fn floor_at_grazing_incidence_has_no_mixed_pixels() {
        // A floor 1.2 m below, scanned from 9 degrees below the horizon upwards in steps of 0.25 degrees: successive
        // ranges differ by up to 2 m.
        let at = |k: usize| 1.2 / (9.0 - 0.25 * k as f64).to_radians().sin();
        let ranges: Vec<f64> = (0..24).map(at).collect();
        assert!(ranges[23] - ranges[22] > 1.5);
        assert_eq!(mixed(&ranges), [0; 0]);
        // The same floor up to a wall.
        let with_wall: Vec<f64> = ranges.iter().map(|r| r.min(14.0)).collect();
        assert_eq!(mixed(&with_wall), [0; 0]);
    }

    #[test]
    fn beams_at_large_angles_are_not_neighbours() {
        let hit = |point: [f64; 3]| ProjectedReturn {
            stamp: Stamp::default(),
            point_in_map: point.into(),
            origin_in_map: Vector::zeros(),
        };
        let distant = [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [-4.0, 0.0, 0.0]].map(hit);
        assert_eq!(find_mixed(&distant, &NOISE), [false; 3]);
        assert!(find_mixed(&[], &NOISE).is_empty());
    }
}
