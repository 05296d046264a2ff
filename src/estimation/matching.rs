//! Which surfels show the same surface: near each other in position and normal, from both sides, and at different times.

use super::spec::{MatchingSpec, SurfelSpec};
use super::surfel::{Patch, Placed};
use nabo::{CandidateContainer, KDTree, NotNan, Parameters, Point};
use rayon::prelude::*;

/// Position in voxel edges and scaled normal.
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

/// The metric of the six dimensions, and the gates.
#[derive(Debug, Clone)]
pub(super) struct Matcher {
    pub(super) spec: MatchingSpec,
    pub(super) finest_voxel_m: f64,
    pub(super) levels: usize,
}

/// The patches of each resolution in a tree.
pub(super) struct Forest {
    levels: Vec<Level>,
}

struct Level {
    members: Vec<u32>,
    tree: Option<KDTree<f32, Feature>>,
}

impl std::fmt::Debug for Forest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.levels.iter().map(|level| level.members.len())).finish()
    }
}

impl Matcher {
    pub(super) fn new(spec: &MatchingSpec, surfels: &SurfelSpec) -> Self {
        Self { spec: spec.clone(), finest_voxel_m: surfels.finest_voxel_m, levels: surfels.levels }
    }

    fn feature(&self, patch: &Patch) -> Feature {
        let per_edge = 1.0 / (self.finest_voxel_m * f64::from(1_u32 << patch.level));
        let (centre, normal) = (patch.centre * per_edge, patch.normal * self.spec.normal_scale);
        let number = |x: f64| NotNan::new(x as f32).unwrap_or_default();
        Feature([centre.x, centre.y, centre.z, normal.x, normal.y, normal.z].map(number))
    }

    /// Plants a tree a resolution.
    pub(super) fn plant<'a>(&self, patches: &(impl Iterator<Item = &'a Patch> + Clone)) -> Forest {
        let plant = |level: usize| {
            let of_level = patches.clone().enumerate().filter(|(_, patch)| patch.level == level);
            let (members, features): (Vec<u32>, Vec<Feature>) =
                of_level.map(|(index, patch)| (index as u32, self.feature(patch))).unzip();
            let tree = (!features.is_empty()).then(|| KDTree::new(&features));
            Level { members, tree }
        };
        Forest { levels: (0..self.levels).map(plant).collect() }
    }

    /// The `count` patches nearest to `patch` in six dimensions, nearest first, into `found`.
    pub(super) fn neighbours(&self, forest: &Forest, patch: &Patch, count: usize, found: &mut Vec<u32>) {
        let Some(Level { members, tree: Some(tree) }) = forest.levels.get(patch.level) else { return };
        let parameters = Parameters {
            epsilon: 0.0,
            max_radius: self.spec.max_distance as f32,
            allow_self_match: false,
            sort_results: true,
        };
        let near = tree.knn_advanced(count as u32, &self.feature(patch), CandidateContainer::Linear, &parameters, None);
        found.extend(near.iter().map(|neighbour| members[neighbour.index as usize]));
    }

    /// Pairs among the window's own surfels, in order: indices `(i, j)`, `i < j`.
    pub(super) fn among(&self, placed: &[Placed], gate_m: f64) -> Vec<(u32, u32)> {
        let forest = self.plant(&placed.iter().map(|surfel| &surfel.patch));
        let count = self.spec.neighbours;
        let near: Vec<Vec<u32>> = placed
            .par_iter()
            .with_min_len(256)
            .map(|surfel| {
                let mut found = Vec::with_capacity(count);
                self.neighbours(&forest, &surfel.patch, count, &mut found);
                found
            })
            .collect();
        let mut pairs = Vec::new();
        for (i, surfel) in placed.iter().enumerate() {
            for j in &near[i] {
                let mutual = near[*j as usize].contains(&(i as u32));
                let other = &placed[*j as usize];
                let first_of_both = i < *j as usize || !mutual;
                let apart = (surfel.tau_s - other.tau_s).abs() >= self.spec.min_time_difference_s;
                let counts = mutual || !self.spec.reciprocal;
                if first_of_both && counts && apart && self.agree(&surfel.patch, &other.patch, gate_m) {
                    pairs.push((i.min(*j as usize) as u32, i.max(*j as usize) as u32));
                }
            }
        }
        pairs
    }

    /// Whether two patches can be the same surface, as far as normals and the distance along them say.
    pub(super) fn agree(&self, a: &Patch, b: &Patch, gate_m: f64) -> bool {
        let apart = a.centre - b.centre;
        a.normal.dot(&b.normal) > self.spec.max_normal_angle_deg.to_radians().cos()
            && apart.dot(&a.normal).abs().max(apart.dot(&b.normal).abs()) < 3.0 * gate_m
            && apart.dot(&(a.normal + b.normal)).abs() < 2.0 * gate_m
    }
}
