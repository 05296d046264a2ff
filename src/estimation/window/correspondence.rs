//! Surfel matching: pairs within the window, and window surfels with patches of the fixed views.

use crate::matching::Matcher;
use crate::residual::matched::Plane;
use crate::surfel::{Patch, PlacedSurfel};
use crate::views::Views;
use rayon::prelude::*;
use zsim_base::geometry::Vector;

/// The neighbour search is repeated when a surfel may have moved by this, m; smaller motion hardly changes the result.
const SEARCH_MOTION_M: f64 = 0.02;

/// Candidate pairs of surfels, before the distance gate.
#[derive(Default)]
pub(super) struct Neighbours {
    /// Within the window: indices into the scene.
    pub pairs: Vec<(u32, u32)>,
    /// With views: a surfel of the scene, a view, a patch of the view.
    pub fixed: Vec<(u32, u32, u32)>,
    /// Number of surfels in the scene at the time of the search.
    pub scene_len: usize,
    /// Upper bound on the motion of any surfel since the search, m.
    pub moved_m: f64,
}

/// Cached fixed-view neighbours of a surfel, and the position at which they were searched.
///
/// Views do not move, and a surfel moves little after the first solutions, so most surfels are searched once.
#[derive(Debug, Clone, Default)]
pub(super) struct CachedNeighbours {
    centre: Vector,
    /// By view number: indices of the neighbouring patches.
    found: Vec<(u64, Vec<u32>)>,
}

/// Two surfels of one surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Match {
    /// Index into the scene.
    pub a: u32,
    /// The other side of the match.
    pub with: Counterpart,
    /// The surface, its normal from the other surfel to `a`.
    pub plane: Plane,
}

/// The other side of a match of a live surfel.
#[derive(Debug, Clone, Copy)]
pub(super) enum Counterpart {
    /// Another surfel of the window: an index into the scene.
    Live(u32),
    /// A patch of a fixed view: indices of both.
    Fixed { view: u32, patch: u32 },
}

/// The matches of an iteration.
#[derive(Debug, Default)]
pub(super) struct Matches {
    pub all: Vec<Match>,
    /// The matched surfels of the scene, by the span between knots in which they were measured.
    pub spans: Grouped<i64>,
    /// The matches of two live surfels, by the spans of the earlier and the later one.
    pub couplings: Grouped<(i64, i64)>,
    /// Indices of the matches of each surfel of the scene, one surfel after the other.
    of_surfels: Vec<u32>,
    /// Offset of each surfel's first match in `of_surfels`, then the offset of the end.
    offsets: Vec<usize>,
}

/// Indices in runs of one key each, in the order of keys.
#[derive(Debug)]
pub(super) struct Grouped<K> {
    members: Vec<(K, u32)>,
    ends: Vec<usize>,
}

impl Match {
    /// Returns the other surfel if it is live: an index into the scene.
    pub fn other(&self) -> Option<usize> {
        if let Counterpart::Live(b) = self.with { Some(b as usize) } else { None }
    }
}

impl<K: Ord> Grouped<K> {
    fn of(mut members: Vec<(K, u32)>) -> Self {
        members.sort_unstable();
        let ends = members.chunk_by(|a, b| a.0 == b.0).scan(0, |end, run| {
            *end += run.len();
            Some(*end)
        });
        Self { ends: ends.collect(), members }
    }
}

impl<K> Default for Grouped<K> {
    fn default() -> Self {
        Self { members: Vec::new(), ends: Vec::new() }
    }
}

impl<K: Copy + Send + Sync> Grouped<K> {
    /// Iterates over the key and the indices of each run.
    pub fn par_iter(&self) -> impl IndexedParallelIterator<Item = (K, impl Iterator<Item = usize>)> {
        (0..self.ends.len()).into_par_iter().map(|k| {
            let from = k.checked_sub(1).map_or(0, |before| self.ends[before]);
            let run = &self.members[from..self.ends[k]];
            (run[0].0, run.iter().map(|(_, index)| *index as usize))
        })
    }
}

impl Matches {
    pub fn of(all: Vec<Match>, scene: &[PlacedSurfel]) -> Self {
        let mut offsets = vec![0; scene.len() + 1];
        let sides = |one: &Match| [Some(one.a as usize), one.other()];
        for surfel in all.iter().flat_map(sides).flatten() {
            offsets[surfel + 1] += 1;
        }
        for surfel in 0..scene.len() {
            offsets[surfel + 1] += offsets[surfel];
        }
        let mut next = offsets.clone();
        let mut of_surfels = vec![0; offsets[scene.len()]];
        for (index, one) in all.iter().enumerate() {
            for surfel in sides(one).into_iter().flatten() {
                of_surfels[next[surfel]] = index as u32;
                next[surfel] += 1;
            }
        }
        let span = |surfel: usize| scene[surfel].basis.first;
        let matched = (0..scene.len()).filter(|surfel| offsets[*surfel] < offsets[surfel + 1]);
        let spans = || Grouped::of(matched.map(|surfel| (span(surfel), surfel as u32)).collect());
        let coupled = all.iter().enumerate().filter_map(|(index, one)| {
            let (a, b) = (span(one.a as usize), span(one.other()?));
            Some(((a.min(b), a.max(b)), index as u32))
        });
        let (spans, couplings) = rayon::join(spans, || Grouped::of(coupled.collect()));
        Self { spans, couplings, all, of_surfels, offsets }
    }

    /// Returns the matches of a surfel of the scene: indices into `all`.
    pub fn of_surfel(&self, surfel: usize) -> &[u32] {
        &self.of_surfels[self.offsets[surfel]..self.offsets[surfel + 1]]
    }

    pub fn planes(&self) -> impl Iterator<Item = &Plane> + Clone {
        self.all.iter().map(|one| &one.plane)
    }
}

impl Neighbours {
    /// Records that the surfels have moved by at most `by_m`.
    pub fn moved(&mut self, by_m: f64) {
        self.moved_m += by_m;
    }

    /// Whether the neighbours are still valid for `scene`.
    pub fn are_valid_for(&self, scene: &[PlacedSurfel]) -> bool {
        self.scene_len == scene.len() && self.moved_m < SEARCH_MOTION_M
    }
}

impl CachedNeighbours {
    /// Updates the neighbours of `patch` in the `chosen` views.
    ///
    /// Views searched from about this position stay cached.
    pub fn update(&mut self, patch: &Patch, views: &Views, chosen: &[usize], matcher: &Matcher, count: usize) {
        let is_chosen = |number: u64| chosen.iter().any(|index| views.view(*index).number == number);
        let moved = (patch.centre - self.centre).norm() > SEARCH_MOTION_M;
        self.found.retain(|(number, _)| !moved && is_chosen(*number));
        if self.found.is_empty() {
            self.centre = patch.centre;
        }
        for view in chosen.iter().map(|index| views.view(*index)) {
            if self.found.iter().all(|(number, _)| *number != view.number) {
                self.found.push((view.number, matcher.neighbours(&view.trees, patch, count)));
            }
        }
    }

    /// Returns the cached neighbours in the view with number `view`.
    pub fn found_in(&self, view: u64) -> &[u32] {
        self.found.iter().find(|(number, _)| *number == view).map_or(&[], |(_, patches)| patches)
    }
}
