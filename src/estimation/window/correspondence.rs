//! Which of the window's surfels show what others show, or what a fixed view shows.

use super::{Stretch, Window};
use crate::estimation::matching::Matcher;
use crate::estimation::residual::matched::Plane;
use crate::estimation::surfel::{Patch, Placed, Surfel};
use crate::estimation::views::Views;
use crate::geometry::Vector;
use rayon::prelude::*;

/// Neighbours are looked for again when a surfel may have moved by this since, m: by less, they hardly change.
const MOVED_M: f64 = 0.02;
/// Surfaces match from so many times farther off in a first window that was begun in motion, and behind a leap.
const GROPING: f64 = 3.0;
/// A normal leans when it does so by more than this multiple of its error.
const SIGNIFICANT: f64 = 4.0;

/// Which surfels may belong together, before anything is said of how far apart they are.
#[derive(Default)]
pub(super) struct Neighbours {
    /// Of the window: indices into the scene.
    pairs: Vec<(u32, u32)>,
    /// With views: a surfel of the scene, a view, a patch of the view.
    fixed: Vec<(u32, u32, u32)>,
    /// How many surfels there were.
    of: usize,
    /// How far surfels may have moved since, m.
    moved_m: f64,
}

/// Where a surfel was when it was last looked for in fixed views, and what was near it there. Views stand still, and a
/// surfel hardly moves once its stretch has been solved: so most are looked for once.
#[derive(Debug, Clone, Default)]
pub(super) struct Remembered {
    centre: Vector,
    /// By the views' numbers: indices of patches.
    near: Vec<(u64, Vec<u32>)>,
}

/// Two surfels of one surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Match {
    /// Index into the scene.
    pub a: u32,
    /// What it is matched with.
    pub with: With,
    /// The surface, its normal from the other surfel to `a`.
    pub plane: Plane,
}

/// What a live surfel is matched with.
#[derive(Debug, Clone, Copy)]
pub(super) enum With {
    /// Another of the window: an index into the scene.
    Live(u32),
    /// A patch of a fixed view.
    Fixed { view: u32, patch: u32 },
}

/// The matches of an iteration.
#[derive(Debug, Default)]
pub(super) struct Matches {
    pub all: Vec<Match>,
    /// The matches of each surfel of the scene that has any, by the span between knots in which it was seen.
    pub spans: Runs<i64>,
    /// Those of two live surfels, by the earlier and the later one's span.
    pub couplings: Runs<(i64, i64)>,
    /// Indices of the matches of each surfel of the scene, one surfel after the other.
    of_surfels: Vec<u32>,
    /// Where each surfel's begin in it, and where the last one's end.
    begins: Vec<usize>,
}

/// Indices in runs of one key each, in the order of keys.
#[derive(Debug)]
pub(super) struct Runs<K> {
    members: Vec<(K, u32)>,
    ends: Vec<usize>,
}

impl Match {
    /// The other surfel, where it is live too: an index into the scene.
    pub fn other(&self) -> Option<usize> {
        if let With::Live(b) = self.with { Some(b as usize) } else { None }
    }
}

impl<K: Ord> Runs<K> {
    fn of(mut members: Vec<(K, u32)>) -> Self {
        members.sort_unstable();
        let ends = members.chunk_by(|a, b| a.0 == b.0).scan(0, |end, run| {
            *end += run.len();
            Some(*end)
        });
        Self { ends: ends.collect(), members }
    }
}

impl<K> Default for Runs<K> {
    fn default() -> Self {
        Self { members: Vec::new(), ends: Vec::new() }
    }
}

impl<K: Copy + Send + Sync> Runs<K> {
    /// Each run's key and indices.
    pub fn par_iter(&self) -> impl IndexedParallelIterator<Item = (K, impl Iterator<Item = usize>)> {
        (0..self.ends.len()).into_par_iter().map(|k| {
            let from = k.checked_sub(1).map_or(0, |before| self.ends[before]);
            let run = &self.members[from..self.ends[k]];
            (run[0].0, run.iter().map(|(_, index)| *index as usize))
        })
    }
}

