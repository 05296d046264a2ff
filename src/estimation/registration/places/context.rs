//! What a place looks like from above: Scan Context (G. Kim and A. Kim, IROS 2018).
//!
//! The plane about the head is cut into rings and sectors; of each cell the greatest height of what is seen in it is
//! kept. A place seen by a head that was turned has the same columns (sectors), shifted; what share of each ring is not
//! empty does not depend on the turn, and is the key by which alike places are found in a tree.
//!
//! Here heights are those of upright surfaces over the ground: ceilings are alike everywhere. The map's vertical is
//! gravity's, which the open loop does not lose.

use crate::estimation::surfel::Patch;
use nabo::{CandidateContainer, KDTree, NotNan, Parameters, Point};

const RINGS: usize = 20;
const SECTORS: usize = 60;
/// Width of a ring, m.
const RING_M: f64 = 1.0;
/// A surface is upright when its normal leaves the horizontal by less than this sine.
const UPRIGHT: f64 = 0.5;
/// Added to heights, so that what is low is told from nothing, m.
const FOOT_M: f64 = 0.5;
/// Contexts are compared when this share of the sectors shows something in both.
const IN_COMMON: f64 = 0.3;

/// Whether a patch is of a wall, a trunk, or furniture's side.
pub(super) fn is_upright(patch: &Patch) -> bool {
    patch.normal.z.abs() < UPRIGHT
}

/// A place seen from above.
#[derive(Debug, Clone)]
pub(super) struct Context {
    /// Height in each ring of each sector, m; 0 where nothing is.
    columns: Vec<[f32; RINGS]>,
    /// Of each column.
    norms: Vec<f32>,
}

/// Two contexts compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Likeness {
    /// 0 of the same, 1 of what has nothing in common.
    pub(super) distance: f64,
    /// Turn by which what the first sees becomes what the second sees, -pi..pi rad.
    pub(super) yaw: f64,
}

/// The share of each ring that is not empty.
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
    /// Of patches about the head, where the ground is `ground_m` over it.
    pub(super) fn of(patches: impl Iterator<Item = Patch>, ground_m: f64) -> Self {
        let mut columns = vec![[0.0_f32; RINGS]; SECTORS];
        for patch in patches.filter(is_upright) {
            let (x, y) = (patch.centre.x, patch.centre.y);
            let ring = (x.hypot(y) / RING_M) as usize;
            if ring >= RINGS {
                continue;
            }
            let turns = y.atan2(x) / std::f64::consts::TAU;
            let sector = ((turns.rem_euclid(1.0) * SECTORS as f64) as usize).min(SECTORS - 1);
            let height = (patch.centre.z - ground_m).max(0.0) + FOOT_M;
            let cell = &mut columns[sector][ring];
            *cell = cell.max(height as f32);
        }
        let norms = columns.iter().map(|column| column.iter().map(|h| h * h).sum::<f32>().sqrt()).collect();
        Self { columns, norms }
    }

    fn key(&self) -> Key {
        let share = |ring: usize| {
            let full = self.columns.iter().filter(|column| column[ring] > 0.0).count();
            NotNan::new(full as f32 / SECTORS as f32).unwrap_or_default()
        };
        Key(std::array::from_fn(share))
    }

    /// How like another this is at the turn that makes them most alike; `None` where they have too little in common.
    pub(super) fn likeness(&self, other: &Self) -> Option<Likeness> {
        let turned = (0..SECTORS).filter_map(|shift| Some((self.distance_at(other, shift)?, shift)));
        let (distance, shift) = turned.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let turn = shift as f64 / SECTORS as f64;
        Some(Likeness { distance, yaw: (turn - turn.round()) * std::f64::consts::TAU })
    }

    /// Mean over the columns of one less the cosine between them, with this one's columns shifted by `shift`.
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
        (count as f64 >= IN_COMMON * SECTORS as f64).then(|| sum / count as f64)
    }
}

/// The `count` contexts whose keys are nearest to that of each, nearest first, itself not among them.
pub(super) fn nearest(contexts: &[Context], count: usize) -> Vec<Vec<usize>> {
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
    use crate::geometry::{Matrix, Rotation, Vector};

    /// Posts of different heights at golden angles, the heights and distances those of `seed`.
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
        Context::of(posts(seed, turn).into_iter(), -1.2)
    }

    #[test]
    fn a_turned_place_is_the_same_and_the_turn_is_told() {
        // Seven sectors.
        let turn = 7.0 * std::f64::consts::TAU / 60.0;
        let likeness = context(1.7, 0.0).likeness(&context(1.7, turn)).unwrap();
        assert!(likeness.distance < 0.02, "{likeness:?}");
        assert!((likeness.yaw - turn).abs() < 1e-9, "{likeness:?}");
        let back = context(1.7, turn).likeness(&context(1.7, 0.0)).unwrap();
        assert!((back.yaw + turn).abs() < 1e-9, "{back:?}");
    }

    #[test]
    fn another_place_is_unlike_and_found_behind_the_same() {
        let contexts = [context(1.7, 0.0), context(0.9, 0.0), context(2.3, 0.3), context(1.7, 0.8)];
        let apart = contexts[0].likeness(&contexts[1]).unwrap();
        assert!(apart.distance > 0.3, "{apart:?}");
        assert_eq!(nearest(&contexts, 3)[0][0], 3);
        assert_eq!(nearest(&contexts, 3)[3][0], 0);
    }

    #[test]
    fn of_nothing_nothing_is_said() {
        let nothing = Context::of(std::iter::empty(), 0.0);
        assert_eq!(nothing.likeness(&nothing), None);
        assert!(nearest(&[], 3).is_empty());
    }
}
