//! Scanning geometry of the lidar, and adaptation of the settings to it.

use super::EstimatorSpec;
use super::spec::SurfelSpec;
use zsim_base::geometry::Vector;
use zsim_base::measurement::LidarScan;

/// Point rate from which on the minimum number of points of a surfel is as specified, points/s; lower in proportion for
/// a sparser lidar.
const DENSE_PER_S: f64 = 28_000.0;
/// Point rate up to which the minimum number of points of a surfel of the registration is as specified, points/s; higher in
/// proportion for a denser lidar. That of a UTM-30LX; surfels of few points of a denser one are slivers of a surface.
const REGISTERED_PER_S: f64 = 43_000.0;
/// Lower limit of the minimum number of points for a sparse lidar.
const SPARSE_MIN_POINTS: usize = 8;
/// Surfels of a planar lidar combine successive scans: minimum of `split_gap_s` and of `max_duration_s`, in scan periods.
const PERIODS: (f64, f64) = (1.2, 2.5);
/// Sine of the elevation above which a point is not from a planar lidar.
const OUT_OF_PLANE: f32 = 0.01;
/// Length of the mean beam direction above which a lidar looks in one direction only: 0.91 for a cone with a half angle
/// of 35 degrees, 0.64 for half a plane.
const ONE_DIRECTION_THRESHOLD: f64 = 0.8;

/// Scanning geometry, measured from the first scans.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ScanGeometry {
    /// Returns per second.
    points_per_s: f64,
    /// Length of the mean beam direction, 0..1.
    one_sidedness: f64,
    /// Scan period of a planar lidar, s.
    planar_period_s: Option<f64>,
}

impl ScanGeometry {
    /// Measures the geometry from scans over `seconds`, one every `period_s`.
    pub(super) fn measure<'a>(scans: impl Iterator<Item = &'a LidarScan>, seconds: f64, period_s: f64) -> Self {
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

    /// Whether the lidar looks in one direction only; a range bias is then equivalent to a translation.
    pub(super) fn is_one_way(self) -> bool {
        self.one_sidedness > ONE_DIRECTION_THRESHOLD
    }

    /// Adapts the settings: fewer points per surfel for a sparse lidar, more per surfel of the registration for a dense
    /// one, longer surfels for a slow one.
    pub(super) fn adapt(self, spec: &EstimatorSpec) -> EstimatorSpec {
        let mut adapted = spec.clone();
        let ratio = if self.points_per_s > 0.0 { (self.points_per_s / DENSE_PER_S).min(1.0) } else { 1.0 };
        let fewer = |points: usize| ((points as f64 * ratio).round() as usize).max(SPARSE_MIN_POINTS.min(points));
        let SurfelSpec { min_points, range_offset_sigma_m, split_gap_s, max_duration_s, .. } = &mut adapted.surfels;
        *min_points = fewer(*min_points);
        if let Some(period_s) = self.planar_period_s {
            *split_gap_s = split_gap_s.max(PERIODS.0 * period_s);
            *max_duration_s = max_duration_s.max(PERIODS.1 * period_s);
        }
        let times_denser = (self.points_per_s / REGISTERED_PER_S).max(1.0);
        adapted.registration.min_points = (spec.registration.min_points as f64 * times_denser).round() as usize;
        if self.is_one_way() {
            *range_offset_sigma_m = 0.0;
        }
        adapted
    }
}

/// Whether a point is in the scan plane of a planar lidar.
pub(super) fn is_in_plane(point_in_laser: &nalgebra::Vector3<f32>) -> bool {
    point_in_laser.z.abs() <= OUT_OF_PLANE * point_in_laser.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;
    use zsim_base::measurement::LidarReturn;
    use zsim_base::time::{Span, Stamp};

    /// A scan with beams at `azimuths` and `elevation`, rad.
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
    fn the_mean_direction_of_a_fan_has_the_analytic_length() {
        for half_deg in [20.0_f64, 90.0, 135.0] {
            let half = half_deg.to_radians();
            let geometry = ScanGeometry::measure([fan(half_deg, 20_001)].iter(), 1.0, 0.025);
            assert!((geometry.one_sidedness - half.sin().abs() / half).abs() < 1e-3, "{half_deg}: {geometry:?}");
        }
        assert!(ScanGeometry::measure([fan(20.0, 500)].iter(), 1.0, 0.025).is_one_way());
        assert!(!ScanGeometry::measure([fan(90.0, 500)].iter(), 1.0, 0.025).is_one_way());
    }

    #[test]
    fn the_minimum_number_of_points_follows_the_density() {
        let spec = load("default").unwrap();
        let dense: Vec<LidarScan> = (0..40).map(|_| fan(135.0, 1081)).collect();
        assert_eq!(ScanGeometry::measure(dense.iter(), 1.0, 0.025).adapt(&spec), spec);
        let sparse: Vec<LidarScan> = (0..40).map(|_| fan(135.0, 350)).collect();
        assert_eq!(
            ScanGeometry::measure(sparse.iter(), 1.0, 0.025).adapt(&spec).surfels.min_points,
            spec.surfels.min_points / 2
        );
        let poor = ScanGeometry::measure([fan(135.0, 100)].iter(), 1.0, 0.025).adapt(&spec);
        assert_eq!(poor.surfels.min_points, SPARSE_MIN_POINTS);
        let points = |beams: usize| {
            let scans: Vec<LidarScan> = (0..40).map(|_| fan(135.0, beams)).collect();
            ScanGeometry::measure(scans.iter(), 1.0, 0.025).adapt(&spec).registration.min_points
        };
        let specified = spec.registration.min_points;
        assert_eq!([350, 1081, 3225].map(points), [specified, specified, 3 * specified]);
        // A lower specified number is not increased.
        let mut few = spec;
        few.surfels.min_points = 5;
        assert_eq!(ScanGeometry::measure([fan(135.0, 100)].iter(), 1.0, 0.025).adapt(&few).surfels.min_points, 5);
    }

    #[test]
    fn surfels_of_a_slow_planar_lidar_combine_successive_scans() {
        let spec = load("default").unwrap();
        let at = |period_s: f64, elevation: f64| {
            let scans = [scan((0..2000).map(|k| k as f64 * 0.003), elevation), fan(180.0, 2000)];
            ScanGeometry::measure(scans.iter(), 0.1, period_s).adapt(&spec).surfels
        };
        assert!(at(0.1, 0.0).split_gap_s > 0.11 && at(0.2, 0.0).max_duration_s > 0.4);
        assert_eq!(at(0.025, 0.0), spec.surfels);
        assert_eq!(at(0.1, 0.2), spec.surfels, "a multi-beam lidar measures a surfel in one rotation");
    }

    #[test]
    fn scans_without_returns_change_no_setting() {
        let empty = ScanGeometry::measure([scan(std::iter::empty(), 0.0)].iter(), 1.0, 0.025);
        assert_eq!(empty, ScanGeometry::default());
        assert!(!empty.is_one_way());
        let spec = load("default").unwrap();
        assert_eq!(empty.adapt(&spec), spec);
    }
}
