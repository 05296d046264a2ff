//! Search for the matches of the window's surfels.

use super::correspondence::{CachedNeighbours, Counterpart, Match, Matches, Neighbours};
use super::{Window, WindowSegment};
use crate::residual::matched::Plane;
use crate::surfel::{Patch, PlacedSurfel, Surfel};
use crate::views::Views;
use rayon::prelude::*;
use zsim_base::geometry::Vector;

/// Widening of the match gate in a first window that starts in motion, and after a bridged gap.
const WIDE_GATE: f64 = 3.0;

/// Candidates that a thread takes at once.
const CANDIDATES: usize = 1024;

/// A tilt of a normal is significant above this multiple of the standard deviation.
const SIGNIFICANT_SIGMAS: f64 = 4.0;

impl Window {
    /// The window's surfels in the map frame, except surfels that a clock correction moved out of the window's knots.
    pub(super) fn scene(&self) -> Vec<PlacedSurfel> {
        let placing = self.placing();
        let surfel_indices = self.surfel_indices();
        surfel_indices
            .par_iter()
            .with_min_len(512)
            .map(|(k, index)| self.segments[*k].surfels[*index].place(&placing))
            .collect()
    }

    /// For each surfel of the scene: the segment, and the index into the surfels of that segment.
    fn surfel_indices(&self) -> Vec<(usize, usize)> {
        let (from, to) = (self.start.u_s, self.nominal.end_s());
        let is_within = |surfel: &Surfel| (from..=to).contains(&self.unknowns.clock.trajectory_s(surfel.tau_s));
        let of_segment = |(k, segment): (usize, &'_ WindowSegment)| {
            let within = segment.surfels.iter().enumerate().filter(|(_, surfel)| is_within(surfel));
            within.map(|(index, _)| (k, index)).collect::<Vec<_>>()
        };
        self.segments.iter().enumerate().flat_map(of_segment).collect()
    }

    /// The `neighbours` in `scene` that pass the match gates.
    pub(super) fn match_up(
        &self,
        scene: &[PlacedSurfel],
        views: &Views,
        neighbours: &Neighbours,
        iteration: usize,
    ) -> Vec<Match> {
        let widening = if self.wide_matching || self.bridged_gap { WIDE_GATE } else { 1.0 };
        let gate_m = widening * self.spec.matching.max_plane_distance_m * if iteration == 0 { 3.0 } else { 1.5 };
        let sigma_m = self.spec.solve.match_sigma_m;
        let plane = |a: u32, other: &Patch| {
            let patch = &scene[a as usize].patch;
            self.matcher.pass_gates(patch, other, gate_m).then(|| Plane::of(patch, other, sigma_m))
        };
        // By chunks: most candidates fail a gate, and are not stored.
        let live = |pairs: &[(u32, u32)]| {
            let mut found = Vec::new();
            for (a, b) in pairs {
                let plane = plane(*a, &scene[*b as usize].patch);
                found.extend(plane.map(|plane| Match { a: *a, with: Counterpart::Live(*b), plane }));
            }
            found
        };
        let fixed = |candidates: &[(u32, u32, u32)]| {
            let mut found = Vec::new();
            for (a, view, patch) in candidates {
                let other = views.view(*view as usize).patch(*patch, &self.unknowns.lidar);
                let with = Counterpart::Fixed { view: *view, patch: *patch };
                found.extend(plane(*a, &other).map(|plane| Match { a: *a, with, plane }));
            }
            found
        };
        let live = neighbours.pairs.par_chunks(CANDIDATES).map(live);
        let found: Vec<Vec<Match>> = live.chain(neighbours.fixed.par_chunks(CANDIDATES).map(fixed)).collect();
        found.concat()
    }

    /// Removes the component along `direction` from normals whose tilt towards it is within the normal error.
    ///
    /// The sum of many such errors would otherwise count as information about the motion along `direction`.
    pub(super) fn remove_insignificant_tilt(
        &self,
        matches: &mut Matches,
        scene: &[PlacedSurfel],
        views: &Views,
        direction: &Vector,
    ) {
        for Match { a, with, plane } in &mut matches.all {
            let other = match *with {
                Counterpart::Live(b) => scene[b as usize].patch,
                Counterpart::Fixed { view, patch } => views.view(view as usize).patch(patch, &self.unknowns.lidar),
            };
            let variance =
                scene[*a as usize].patch.normal_tilt_variance(direction) + other.normal_tilt_variance(direction);
            if plane.normal.dot(direction).abs() < SIGNIFICANT_SIGMAS * variance.sqrt() {
                plane.remove_component(direction);
            }
        }
    }

    /// Searches the neighbours in `scene` and in the `chosen` views.
    pub(super) fn search_neighbours(&mut self, scene: &[PlacedSurfel], views: &Views, chosen: &[usize]) -> Neighbours {
        let patches: Vec<Patch> = scene.iter().map(|surfel| surfel.patch).collect();
        let pairs = self.matcher.neighbour_pairs(scene, &self.matcher.build_trees(&patches));
        let surfel_indices = self.surfel_indices();
        let mut cached: Vec<CachedNeighbours> =
            surfel_indices.iter().map(|(k, index)| std::mem::take(&mut self.segments[*k].cached[*index])).collect();
        let search = |(a, (patch, cached)): (usize, (&Patch, &mut CachedNeighbours))| {
            cached.update(patch, views, chosen, &self.matcher, self.spec.views.neighbours);
            let in_view = |index: &usize| {
                let patches = cached.found_in(views.view(*index).number);
                patches.iter().map(|patch| (a as u32, *index as u32, *patch)).collect::<Vec<_>>()
            };
            chosen.iter().flat_map(in_view).collect::<Vec<_>>()
        };
        let both = patches.par_iter().zip(cached.par_iter_mut()).enumerate();
        let fixed: Vec<_> = both.with_min_len(256).map(search).collect();
        for ((k, index), cached) in surfel_indices.into_iter().zip(cached) {
            self.segments[k].cached[index] = cached;
        }
        Neighbours { pairs, fixed: fixed.into_iter().flatten().collect(), scene_len: scene.len(), moved_m: 0.0 }
    }
}
