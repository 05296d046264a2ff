//! Scan Context descriptor of a node (G. Kim and A. Kim, IROS 2018).
//!
//! The horizontal plane around the head is divided into rings and sectors; each cell stores the maximum height. A rotation of
//! the head shifts the columns (sectors). The fraction of occupied cells of each ring is invariant to rotation; it is the key
//! for the search of similar nodes in a k-d tree.
//!
//! Only vertical surfaces are used, with heights above the ground, because ceilings look alike everywhere. The vertical axis
//! is that of gravity, which the open loop observes without drift.

use crate::surfel::Patch;
use nabo::{CandidateContainer, KDTree, NotNan, Parameters, Point};

/// Number of rings, as in the paper; with `RING_M` the descriptor reaches 20 m.
const RINGS: usize = 20;
/// Number of sectors, 6 degrees each, as in the paper.
const SECTORS: usize = 60;
/// Width of a ring, m.
const RING_M: f64 = 1.0;
/// A surface is vertical if the vertical component of the unit normal is below this (30 degrees).
const MAX_WALL_NORMAL_Z: f64 = 0.5;
/// Added to heights to distinguish low surfaces from empty cells, m.
const HEIGHT_OFFSET_M: f64 = 0.5;
/// Minimum fraction of sectors that are non-empty in both descriptors.
const MIN_COMMON_SECTORS: f64 = 0.3;

/// Whether a patch is vertical: a wall, a trunk, a side of furniture.
fn is_wall(patch: &Patch) -> bool {
    patch.normal.z.abs() < MAX_WALL_NORMAL_Z
}

/// Scan Context descriptor.
#[derive(Debug, Clone)]
pub(super) struct Context {
    /// Maximum height in each ring of each sector, m; 0 for empty cells.
    columns: Vec<[f32; RINGS]>,
    /// Euclidean norm of each column.
    norms: Vec<f32>,
}

/// Result of the comparison of two descriptors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ContextMatch {
    /// Mean cosine distance of the columns: 0 equal, 1 nothing in common.
    pub(super) distance: f64,
    /// Rotation from the first to the second descriptor, -pi..pi rad.
    pub(super) yaw: f64,
}

/// Ring key: fraction of occupied cells of each ring.
#[derive(Debug, Clone, Copy, Default)]
struct Key([NotNan<f32>; RINGS]);

impl Point<f32> for Key {
    const DIM: u32 = RINGS as u32;
    fn set(&mut self, i: u32, value: NotNan<f32>) {
        self.0[i as usize] = value;
    }
    fn get(&self, i: u32) -> NotNan<f32> {
        self.0[i as usize]
    }
}

impl Context {
    /// Descriptor of patches relative to the head; `ground_m` is the height of the ground.
    pub(super) fn from_patches(patches: impl Iterator<Item = Patch>, ground_m: f64) -> Self {
        let mut columns = vec![[0.0_f32; RINGS]; SECTORS];
        for patch in patches.filter(is_wall) {
            let (x, y) = (patch.centre.x, patch.centre.y);
            let ring = (x.hypot(y) / RING_M) as usize;
            if ring >= RINGS {
                continue;
            }
            let turns = y.atan2(x) / std::f64::consts::TAU;
            let sector = ((turns.rem_euclid(1.0) * SECTORS as f64) as usize).min(SECTORS - 1);
            let height = (patch.centre.z - ground_m).max(0.0) + HEIGHT_OFFSET_M;
            let cell = &mut columns[sector][ring];
            *cell = cell.max(height as f32);
        }
        let norms = columns.iter().map(|column| column.iter().map(|h| h * h).sum::<f32>().sqrt()).collect();
        Self { columns, norms }
    }

    fn key(&self) -> Key {
        let occupied_fraction = |ring: usize| {
            let occupied = self.columns.iter().filter(|column| column[ring] > 0.0).count();
            NotNan::new(occupied as f32 / SECTORS as f32).unwrap_or_default()
        };
        Key(std::array::from_fn(occupied_fraction))
    }

