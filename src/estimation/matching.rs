//! Surfel matching: nearest neighbours in position and normal, with gates on normals, distance and time.

use super::spec::{MatchingSpec, SurfelSpec};
use super::surfel::{FINE, Patch, PlacedSurfel, voxel_edge_m};
use nabo::{CandidateContainer, KDTree, NotNan, Parameters, Point};
use rayon::prelude::*;

/// Point of the six-dimensional search space: position in voxel edges, and scaled normal.
#[derive(Debug, Clone, Copy, Default)]
struct Feature([NotNan<f32>; 6]);

impl Point<f32> for Feature {
    const DIM: u32 = 6;
    fn set(&mut self, i: u32, value: NotNan<f32>) {
        self.0[i as usize] = value;
    }
    fn get(&self, i: u32) -> NotNan<f32> {
        self.0[i as usize]
    }
}

/// Metric of the neighbour search, and match gates.
#[derive(Debug, Clone)]
pub(super) struct Matcher {
    pub(super) spec: MatchingSpec,
    pub(super) finest_voxel_m: f64,
    pub(super) levels: usize,
}

/// A k-d tree of patches for each resolution, 0 to [`FINE`].
pub(super) struct SearchTrees {
    levels: Vec<Level>,
}

/// The tree of a resolution; `members` are indices into the patches.
struct Level {
    members: Vec<u32>,
    tree: Option<KDTree<f32, Feature>>,
}

impl Level {
    fn of(level: usize, patches: &[Patch], feature: impl Fn(&Patch) -> Feature) -> Self {
        let of_level = patches.iter().enumerate().filter(|(_, patch)| patch.level == level);
        let (members, features): (Vec<u32>, Vec<Feature>) =
            of_level.map(|(index, patch)| (index as u32, feature(patch))).unzip();
        let tree = (!features.is_empty()).then(|| KDTree::new(&features));
        Self { members, tree }
    }

    /// The `count` members nearest to `feature`, nearest first.
    fn nearest(&self, feature: &Feature, count: usize, max_distance: f64) -> Vec<u32> {
        let Some(tree) = &self.tree else { return Vec::new() };
        let max_radius = max_distance as f32;
        let parameters = Parameters { epsilon: 0.0, max_radius, allow_self_match: false, sort_results: true };
        let found = tree.knn_advanced(count as u32, feature, CandidateContainer::Linear, &parameters, None);
        found.iter().map(|neighbour| self.members[neighbour.index as usize]).collect()
    }
}

impl std::fmt::Debug for SearchTrees {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.levels.iter().map(|level| level.members.len())).finish()
    }
}

impl Matcher {
    pub(super) fn new(spec: &MatchingSpec, surfels: &SurfelSpec) -> Self {
        Self { spec: spec.clone(), finest_voxel_m: surfels.finest_voxel_m, levels: surfels.levels }
    }

    fn feature(&self, patch: &Patch) -> Feature {
        let per_edge = 1.0 / voxel_edge_m(self.finest_voxel_m, patch.level);
        let [x, y, z] = <[f64; 3]>::from(patch.centre * per_edge).map(not_nan);
        let [a, b, c] = <[f64; 3]>::from(patch.normal * self.spec.normal_scale).map(not_nan);
        Feature([x, y, z, a, b, c])
    }

    /// Builds a tree for each resolution.
    pub(super) fn build_trees(&self, patches: &[Patch]) -> SearchTrees {
        let build = |level| Level::of(level, patches, |patch| self.feature(patch));
        SearchTrees { levels: (0..=FINE).into_par_iter().map(build).collect() }
    }

    /// The `count` patches nearest to `patch` in six dimensions, nearest first.
    pub(super) fn neighbours(&self, trees: &SearchTrees, patch: &Patch, count: usize) -> Vec<u32> {
        let level = trees.levels.get(patch.level);
        level.map_or_else(Vec::new, |level| level.nearest(&self.feature(patch), count, self.spec.max_distance))
    }

    /// Pairs of neighbouring patches in `placed`, found in `trees`: ordered indices `(i, j)`, `i < j`.
    pub(super) fn neighbour_pairs(&self, placed: &[PlacedSurfel], trees: &SearchTrees) -> Vec<(u32, u32)> {
        let neighbours: Vec<Vec<u32>> = placed
            .par_iter()
            .with_min_len(256)
            .map(|surfel| self.neighbours(trees, &surfel.patch, self.spec.neighbours))
            .collect();
        let mut pairs = Vec::new();
        for (i, surfel) in placed.iter().enumerate() {
            for j in neighbours[i].iter().map(|j| *j as usize) {
                let is_mutual = i < j && neighbours[j].contains(&(i as u32));
                if is_mutual && self.separated_in_time(surfel, &placed[j]) {
                    pairs.push((i as u32, j as u32));
                }
            }
        }
        pairs
    }

    /// Maximum distance of a match along the normal, m.
    pub(super) fn max_plane_distance_m(&self) -> f64 {
        self.spec.max_plane_distance_m
    }

    /// Whether the times of two surfels differ by at least the minimum.
    pub(super) fn separated_in_time(&self, a: &PlacedSurfel, b: &PlacedSurfel) -> bool {
        (a.tau_s - b.tau_s).abs() >= self.spec.min_time_difference_s
    }

    /// Whether two patches pass the gates on the angle between normals and on the distance along them.
    pub(super) fn pass_gates(&self, a: &Patch, b: &Patch, gate_m: f64) -> bool {
        let difference = a.centre - b.centre;
        a.normal.dot(&b.normal) > self.spec.max_normal_angle_deg.to_radians().cos()
            && difference.dot(&a.normal).abs().max(difference.dot(&b.normal).abs()) < 3.0 * gate_m
            && difference.dot(&(a.normal + b.normal)).abs() < 2.0 * gate_m
    }
}

fn not_nan(x: f64) -> NotNan<f32> {
    NotNan::new(x as f32).unwrap_or_default()
}
