//! Candidate matches: reciprocal nearest neighbours between two submaps, for each resolution.

use super::scene::Scene;
use crate::matching::{Matcher, SearchTrees};
use crate::surfel::Patch;
use rayon::prelude::*;
use std::ops::Range;

/// Neighbours are searched again when surfels may have moved by this fraction of the voxel edge.
const MAX_MOTION_EDGES: f64 = 0.05;

/// Cached neighbours of all resolutions.
#[derive(Debug)]
pub(super) struct Neighbours {
    /// Neighbours of each resolution, after the first search.
    levels: Vec<Option<LevelNeighbours>>,
    finest: usize,
    pub(super) active: ActiveNeighbours,
}

/// Neighbours of one resolution.
#[derive(Debug)]
struct LevelNeighbours {
    pairs: Vec<(u32, u32)>,
    /// Upper limit of the motion of the surfels since the search, m.
    moved_m: f64,
}

/// Neighbours of the active resolutions.
#[derive(Debug, Default)]
pub(super) struct ActiveNeighbours {
    /// Pairs of surfels `(i, j)`, `i < j`, sorted by the time bins of both.
    pub(super) pairs: Vec<(u32, u32)>,
    /// Ranges of pairs of the same two time bins.
    pub(super) runs: Vec<Range<usize>>,
    /// Number of neighbours of each surfel.
    pub(super) counts: Vec<u32>,
}

/// Search index of the surfels of a submap at one resolution.
struct SubmapIndex {
    members: Vec<u32>,
    patches: Vec<Patch>,
    trees: SearchTrees,
}

impl Neighbours {
    /// An empty cache for `levels` resolutions.
    pub(super) fn new(levels: usize) -> Self {
        Self { levels: (0..levels).map(|_| None).collect(), finest: levels, active: ActiveNeighbours::default() }
    }

    /// Activates the resolutions from `finest` to the coarsest and searches outdated ones.
    ///
    /// Returns whether the neighbours changed.
    pub(super) fn update(&mut self, finest: usize, scene: &Scene, matcher: &Matcher, count: usize) -> bool {
        let mut changed = self.finest != finest;
        for (level, found) in self.levels.iter_mut().enumerate().skip(finest) {
            let edge_m = matcher.finest_voxel_m * f64::from(1_u32 << level);
            if found.as_ref().is_none_or(|found| found.moved_m > MAX_MOTION_EDGES * edge_m) {
                *found = Some(LevelNeighbours { pairs: search_level(level, scene, matcher, count), moved_m: 0.0 });
                changed = true;
            }
        }
        if changed {
            self.finest = finest;
            let pairs = self.levels[finest..].iter().flatten().flat_map(|found| &found.pairs).copied();
            self.active = ActiveNeighbours::of(pairs, scene);
        }
        changed
    }

    /// Records that surfels moved by at most `by_m`.
    pub(super) fn add_motion(&mut self, by_m: f64) {
        self.levels.iter_mut().flatten().for_each(|found| found.moved_m += by_m);
    }
}

impl ActiveNeighbours {
    fn of(pairs: impl Iterator<Item = (u32, u32)>, scene: &Scene) -> Self {
        let bins = |(i, j): (u32, u32)| (scene.bins[i as usize], scene.bins[j as usize]);
        let mut pairs: Vec<((u32, u32), (u32, u32))> = pairs.map(|pair| (bins(pair), pair)).collect();
        pairs.par_sort_unstable();
        let mut runs = Vec::new();
        let mut from = 0;
        for k in 1..=pairs.len() {
            if k == pairs.len() || pairs[k].0 != pairs[from].0 {
                runs.push(from..k);
                from = k;
            }
        }
        let mut counts = vec![0; scene.patches.len()];
        for (_, (i, j)) in &pairs {
            counts[*i as usize] += 1;
            counts[*j as usize] += 1;
        }
        Self { pairs: pairs.into_iter().map(|(_, pair)| pair).collect(), runs, counts }
    }
}

/// Searches the reciprocal neighbours of one resolution in every pair of submaps.
fn search_level(level: usize, scene: &Scene, matcher: &Matcher, count: usize) -> Vec<(u32, u32)> {
    let index = |submap: &Range<usize>| {
        let members: Vec<u32> = submap.clone().filter(|k| scene.patches[*k].level == level).map(|k| k as u32).collect();
        let patches: Vec<Patch> = members.iter().map(|k| scene.patches[*k as usize]).collect();
        let trees = matcher.build_trees(&patches);
        SubmapIndex { members, patches, trees }
    };
    let indices: Vec<SubmapIndex> = scene.submaps.par_iter().map(index).collect();
    let between = |(a, b): &(usize, usize)| {
        let (a, b) = (&indices[*a], &indices[*b]);
        let back: Vec<Vec<u32>> = b.patches.iter().map(|patch| matcher.neighbours(&a.trees, patch, count)).collect();
        let mut found = Vec::new();
        for (i, patch) in a.patches.iter().enumerate() {
            for j in matcher.neighbours(&b.trees, patch, count) {
                let pair = (a.members[i], b.members[j as usize]);
                let time_difference_s = scene.time_difference_s(pair.0 as usize, pair.1 as usize);
                if back[j as usize].contains(&(i as u32)) && time_difference_s >= matcher.spec.min_time_difference_s {
                    found.push(pair);
                }
            }
        }
        found
    };
    scene.pairs.par_iter().map(between).flatten_iter().collect()
}