impl Matches {
    fn of(all: Vec<Match>, scene: &[Placed]) -> Self {
        let mut begins = vec![0; scene.len() + 1];
        let sides = |one: &Match| [Some(one.a as usize), one.other()];
        for surfel in all.iter().flat_map(sides).flatten() {
            begins[surfel + 1] += 1;
        }
        for surfel in 0..scene.len() {
            begins[surfel + 1] += begins[surfel];
        }
        let mut next = begins.clone();
        let mut of_surfels = vec![0; begins[scene.len()]];
        for (index, one) in all.iter().enumerate() {
            for surfel in sides(one).into_iter().flatten() {
                of_surfels[next[surfel]] = index as u32;
                next[surfel] += 1;
            }
        }
        let span = |surfel: usize| scene[surfel].basis.first;
        let matched = (0..scene.len()).filter(|surfel| begins[*surfel] < begins[surfel + 1]);
        let spans = Runs::of(matched.map(|surfel| (span(surfel), surfel as u32)).collect());
        let coupled = all.iter().enumerate().filter_map(|(index, one)| {
            let (a, b) = (span(one.a as usize), span(one.other()?));
            Some(((a.min(b), a.max(b)), index as u32))
        });
        Self { spans, couplings: Runs::of(coupled.collect()), all, of_surfels, begins }
    }

    /// The matches of a surfel of the scene: indices into all.
    pub fn of_surfel(&self, surfel: usize) -> &[u32] {
        &self.of_surfels[self.begins[surfel]..self.begins[surfel + 1]]
    }

    pub fn planes(&self) -> impl Iterator<Item = &Plane> {
        self.all.iter().map(|one| &one.plane)
    }
}

impl Neighbours {
    /// The surfels have moved by at most `by_m`.
    pub fn moved(&mut self, by_m: f64) {
        self.moved_m += by_m;
    }

    /// Whether they need not be looked for again.
    pub fn are_good_for(&self, scene: &[Placed]) -> bool {
        self.of == scene.len() && self.moved_m < MOVED_M
    }
}

impl Window {
    /// The window's surfels in the map; those that a change of clock has moved out of the window's knots stay out.
    pub(super) fn scene(&self) -> Vec<Placed> {
        let placing = self.placing();
        let homes = self.homes();
        homes
            .par_iter()
            .with_min_len(512)
            .map(|(k, index)| self.stretches[*k].surfels[*index].place(&placing))
            .collect()
    }

    /// Where the surfels of the scene are at home: a stretch, and an index into its surfels.
    fn homes(&self) -> Vec<(usize, usize)> {
        let (from, to) = (self.start.u_s, self.nominal.end_s());
        let is_within = |surfel: &Surfel| (from..=to).contains(&self.clock.imu_s(surfel.tau_s));
        let of_stretch = |(k, stretch): (usize, &'_ Stretch)| {
            let within = stretch.surfels.iter().enumerate().filter(|(_, surfel)| is_within(surfel));
            within.map(|(index, _)| (k, index)).collect::<Vec<_>>()
        };
        self.stretches.iter().enumerate().flat_map(of_stretch).collect()
    }

