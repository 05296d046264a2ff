//! Fuses surfels of the same surface: same cell, similar normals, coplanar.

use zsim_base::geometry::{Matrix, Vector};
use zsim_base::surfel_map::MapSurfel;

/// Maximum angle between the normals of one surface, degrees.
const MAX_NORMAL_ANGLE_DEG: f64 = 15.0;
/// Maximum distance between the planes of one surface: this at the finest resolution, m (it doubles with each level), plus
/// this many standard deviations of both surfels' positions.
const MAX_PLANE_DISTANCE: (f64, f64) = (0.03, 3.0);

/// The accumulated surfels of one surface.
#[derive(Debug, Clone)]
struct Cluster {
    points: f64,
    mean: Vector,
    covariance: Matrix,
    normal: Vector,
    /// Mean variance of the positions along the normal, weighted by points, m^2.
    variance: f64,
    level: usize,
}

/// Fuses surfels, in order of resolution and cell; within a cell the clusters grow in input order.
pub(super) fn fuse(finest_voxel_m: f64, surfels: Vec<MapSurfel>) -> Vec<MapSurfel> {
    let mut keyed: Vec<_> = surfels.into_iter().map(|surfel| (cell(&surfel, finest_voxel_m), surfel)).collect();
    // A stable sort keeps the surfels of a cell in time order.
    keyed.sort_by_key(|(cell, _)| *cell);
    let cells = keyed.chunk_by(|(a, _), (b, _)| a == b);
    cells.flat_map(|cell| clusters(cell.iter().map(|(_, surfel)| surfel))).map(Cluster::into_surfel).collect()
}

/// Resolution and coordinates of a surfel's cell.
fn cell(surfel: &MapSurfel, finest_voxel_m: f64) -> (usize, [i64; 3]) {
    let edge_m = finest_voxel_m * f64::from(1_u32 << surfel.level);
    (surfel.level, [0, 1, 2].map(|axis| (surfel.centre_in_map[axis] / edge_m).floor() as i64))
}

fn clusters<'a>(surfels: impl Iterator<Item = &'a MapSurfel>) -> Vec<Cluster> {
    let mut clusters: Vec<Cluster> = Vec::new();
    for surfel in surfels {
        match clusters.iter_mut().find(|cluster| cluster.matches(surfel)) {
            Some(cluster) => cluster.add(surfel),
            None => clusters.push(Cluster::from_surfel(surfel)),
        }
    }
    clusters
}

impl Cluster {
    fn from_surfel(surfel: &MapSurfel) -> Self {
        Self {
            points: surfel.points,
            mean: surfel.centre_in_map,
            covariance: surfel.covariance_in_map,
            normal: surfel.normal_in_map,
            variance: surfel.sigma_m * surfel.sigma_m,
            level: surfel.level,
        }
    }

    fn matches(&self, surfel: &MapSurfel) -> bool {
        let difference = surfel.centre_in_map - self.mean;
        let max_distance_m = MAX_PLANE_DISTANCE.0 * f64::from(1_u32 << self.level)
            + MAX_PLANE_DISTANCE.1 * (self.variance + surfel.sigma_m * surfel.sigma_m).sqrt();
        self.normal.dot(&surfel.normal_in_map) > MAX_NORMAL_ANGLE_DEG.to_radians().cos()
            && difference.dot(&self.normal).abs().max(difference.dot(&surfel.normal_in_map).abs()) < max_distance_m
    }

    /// Adds a surfel's points.
    ///
    /// Errors of one trajectory are correlated, so the variance along the normal is averaged and does not decrease.
    fn add(&mut self, surfel: &MapSurfel) {
        let points = self.points + surfel.points;
        let (ours, theirs) = (self.points / points, surfel.points / points);
        let difference = surfel.centre_in_map - self.mean;
        self.mean += difference * theirs;
        self.covariance = self.covariance * ours
            + surfel.covariance_in_map * theirs
            + difference * difference.transpose() * (ours * theirs);
        self.variance = self.variance * ours + surfel.sigma_m * surfel.sigma_m * theirs;
        self.points = points;
        let eigen = self.covariance.symmetric_eigen();
        let smallest: Vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        self.normal = if smallest.dot(&self.normal) < 0.0 { -smallest } else { smallest };
    }

    fn into_surfel(self) -> MapSurfel {
        MapSurfel {
            centre_in_map: self.mean,
            normal_in_map: self.normal.normalize(),
            covariance_in_map: (self.covariance + self.covariance.transpose()) * 0.5,
            points: self.points,
            sigma_m: self.variance.sqrt(),
            level: self.level,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Surfel of `points`, computed from the definitions of the moments.
    fn surfel(points: &[Vector], normal: Vector) -> MapSurfel {
        let count = points.len() as f64;
        let mean = points.iter().sum::<Vector>() / count;
        let covariance = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix>() / count;
        let (centre_in_map, normal_in_map, covariance_in_map) = (mean, normal, covariance);
        MapSurfel { centre_in_map, normal_in_map, covariance_in_map, points: count, sigma_m: 0.002, level: 0 }
    }

    fn floor(from: usize, count: usize) -> Vec<Vector> {
        let at = |k: usize| {
            Vector::new(0.1 + 0.3 * (k as f64 * 0.7).sin().abs(), 0.1 + 0.3 * (k as f64 * 1.3).cos().abs(), 0.2)
        };
        (from..from + count).map(|k| at(k) + Vector::z() * 0.003 * (k as f64 * 2.1).sin()).collect()
    }

    #[test]
    fn two_observations_of_a_floor_fuse_into_the_surfel_of_all_points() {
        let all = floor(0, 90);
        let fused = fuse(0.5, vec![surfel(&all[..40], Vector::z()), surfel(&all[40..], Vector::z())]);
        let [one] = fused[..] else { panic!("{fused:?}") };
        let expected = surfel(&all, Vector::z());
        assert_eq!(one.points, 90.0);
        assert_relative_eq!(one.centre_in_map, expected.centre_in_map, epsilon = 1e-12);
        assert_relative_eq!(one.covariance_in_map, expected.covariance_in_map, epsilon = 1e-12);
        assert!(one.normal_in_map.z > 0.99 && (one.sigma_m - 0.002).abs() < 1e-12);
    }

    #[test]
    fn opposite_sides_of_a_board_and_steps_are_not_fused() {
        let moved = |by: f64| -> Vec<Vector> { floor(0, 40).iter().map(|p| p + Vector::z() * by).collect() };
        let (below, above) = (surfel(&moved(0.0), -Vector::z()), surfel(&moved(0.02), Vector::z()));
        let step = surfel(&moved(0.2), Vector::z());
        let fused = fuse(0.5, vec![below, above, step, above]);
        let mut points: Vec<f64> = fused.iter().map(|surfel| surfel.points).collect();
        points.sort_by(f64::total_cmp);
        assert_eq!(points, [40.0, 40.0, 80.0]);
    }
}