    /// Compares two descriptors at the rotation with the least distance; `None` if too few sectors are common.
    pub(super) fn compare(&self, other: &Self) -> Option<ContextMatch> {
        let rotated = (0..SECTORS).filter_map(|shift| Some((self.distance_at(other, shift)?, shift)));
        let (distance, shift) = rotated.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let turn = shift as f64 / SECTORS as f64;
        Some(ContextMatch { distance, yaw: (turn - turn.round()) * std::f64::consts::TAU })
    }

    /// Mean cosine distance of the columns, with the columns of `self` shifted by `shift`.
    fn distance_at(&self, other: &Self, shift: usize) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0_usize);
        for (k, (column, norm)) in self.columns.iter().zip(&self.norms).enumerate() {
            let there = (k + shift) % SECTORS;
            let both = norm * other.norms[there];
            if both > 0.0 {
                let dot: f32 = column.iter().zip(&other.columns[there]).map(|(a, b)| a * b).sum();
                sum += 1.0 - f64::from(dot / both);
                count += 1;
            }
        }
        (count as f64 >= MIN_COMMON_SECTORS * SECTORS as f64).then(|| sum / count as f64)
    }
}

/// The `count` descriptors with the nearest ring keys for each descriptor, nearest first, without itself.
pub(super) fn nearest_by_key(contexts: &[Context], count: usize) -> Vec<Vec<usize>> {
    let keys: Vec<Key> = contexts.iter().map(Context::key).collect();
    if keys.is_empty() {
        return Vec::new();
    }
    let tree = KDTree::new(&keys);
    let parameters = Parameters { epsilon: 0.0, max_radius: f32::INFINITY, allow_self_match: true, sort_results: true };
    let of = |(own, key): (usize, &Key)| {
        let near = tree.knn_advanced(count as u32 + 1, key, CandidateContainer::BinaryHeap, &parameters, None);
        near.iter().map(|neighbour| neighbour.index as usize).filter(|k| *k != own).collect()
    };
    keys.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::{Matrix, Rotation, Vector};

    /// Posts at golden angles; `seed` determines heights and distances.
    fn posts(seed: f64, turn: f64) -> Vec<Patch> {
        let rotation = Rotation::from_scaled_axis(Vector::z() * turn);
        let post = |k: usize| {
            let (angle, wave) = (2.4 * k as f64, (seed * (k + 1) as f64).sin());
            let normal = Vector::new(-angle.cos(), -angle.sin(), 0.0);
            let centre = Vector::new(angle.cos(), angle.sin(), 0.0) * (10.0 + 8.0 * wave);
            let centre = centre + Vector::z() * (1.0 + (3.0 * wave).cos());
            let covariance = Matrix::identity() * 1e-4;
            let (centre, normal) = (rotation * centre, rotation * normal);
            Patch { centre, normal, points: 50.0, covariance, roughness_variance: 0.0, level: 0 }
        };
        (0..90).map(post).collect()
    }

    fn context(seed: f64, turn: f64) -> Context {
        Context::from_patches(posts(seed, turn).into_iter(), -1.2)
    }

    #[test]
    fn rotated_place_matches_with_the_right_rotation() {
        // A rotation by seven sectors.
        let turn = 7.0 * std::f64::consts::TAU / 60.0;
        let matched = context(1.7, 0.0).compare(&context(1.7, turn)).unwrap();
        assert!(matched.distance < 0.02, "{matched:?}");
        assert!((matched.yaw - turn).abs() < 1e-9, "{matched:?}");
        let back = context(1.7, turn).compare(&context(1.7, 0.0)).unwrap();
        assert!((back.yaw + turn).abs() < 1e-9, "{back:?}");
    }

    #[test]
    fn different_place_has_a_large_distance_and_ranks_lower() {
        let contexts = [context(1.7, 0.0), context(0.9, 0.0), context(2.3, 0.3), context(1.7, 0.8)];
        let different = contexts[0].compare(&contexts[1]).unwrap();
        assert!(different.distance > 0.3, "{different:?}");
        assert_eq!(nearest_by_key(&contexts, 3)[0][0], 3);
        assert_eq!(nearest_by_key(&contexts, 3)[3][0], 0);
    }

    #[test]
    fn empty_descriptors_cannot_be_compared() {
        let empty = Context::from_patches(std::iter::empty(), 0.0);
        assert_eq!(empty.compare(&empty), None);
        assert!(nearest_by_key(&[], 3).is_empty());
    }
}
