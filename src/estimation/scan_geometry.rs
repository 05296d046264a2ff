//! How a lidar looks about, and what settings fit it.

use super::EstimatorSpec;
use super::spec::SurfelSpec;
use crate::geometry::Vector;
use crate::measurement::LidarScan;

/// Points a second from which on patches hold the number of points that the settings ask for; of fewer, fewer.
const DENSE_PER_S: f64 = 28_000.0;
/// Fewest points of a patch of a sparse lidar.
const FEWEST_POINTS: usize = 8;
/// Of a planar lidar a patch is swept by successive scans: it may be of such as are so many periods from each other,
/// and last for so many.
const PERIODS: (f64, f64) = (1.2, 2.5);
/// A point whose direction leaves the x-y plane by more than this sine is of no planar lidar.
const OUT_OF_PLANE: f32 = 0.01;
/// A lidar looks one way when the mean of its beams' directions is longer: that of a cone of 35 degrees to either side
/// is 0.91, of half a plane 0.64.
const ONE_WAY: f64 = 0.8;

/// What the first scans show of the lidar.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ScanGeometry {
    /// Beams that came back, a second.
    points_per_s: f64,
    /// Length of the mean of their directions, 0..1.
    one_sidedness: f64,
    /// From scan to scan of a planar lidar, s.
    planar_period_s: Option<f64>,
}

impl ScanGeometry {
    /// Of scans that took `seconds`, one every `period_s`.
    pub(super) fn of<'a>(scans: impl Iterator<Item = &'a LidarScan>, seconds: f64, period_s: f64) -> Self {
        let (mut sum, mut count, mut planar) = (Vector::zeros(), 0.0, true);
        for hit in scans.flat_map(|scan| &scan.returns) {
            sum += hit.point_in_laser.cast::<f64>().try_normalize(0.0).unwrap_or_default();
            count += 1.0;
            planar &= is_in_plane(&hit.point_in_laser);
        }
        if count == 0.0 {
            return Self::default();
        }
        let planar_period_s = planar.then_some(period_s);
        Self { points_per_s: count / seconds, one_sidedness: sum.norm() / count, planar_period_s }
    }

    /// Whether it looks one way: an offset of its ranges then cannot be told from a shift of what it sees.
    pub(super) fn is_one_way(self) -> bool {
        self.one_sidedness > ONE_WAY
    }

    /// The settings that fit it: a sparse lidar sweeps fewer points onto a patch, and a slow one takes longer.
    pub(super) fn fit(self, spec: &EstimatorSpec) -> EstimatorSpec {
        let mut fitting = spec.clone();
        let share = if self.points_per_s > 0.0 { (self.points_per_s / DENSE_PER_S).min(1.0) } else { 1.0 };
        let fewer = |points: usize| ((points as f64 * share).round() as usize).max(FEWEST_POINTS.min(points));
        let SurfelSpec { min_points, range_offset_sigma_m, split_gap_s, max_duration_s, .. } = &mut fitting.surfels;
        *min_points = fewer(*min_points);
        if let Some(period_s) = self.planar_period_s {
            *split_gap_s = split_gap_s.max(PERIODS.0 * period_s);
            *max_duration_s = max_duration_s.max(PERIODS.1 * period_s);
        }
        fitting.registration.min_points = fewer(fitting.registration.min_points);
        if self.is_one_way() {
            *range_offset_sigma_m = 0.0;
        }
        fitting
    }
}

