//! Which surfels of two chapters may show the same, resolution by resolution.

use super::scene::Scene;
use crate::estimation::matching::{Forest, Matcher};
use crate::estimation::surfel::Patch;
use rayon::prelude::*;
use std::ops::Range;

/// Neighbours are looked for again when surfels may have moved by this fraction of their edges since.
const MOVED_EDGES: f64 = 0.05;

/// Neighbours among the surfels of each resolution.
#[derive(Debug)]
pub(super) struct Neighbours {
    /// Of each resolution, once they were looked for.
    levels: Vec<Option<Found>>,
    finest: usize,
    pub(super) in_use: InUse,
}

/// The neighbours of one resolution.
#[derive(Debug)]
struct Found {
    pairs: Vec<(u32, u32)>,
    /// How far the surfels may have moved since, m.
    moved_m: f64,
}

/// The neighbours of the resolutions in use.
#[derive(Debug, Default)]
pub(super) struct InUse {
    /// Pairs of surfels `(i, j)`, `i < j`, by the slots in which the two were seen.
    pub(super) pairs: Vec<(u32, u32)>,
    /// Where they are of the same two slots.
    pub(super) runs: Vec<Range<usize>>,
    /// How many neighbours each surfel has.
    pub(super) counts: Vec<u32>,
}

/// A chapter's surfels of one resolution.
struct Shelf {
    members: Vec<u32>,
    patches: Vec<Patch>,
    forest: Forest,
}

impl Neighbours {
    /// Nobody has looked for any yet, at any of `levels` resolutions.
    pub(super) fn unknown(levels: usize) -> Self {
        Self { levels: (0..levels).map(|_| None).collect(), finest: levels, in_use: InUse::default() }
    }

    /// Uses those of the resolutions from `finest` on, and looks for them where need be; whether they have changed.
    pub(super) fn use_from(&mut self, finest: usize, scene: &Scene, matcher: &Matcher, count: usize) -> bool {
        let mut changed = self.finest != finest;
        for (level, found) in self.levels.iter_mut().enumerate().skip(finest) {
            let edge_m = matcher.finest_voxel_m * f64::from(1_u32 << level);
            if found.as_ref().is_none_or(|found| found.moved_m > MOVED_EDGES * edge_m) {
                *found = Some(Found { pairs: look_around(level, scene, matcher, count), moved_m: 0.0 });
                changed = true;
            }
        }
        if changed {
            self.finest = finest;
            let pairs = self.levels[finest..].iter().flatten().flat_map(|found| &found.pairs).copied().collect();
            self.in_use = InUse::of(pairs, scene);
        }
        changed
    }

    /// Surfels have moved by at most `by_m`.
    pub(super) fn moved(&mut self, by_m: f64) {
        self.levels.iter_mut().flatten().for_each(|found| found.moved_m += by_m);
    }
}

impl InUse {
    fn of(mut pairs: Vec<(u32, u32)>, scene: &Scene) -> Self {
        let slots = |(i, j): &(u32, u32)| (scene.slots[*i as usize], scene.slots[*j as usize]);
        pairs.par_sort_unstable_by_key(|pair| (slots(pair), *pair));
        let mut runs = Vec::new();
        let mut from = 0;
        for k in 1..=pairs.len() {
            if k == pairs.len() || slots(&pairs[k]) != slots(&pairs[from]) {
                runs.push(from..k);
                from = k;
            }
        }
        let mut counts = vec![0; scene.patches.len()];
        for (i, j) in &pairs {
            counts[*i as usize] += 1;
            counts[*j as usize] += 1;
        }
        Self { pairs, runs, counts }
    }
}

/// Neighbours of one resolution, found from both sides, in every pair of chapters.
fn look_around(level: usize, scene: &Scene, matcher: &Matcher, count: usize) -> Vec<(u32, u32)> {
    let shelf = |chapter: &Range<usize>| {
        let members: Vec<u32> =
            chapter.clone().filter(|k| scene.patches[*k].level == level).map(|k| k as u32).collect();
        let patches: Vec<Patch> = members.iter().map(|k| scene.patches[*k as usize]).collect();
        let forest = matcher.plant(&patches);
        Shelf { members, patches, forest }
    };
    let shelves: Vec<Shelf> = scene.chapters.par_iter().map(shelf).collect();
    let between = |(a, b): &(usize, usize)| {
        let (a, b) = (&shelves[*a], &shelves[*b]);
        let back: Vec<Vec<u32>> = b.patches.iter().map(|patch| matcher.neighbours(&a.forest, patch, count)).collect();
        let mut found = Vec::new();
        for (i, patch) in a.patches.iter().enumerate() {
            for j in matcher.neighbours(&b.forest, patch, count) {
                let pair = (a.members[i], b.members[j as usize]);
                let apart_s = scene.apart_s((pair.0 as usize, pair.1 as usize));
                if back[j as usize].contains(&(i as u32)) && apart_s >= matcher.spec.min_time_difference_s {
                    found.push(pair);
                }
            }
        }
        found
    };
    scene.pairs.par_iter().map(between).flatten_iter().collect()
}