    /// Those `neighbours` in `scene` that match.
    pub(super) fn match_up(
        &self,
        scene: &[Placed],
        views: &Views,
        neighbours: &Neighbours,
        iteration: usize,
    ) -> Matches {
        let wider = if self.gropes || self.leapt { GROPING } else { 1.0 };
        let gate_m = wider * self.spec.matching.max_plane_distance_m * if iteration == 0 { 3.0 } else { 1.5 };
        let sigma_m = self.spec.solve.match_sigma_m;
        let plane = |a: u32, other: &Patch| {
            let patch = &scene[a as usize].patch;
            self.matcher.agree(patch, other, gate_m).then(|| Plane::of(patch, other, sigma_m))
        };
        let live = |(a, b): &(u32, u32)| {
            let plane = plane(*a, &scene[*b as usize].patch)?;
            Some(Match { a: *a, with: With::Live(*b), plane })
        };
        let fixed = |(a, view, patch): &(u32, u32, u32)| {
            let plane = plane(*a, &views.view(*view as usize).patches[*patch as usize])?;
            Some(Match { a: *a, with: With::Fixed { view: *view, patch: *patch }, plane })
        };
        let mut all: Vec<Option<Match>> = neighbours.pairs.par_iter().with_min_len(512).map(live).collect();
        all.par_extend(neighbours.fixed.par_iter().with_min_len(512).map(fixed));
        Matches::of(all.into_iter().flatten().collect(), scene)
    }

    /// Normals that lean to `direction` by no more than they may err lean no more: together, such errors would pass for
    /// knowledge, and hold the head back.
    pub(super) fn straighten(&self, matches: &mut Matches, scene: &[Placed], views: &Views, direction: &Vector) {
        for Match { a, with, plane } in &mut matches.all {
            let other = match *with {
                With::Live(b) => &scene[b as usize].patch,
                With::Fixed { view, patch } => &views.view(view as usize).patches[patch as usize],
            };
            let variance = scene[*a as usize].patch.variance_of_lean(direction) + other.variance_of_lean(direction);
            if plane.normal.dot(direction).abs() < SIGNIFICANT * variance.sqrt() {
                plane.forget(direction);
            }
        }
    }

    /// The neighbours in `scene` and in the `chosen` views.
    pub(super) fn look_around(&mut self, scene: &[Placed], (views, chosen): (&Views, &[usize])) -> Neighbours {
        let patches: Vec<Patch> = scene.iter().map(|surfel| surfel.patch).collect();
        let pairs = self.matcher.among(scene, &self.matcher.plant(&patches));
        let homes = self.homes();
        let mut remembered: Vec<Remembered> =
            homes.iter().map(|(k, index)| std::mem::take(&mut self.stretches[*k].remembered[*index])).collect();
        let look = |(a, (patch, remembered)): (usize, (&Patch, &mut Remembered))| {
            remembered.look(patch, (views, chosen), &self.matcher, self.spec.views.neighbours);
            let near = |index: &usize| {
                let found = remembered.near_in(views.view(*index).number);
                found.iter().map(|patch| (a as u32, *index as u32, *patch)).collect::<Vec<_>>()
            };
            chosen.iter().flat_map(near).collect::<Vec<_>>()
        };
        let both = patches.par_iter().zip(remembered.par_iter_mut()).enumerate();
        let fixed: Vec<_> = both.with_min_len(256).map(look).collect();
        for ((k, index), remembered) in homes.into_iter().zip(remembered) {
            self.stretches[k].remembered[index] = remembered;
        }
        Neighbours { pairs, fixed: fixed.into_iter().flatten().collect(), of: scene.len(), moved_m: 0.0 }
    }
}

impl Remembered {
    /// Looks for `patch` in the `chosen` views, where that has not been done from about here.
    fn look(&mut self, patch: &Patch, (views, chosen): (&Views, &[usize]), matcher: &Matcher, count: usize) {
        let is_chosen = |number: u64| chosen.iter().any(|index| views.view(*index).number == number);
        let moved = (patch.centre - self.centre).norm() > MOVED_M;
        self.near.retain(|(number, _)| !moved && is_chosen(*number));
        if self.near.is_empty() {
            self.centre = patch.centre;
        }
        for view in chosen.iter().map(|index| views.view(*index)) {
            if self.near.iter().all(|(number, _)| *number != view.number) {
                self.near.push((view.number, matcher.neighbours(&view.forest, patch, count)));
            }
        }
    }

    /// What was near in the view of a number.
    fn near_in(&self, view: u64) -> &[u32] {
        self.near.iter().find(|(number, _)| *number == view).map_or(&[], |(_, near)| near)
    }
}
