use rayon::prelude::*;
use zsim_base::geometry::{Surface, Vector};

/// Which points of a cloud are evaluated: a bounded number, spread evenly over it, always the same ones.
///
/// Point `k` is selected when the Weyl sequence `k / phi mod 1` is below the wanted fraction: evenly distributed, and
/// out of step with any period of the scanner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thinning {
    fraction: f64,
}

impl Thinning {
    /// Selects about `limit` of `total` points; all of them if there are no more.
    pub fn to_at_most(limit: usize, total: usize) -> Self {
        Self { fraction: if total <= limit { 1.0 } else { limit as f64 / total as f64 } }
    }

    /// Whether point `index` is evaluated.
    pub fn keeps(&self, index: usize) -> bool {
        const INVERSE_GOLDEN_RATIO: f64 = 0.618_033_988_749_894_8;
        (index as f64 * INVERSE_GOLDEN_RATIO).fract() < self.fraction
    }
}

/// Signed distances of points to the true surfaces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CloudErrors {
    /// Distance to the nearest surface, m: positive on the side of the sensor (a range too short).
    pub signed_m: Vec<f64>,
    /// How many points had no surface within reach.
    pub beyond_reach: usize,
}

/// Distances to the true surfaces in a few numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudSummary {
    /// Mean signed distance, m.
    pub bias_m: f64,
    /// Standard deviation of the signed distance about the mean, m.
    pub sigma_m: f64,
    /// 95 % of the points are no farther from a surface than this, m.
    pub p95_m: f64,
    /// Fraction of the points without a surface within reach; the other numbers exclude them.
    pub beyond_reach: f64,
}

impl CloudErrors {
    /// Computes the distances of points from the nearest surface.
    ///
    /// Each point has the position of the sensor, or `None`: the sign is then that of the surface. Surfaces at more
    /// than `reach_m` are ignored.
    pub fn to_surface(surface: &dyn Surface, seen: &[(Vector, Option<Vector>)], reach_m: f64) -> Self {
        let distance = |(point, from): &(Vector, Option<Vector>)| {
            let nearest = surface.nearest(point, reach_m)?;
            let offset = point - nearest.point_in_world;
            let facing =
                from.map_or(1.0, |from| (from - nearest.point_in_world).dot(&nearest.normal_in_world).signum());
            let side = (offset.dot(&nearest.normal_in_world) * facing).signum();
            Some(offset.norm() * side)
        };
        let distances: Vec<Option<f64>> = seen.par_iter().map(distance).collect();
        let beyond_reach = distances.iter().filter(|distance| distance.is_none()).count();
        Self { signed_m: distances.into_iter().flatten().collect(), beyond_reach }
    }

    /// Summarises the distances; `None` if no point is within reach of a surface.
    pub fn summary(&self) -> Option<CloudSummary> {
        let count = self.signed_m.len();
        if count == 0 {
            return None;
        }
        let bias_m = self.signed_m.iter().sum::<f64>() / count as f64;
        let variance = self.signed_m.iter().map(|d| (d - bias_m).powi(2)).sum::<f64>() / count as f64;
        let mut sizes: Vec<f64> = self.signed_m.iter().map(|d| d.abs()).collect();
        // The least size that no fewer than 95 % of the points stay within (nearest rank).
        let rank = (0.95 * count as f64).ceil() as usize - 1;
        let (_, p95_m, _) = sizes.select_nth_unstable_by(rank, f64::total_cmp);
        let beyond_reach = self.beyond_reach as f64 / (count + self.beyond_reach) as f64;
        Some(CloudSummary { bias_m, sigma_m: variance.sqrt(), p95_m: *p95_m, beyond_reach })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::SurfacePoint;

    /// The floor z = 0, with the normal pointing down.
    struct Floor;

    impl Surface for Floor {
        fn nearest(&self, point: &Vector, reach_m: f64) -> Option<SurfacePoint> {
            let nearest =
                SurfacePoint { point_in_world: Vector::new(point.x, point.y, 0.0), normal_in_world: -Vector::z() };
            (point.z.abs() <= reach_m).then_some(nearest)
        }
    }

    #[test]
    fn known_heights_above_a_floor_are_recovered() {
        // Heights 0.00, 0.01, ..., 0.99 m observed from above: mean 0.495, variance (100^2 - 1)/12 cm^2, p95 at 0.94.
        let from = Some(Vector::new(0.0, 0.0, 2.0));
        let points: Vec<_> = (0..100).map(|k| (Vector::new(k as f64, 0.0, 0.01 * k as f64), from)).collect();
        let summary = CloudErrors::to_surface(&Floor, &points, 1.0).summary().unwrap();
        assert_relative_eq!(summary.bias_m, 0.495, epsilon = 1e-12);
        assert_relative_eq!(summary.sigma_m, (9999.0_f64 / 12.0).sqrt() * 0.01, epsilon = 1e-12);
        assert_relative_eq!(summary.p95_m, 0.94, epsilon = 1e-12);
        assert_eq!(summary.beyond_reach, 0.0);
        let half = CloudErrors::to_surface(&Floor, &points, 0.495);
        assert_eq!((half.signed_m.len(), half.beyond_reach), (50, 50));
        assert_eq!(CloudErrors::default().summary(), None);
    }

    #[test]
    fn a_point_below_the_floor_has_a_negative_distance() {
        let point = Vector::new(0.0, 0.0, -0.02);
        let seen = |from| CloudErrors::to_surface(&Floor, &[(point, from)], 1.0).signed_m[0];
        assert_relative_eq!(seen(Some(Vector::z())), -0.02);
        assert_relative_eq!(seen(Some(-Vector::z())), 0.02);
        assert_relative_eq!(seen(None), 0.02);
    }

    #[test]
    fn thinning_keeps_about_the_limit_and_every_phase_of_a_scan() {
        // 1081 beams a scan, 2000 scans: of 100 000 selected points, each beam's index occurs about 92 times.
        let total = 1081 * 2000;
        let thinning = Thinning::to_at_most(100_000, total);
        let mut per_beam = vec![0_usize; 1081];
        (0..total).filter(|index| thinning.keeps(*index)).for_each(|index| per_beam[index % 1081] += 1);
        assert!(per_beam.iter().sum::<usize>().abs_diff(100_000) < 10);
        assert!(per_beam.iter().all(|count| (80..=105).contains(count)), "{per_beam:?}");
        assert!((0..50).all(|index| Thinning::to_at_most(50, 50).keeps(index)));
    }
}
