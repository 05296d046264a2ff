//! Surfels of one surface become one: those of a cell whose normals agree and that lie in one plane.

use crate::geometry::{Matrix, Vector};
use crate::surfel_map::MapSurfel;

/// Normals of one surface are no farther from each other than this, degrees.
const ANGLE_DEG: f64 = 15.0;
/// Planes of one surface are no farther from each other than this at the finest resolution, m, and beside it by so many
/// standard deviations of both surfels' places.
const APART: (f64, f64) = (0.03, 3.0);

/// Surfels of one surface, put together.
#[derive(Debug, Clone)]
struct Cluster {
    points: f64,
    mean: Vector,
    covariance: Matrix,
    normal: Vector,
    /// Mean variance of their places, by their points.
    variance: f64,
    level: usize,
}

/// The surfels put together, in order of resolution and cell; of those of a cell the one that came first begins.
pub(super) fn fuse(finest_voxel_m: f64, surfels: Vec<MapSurfel>) -> Vec<MapSurfel> {
    let mut keyed: Vec<_> = surfels.into_iter().map(|surfel| (cell(&surfel, finest_voxel_m), surfel)).collect();
    // Stable: those of a cell stay in the order of time.
    keyed.sort_by_key(|(cell, _)| *cell);
    let cells = keyed.chunk_by(|(a, _), (b, _)| a == b);
    cells.flat_map(|cell| clusters(cell.iter().map(|(_, surfel)| surfel))).map(Cluster::into_surfel).collect()
}

/// Resolution and place of a surfel's cell.
fn cell(surfel: &MapSurfel, finest_voxel_m: f64) -> (usize, [i64; 3]) {
    let edge_m = finest_voxel_m * f64::from(1_u32 << surfel.level);
    (surfel.level, [0, 1, 2].map(|axis| (surfel.centre_in_map[axis] / edge_m).floor() as i64))
}

fn clusters<'a>(surfels: impl Iterator<Item = &'a MapSurfel>) -> Vec<Cluster> {
    let mut clusters: Vec<Cluster> = Vec::new();
    for surfel in surfels {
        match clusters.iter_mut().find(|cluster| cluster.is_of(surfel)) {
            Some(cluster) => cluster.take(surfel),
            None => clusters.push(Cluster::of(surfel)),
        }
    }
    clusters
}

impl Cluster {
    fn of(surfel: &MapSurfel) -> Self {
        Self {
            points: surfel.points,
            mean: surfel.centre_in_map,
            covariance: surfel.covariance_in_map,
            normal: surfel.normal_in_map,
            variance: surfel.sigma_m * surfel.sigma_m,
            level: surfel.level,
        }
    }

    fn is_of(&self, surfel: &MapSurfel) -> bool {
        let apart = surfel.centre_in_map - self.mean;
        let most_m = APART.0 * f64::from(1_u32 << self.level)
            + APART.1 * (self.variance + surfel.sigma_m * surfel.sigma_m).sqrt();
        self.normal.dot(&surfel.normal_in_map) > ANGLE_DEG.to_radians().cos()
            && apart.dot(&self.normal).abs().max(apart.dot(&surfel.normal_in_map).abs()) < most_m
    }

    /// Adds a surfel's points. The errors of one trajectory go together: what is put together is as uncertain as its
    /// parts are in the mean.
    fn take(&mut self, surfel: &MapSurfel) {
        let points = self.points + surfel.points;
        let (ours, theirs) = (self.points / points, surfel.points / points);
        let apart = surfel.centre_in_map - self.mean;
        self.mean += apart * theirs;
        self.covariance =
            self.covariance * ours + surfel.covariance_in_map * theirs + apart * apart.transpose() * (ours * theirs);
        self.variance = self.variance * ours + surfel.sigma_m * surfel.sigma_m * theirs;
        self.points = points;
        let eigen = self.covariance.symmetric_eigen();
        let least: Vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        self.normal = if least.dot(&self.normal) < 0.0 { -least } else { least };
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

    /// The surfel that points are, by the definitions.
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
    fn two_sights_of_a_floor_become_the_surfel_of_all_their_points() {
        let all = floor(0, 90);
        let fused = fuse(0.5, vec![surfel(&all[..40], Vector::z()), surfel(&all[40..], Vector::z())]);
        let [one] = fused[..] else { panic!("{fused:?}") };
        let brute = surfel(&all, Vector::z());
        assert_eq!(one.points, 90.0);
        assert_relative_eq!(one.centre_in_map, brute.centre_in_map, epsilon = 1e-12);
        assert_relative_eq!(one.covariance_in_map, brute.covariance_in_map, epsilon = 1e-12);
        assert!(one.normal_in_map.z > 0.99 && (one.sigma_m - 0.002).abs() < 1e-12);
    }

    #[test]
    fn both_sides_of_a_board_and_steps_stay_apart() {
        let moved = |by: f64| -> Vec<Vector> { floor(0, 40).iter().map(|p| p + Vector::z() * by).collect() };
        let (below, above) = (surfel(&moved(0.0), -Vector::z()), surfel(&moved(0.02), Vector::z()));
        let step = surfel(&moved(0.2), Vector::z());
        let fused = fuse(0.5, vec![below, above, step, above]);
        let mut points: Vec<f64> = fused.iter().map(|surfel| surfel.points).collect();
        points.sort_by(f64::total_cmp);
        assert_eq!(points, [40.0, 40.0, 80.0]);
    }
}
