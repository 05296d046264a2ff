//! Echoes of two surfaces at once: a beam that is split by an edge may answer from in between (Tuley, Vandapel and
//! Hebert, ICRA 2005).
//!
//! Such an echo lies between its neighbours in range, far from both. So does one on a surface that is seen at a grazing
//! angle; but along a line, `1 / r` is linear in the angle as long as that is small, and two neighbours on one side
//! foretell it.

use super::Hit;
use crate::geometry::Vector;
use crate::measurement::LidarNoise;

/// Beams farther from each other than this are no neighbours, rad.
const NEIGHBOURS_RAD: f64 = 0.02;
/// A mixed echo is farther than this from both its neighbours, in standard deviations of a difference of two ranges.
const GAP_SIGMAS: f64 = 5.0;
/// An echo is on its neighbours' line within so many standard deviations.
const LINE_SIGMAS: f64 = 3.0;

/// A beam of a scan.
struct Beam {
    /// Sum of the angles between beams up to it, rad.
    angle: f64,
    range_m: f64,
    sigma_m: f64,
}

/// Which echoes of a scan, in the order in which they were fired, are mixed.
pub(super) fn in_scan(hits: &[Hit], noise: &LidarNoise) -> Vec<bool> {
    let mut beams: Vec<Beam> = Vec::with_capacity(hits.len());
    let mut before: Option<Vector> = None;
    for hit in hits {
        let way = hit.point_in_map - hit.origin_in_map;
        let range_m = way.norm();
        let direction = way.try_normalize(0.0).unwrap_or_default();
        // Of small angles the chord is the arc.
        let step = before.map_or(0.0, |before| (direction - before).norm());
        let angle = beams.last().map_or(0.0, |last| last.angle) + step;
        beams.push(Beam { angle, range_m, sigma_m: noise.sigma_m(range_m) });
        before = Some(direction);
    }
    (0..beams.len()).map(|k| is_mixed(&beams, k)).collect()
}

fn is_mixed(beams: &[Beam], k: usize) -> bool {
    let beam = &beams[k];
    let near = |other: Option<usize>| {
        let other = beams.get(other?)?;
        ((other.angle - beam.angle).abs() < NEIGHBOURS_RAD).then_some(other)
    };
    let (Some(before), Some(after)) = (near(k.checked_sub(1)), near(k.checked_add(1))) else { return false };
    let apart = |other: &Beam| {
        let sigma_m = beam.sigma_m.hypot(other.sigma_m);
        (beam.range_m - other.range_m) / sigma_m
    };
    let (from_before, from_after) = (apart(before), apart(after));
    let is_between = from_before * from_after < 0.0 && from_before.abs().min(from_after.abs()) > GAP_SIGMAS;
    let foretold = |one: &Beam, two: Option<&Beam>| two.is_some_and(|two| is_on_line(beam, one, two));
    is_between && !foretold(before, near(k.checked_sub(2))) && !foretold(after, near(k.checked_add(2)))
}

/// Whether a beam ends on the line through the ends of two others, the nearer neighbour first.
fn is_on_line(beam: &Beam, one: &Beam, two: &Beam) -> bool {
    let step = one.angle - two.angle;
    if step == 0.0 {
        return false;
    }
    let ahead = (beam.angle - one.angle) / step;
    let inverse = |beam: &Beam| (1.0 / beam.range_m, beam.sigma_m / (beam.range_m * beam.range_m));
    let ((d0, s0), (d1, s1), (d2, s2)) = (inverse(beam), inverse(one), inverse(two));
    let foretold = d1 + (d1 - d2) * ahead;
    let variance = s0 * s0 + (s1 * (1.0 + ahead)).powi(2) + (s2 * ahead).powi(2);
    (d0 - foretold).abs() <= LINE_SIGMAS * variance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    const NOISE: LidarNoise = LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 };

    /// A scan of ranges, a quarter of a degree from each other.
    fn mixed(ranges_m: &[f64]) -> Vec<usize> {
        let hit = |(k, range_m): (usize, &f64)| {
            let angle = 0.25_f64.to_radians() * k as f64;
            let point_in_map = Vector::new(angle.cos(), angle.sin(), 0.0) * *range_m;
            Hit { stamp: Stamp::default(), point_in_map, origin_in_map: Vector::zeros() }
        };
        let hits: Vec<Hit> = ranges_m.iter().enumerate().map(hit).collect();
        let told = in_scan(&hits, &NOISE);
        told.iter().enumerate().filter(|(_, mixed)| **mixed).map(|(k, _)| k).collect()
    }

    #[test]
    fn an_echo_in_the_gap_behind_an_edge_is_mixed() {
        assert_eq!(mixed(&[2.0, 2.0, 2.0, 2.6, 4.0, 4.0, 4.0]), [3]);
        assert_eq!(mixed(&[4.0, 4.0, 3.1, 2.0, 2.0]), [2]);
        assert_eq!(mixed(&[2.0, 2.0, 2.0, 4.0, 4.0, 4.0]), [0; 0], "an edge alone is none");
        assert_eq!(mixed(&[2.0, 2.0, 2.03, 2.05, 2.05]), [0; 0], "nor is noise");
    }

    #[test]
    fn a_grazed_floor_is_no_edge_however_far_its_echoes_are_apart() {
        // A floor 1.2 m below, in a scan that goes up from 9 degrees below the level by a quarter of a degree: at the
        // end its echoes are 2 m apart.
        let at = |k: usize| 1.2 / (9.0 - 0.25 * k as f64).to_radians().sin();
        let ranges: Vec<f64> = (0..24).map(at).collect();
        assert!(ranges[23] - ranges[22] > 1.5);
        assert_eq!(mixed(&ranges), [0; 0]);
        // The same up to a wall, and from a box that stands before it.
        let with_wall: Vec<f64> = ranges.iter().map(|r| r.min(14.0)).collect();
        assert_eq!(mixed(&with_wall), [0; 0]);
    }

    #[test]
    fn beams_far_from_each_other_are_no_neighbours() {
        let hit = |point: [f64; 3]| Hit {
            stamp: Stamp::default(),
            point_in_map: point.into(),
            origin_in_map: Vector::zeros(),
        };
        let apart = [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [-4.0, 0.0, 0.0]].map(hit);
        assert_eq!(in_scan(&apart, &NOISE), [false; 3]);
        assert!(in_scan(&[], &NOISE).is_empty());
    }
}
