//! Surfel matching: pairs within the window, and window surfels with patches of the fixed views.

use crate::layout::Layout;
use crate::matching::Matcher;
use crate::residual::matched::Plane;
use crate::surfel::{Patch, PlacedSurfel};
use crate::views::Views;
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
    /// The matches of each surfel of the scene.
    pub of_surfels: Grouped,
    /// The matched surfels of the scene, by the span between knots in which they were measured.
    pub spans: Grouped,
    /// The matches of two live surfels, by the spans of the earlier and the later one: see [`Matches::pair`].
    pub couplings: Grouped,
    /// Index of the first knot, and number of spans.
    knots: (i64, usize),
}

/// Indices in groups, one for each key from 0 on.
#[derive(Debug, Default)]
pub(super) struct Grouped {
    /// The indices, one group after the other.
    members: Vec<u32>,
    /// Offset of each group in the members, then the offset of the end.
    offsets: Vec<usize>,
}

impl Match {
    /// Returns the other surfel if it is live: an index into the scene.
    pub fn other(&self) -> Option<usize> {
        if let Counterpart::Live(b) = self.with { Some(b as usize) } else { None }
    }
}

impl Grouped {
    /// Groups the indices of `keyed` by their keys, which are below `keys`; in a group they keep their order.
    fn of(keyed: impl Iterator<Item = (usize, u32)> + Clone, keys: usize) -> Self {
        let mut offsets = vec![0; keys + 1];
        keyed.clone().for_each(|(key, _)| offsets[key + 1] += 1);
        (0..keys).for_each(|key| offsets[key + 1] += offsets[key]);
        let (mut next, mut members) = (offsets.clone(), vec![0; offsets[keys]]);
        for (key, index) in keyed {
            members[next[key]] = index;
            next[key] += 1;
        }
        Self { members, offsets }
    }

    /// Returns the keys that have indices, in order.
    pub fn used(&self) -> Vec<usize> {
        (1..self.offsets.len()).map(|end| end - 1).filter(|key| !self.group(*key).is_empty()).collect()
    }

    /// Returns the indices of a key.
    pub fn group(&self, key: usize) -> &[u32] {
        &self.members[self.offsets[key]..self.offsets[key + 1]]
    }
}

impl Matches {
    /// Groups the matches of `scene`, of which all surfels are between the knots of `layout`.
    pub fn of(all: Vec<Match>, scene: &[PlacedSurfel], layout: &Layout) -> Self {
        let knots @ (first, count) = (layout.first_knot, layout.knots - 3);
        let span_of: Vec<usize> = scene.iter().map(|surfel| (surfel.basis.first - first) as usize).collect();
        let numbered = || (0..).zip(&all);
        let sides = |(index, one): (u32, &Match)| {
            let surfels = [Some(one.a as usize), one.other()];
            surfels.into_iter().flatten().map(move |surfel| (surfel, index))
        };
        let coupled = |(index, one): (u32, &Match)| {
            let (a, b) = (span_of[one.a as usize], span_of[one.other()?]);
            Some((a.min(b) * count + a.max(b), index))
        };
        let of_surfels = Grouped::of(numbered().flat_map(sides), scene.len());
        let matched = of_surfels.used().into_iter().map(|surfel| (span_of[surfel], surfel as u32));
        let spans = Grouped::of(matched, count);
        let couplings = Grouped::of(numbered().filter_map(coupled), count * count);
        Self { all, of_surfels, spans, couplings, knots }
    }

    /// Returns the first knots of the earlier and the later span of a key of the couplings.
    pub fn pair(&self, key: usize) -> (i64, i64) {
        (self.span(key / self.knots.1), self.span(key % self.knots.1))
    }

    /// Returns the first knot of a key of the spans.
    pub fn span(&self, key: usize) -> i64 {
        self.knots.0 + key as i64
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