/// Whether a point may be of a planar lidar.
pub(super) fn is_in_plane(point_in_laser: &nalgebra::Vector3<f32>) -> bool {
    point_in_laser.z.abs() <= OUT_OF_PLANE * point_in_laser.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::load;
    use crate::measurement::LidarReturn;
    use crate::time::{Span, Stamp};

    /// A turn of beams at `azimuths` in the x-y plane, tilted up to `elevations`, all in radians.
    fn scan(azimuths: impl Iterator<Item = f64>, elevation: f64) -> LidarScan {
        let beam = |azimuth: f64| {
            let (sin, cos) = azimuth.sin_cos();
            let direction = nalgebra::Vector3::new(cos * elevation.cos(), sin * elevation.cos(), elevation.sin());
            LidarReturn { offset: Span::ZERO, point_in_laser: (direction * 3.0).cast(), intensity: 0.0 }
        };
        let returns = azimuths.map(beam).collect();
        LidarScan { stamp: Stamp::from_nanos(0), stamped_after: Span::ZERO, returns, planar: None }
    }

    fn fan(half_deg: f64, beams: usize) -> LidarScan {
        let step = 2.0 * half_deg.to_radians() / (beams - 1) as f64;
        scan((0..beams).map(move |k| k as f64 * step - half_deg.to_radians()), 0.0)
    }

    /// The mean of directions in a fan of half angle `a` has the length `sin a / a`.
    #[test]
    fn a_fan_is_one_sided_by_the_sine_of_its_half_angle_over_it() {
        for half_deg in [20.0_f64, 90.0, 135.0] {
            let half = half_deg.to_radians();
            let sight = ScanGeometry::of([fan(half_deg, 20_001)].iter(), 1.0, 0.025);
            assert!((sight.one_sidedness - half.sin().abs() / half).abs() < 1e-3, "{half_deg}: {sight:?}");
        }
        assert!(ScanGeometry::of([fan(20.0, 500)].iter(), 1.0, 0.025).is_one_way());
        assert!(!ScanGeometry::of([fan(90.0, 500)].iter(), 1.0, 0.025).is_one_way());
    }

    #[test]
    fn a_dense_lidar_changes_nothing_and_a_sparse_one_asks_for_fewer_points() {
        let spec = load("default").unwrap();
        let dense: Vec<LidarScan> = (0..40).map(|_| fan(135.0, 1081)).collect();
        assert_eq!(ScanGeometry::of(dense.iter(), 1.0, 0.025).fit(&spec), spec);
        let sparse: Vec<LidarScan> = (0..40).map(|_| fan(135.0, 350)).collect();
        assert_eq!(
            ScanGeometry::of(sparse.iter(), 1.0, 0.025).fit(&spec).surfels.min_points,
            spec.surfels.min_points / 2
        );
        let poor = ScanGeometry::of([fan(135.0, 100)].iter(), 1.0, 0.025).fit(&spec);
        assert_eq!(poor.surfels.min_points, FEWEST_POINTS);
        // Asked for fewer still, it has its way.
        let mut few = spec;
        few.surfels.min_points = 5;
        assert_eq!(ScanGeometry::of([fan(135.0, 100)].iter(), 1.0, 0.025).fit(&few).surfels.min_points, 5);
    }

    #[test]
    fn patches_of_a_slow_planar_lidar_may_be_of_successive_scans() {
        let spec = load("default").unwrap();
        let at = |period_s: f64, elevation: f64| {
            let scans = [scan((0..2000).map(|k| k as f64 * 0.003), elevation), fan(180.0, 2000)];
            ScanGeometry::of(scans.iter(), 0.1, period_s).fit(&spec).surfels
        };
        assert!(at(0.1, 0.0).split_gap_s > 0.11 && at(0.2, 0.0).max_duration_s > 0.4);
        assert_eq!(at(0.025, 0.0), spec.surfels);
        assert_eq!(at(0.1, 0.2), spec.surfels, "a lidar of several beams sees a patch in one turn");
    }

    #[test]
    fn of_nothing_seen_nothing_is_said() {
        let nothing = ScanGeometry::of([scan(std::iter::empty(), 0.0)].iter(), 1.0, 0.025);
        assert_eq!(nothing, ScanGeometry::default());
        assert!(!nothing.is_one_way());
        let spec = load("default").unwrap();
        assert_eq!(nothing.fit(&spec), spec);
    }
}
