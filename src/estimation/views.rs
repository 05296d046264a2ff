//! Fixed views: stretches of the past whose surfels stand still in the map, for the window's surfels to match.
//!
//! A stretch that left the window is kept when it shows cells that the kept ones do not. Of those kept, a window uses
//! the few that cover most of what it sees now, and the oldest of about equal ones: an old view has drifted less.

use super::matching::{Forest, Matcher};
use super::spec::ViewSpec;
use super::surfel::{Patch, Placed};
use crate::geometry::Vector;

/// Edge of the cells by which views are compared, m.
const CELL_M: f64 = 1.0;
/// An older view is preferred when it adds at least this fraction of what the best one adds.
const OLDER_VIEW_RATIO: f64 = 0.7;
/// A view that adds less than this fraction of the window's cells is not worth its matches.
const MIN_ADDED_FRACTION: f64 = 0.02;

/// The number of the view that is a map.
pub(super) const MAP: u64 = u64::MAX;

/// A stretch of the past, or a map.
#[derive(Debug)]
pub(super) struct View {
    pub(super) patches: Vec<Patch>,
    pub(super) forest: Forest,
    cells: Vec<u64>,
    /// Its number, counted from the first view kept.
    pub(super) number: u64,
    /// About what its errors turn: where the IMU was when it was kept, m.
    pub(super) pivot: Vector,
}

/// What became of a stretch's patches.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ViewUpdate {
    /// The number of the view that was kept.
    pub(super) added: Option<u64>,
    /// The number of the one removed for it.
    pub(super) removed: Option<u64>,
}

/// The views kept, and the stretch that may become the next one.
#[derive(Debug)]
pub(super) struct Views {
    spec: ViewSpec,
    max_active: usize,
    kept: Vec<View>,
    gathering: Vec<Patch>,
    gathered_s: f64,
    next: u64,
}

impl Views {
    pub(super) fn new(spec: &ViewSpec, max_active: usize) -> Self {
        Self { spec: spec.clone(), max_active, kept: Vec::new(), gathering: Vec::new(), gathered_s: 0.0, next: 0 }
    }

    /// The same views, and a map, which every window matches and which is never removed.
    pub(super) fn with_map(mut self, patches: &[Patch], matcher: &Matcher, pivot: Vector) -> Self {
        let (forest, cells) = (matcher.plant(patches), cells_of(patches.iter()));
        self.kept.insert(0, View { patches: patches.to_vec(), forest, cells, number: MAP, pivot });
        self
    }

    /// How many of those kept are a map: the first, or none.
    fn maps(&self) -> usize {
        usize::from(self.kept.first().is_some_and(|view| view.number == MAP))
    }

    /// Takes the patches of a stretch of `seconds` that has left the window, the IMU being at `pivot` in the end.
    pub(super) fn add_segment(
        &mut self,
        patches: &[Patch],
        seconds: f64,
        (matcher, pivot): (&Matcher, Vector),
    ) -> ViewUpdate {
        if self.max_active == 0 {
            return ViewUpdate::default();
        }
        self.gathering.extend(patches);
        self.gathered_s += seconds;
        if self.gathered_s < self.spec.length_s - 1e-9 {
            return ViewUpdate::default();
        }
        self.gathered_s = 0.0;
        let patches = std::mem::take(&mut self.gathering);
        let cells = cells_of(patches.iter());
        let mut seen = cells.clone();
        for view in &self.kept {
            remove(&mut seen, &view.cells);
        }
        let covered = 1.0 - seen.len() as f64 / cells.len().max(1) as f64;
        if cells.is_empty() || covered >= self.spec.keep_below_coverage {
            return ViewUpdate::default();
        }
        let removed =
            if self.kept.len() - self.maps() >= self.spec.max_kept { self.remove_most_redundant() } else { None };
        let (forest, number) = (matcher.plant(&patches), self.next);
        self.next += 1;
        self.kept.push(View { patches, forest, cells, number, pivot });
        ViewUpdate { added: Some(number), removed }
    }

    /// Forgets the view whose cells the others cover best; the first such. Its number.
    fn remove_most_redundant(&mut self) -> Option<u64> {
        let own = |index: usize| {
            let mut cells = self.kept[index].cells.clone();
            for (other, view) in self.kept.iter().enumerate() {
                if other != index {
                    remove(&mut cells, &view.cells);
                }
            }
            cells.len()
        };
        let least = (self.maps()..self.kept.len()).min_by_key(|index| own(*index))?;
        Some(self.kept.remove(least).number)
    }

    /// The views to use for a window that sees `placed`: indices into [`Views::view`].
    pub(super) fn select(&self, placed: &[Placed]) -> Vec<usize> {
        let mut missing = cells_of(placed.iter().map(|surfel| &surfel.patch));
        let worthwhile = ((missing.len() as f64 * MIN_ADDED_FRACTION) as usize).max(1);
        let mut chosen: Vec<usize> = (0..self.maps()).collect();
        chosen.iter().for_each(|map| remove(&mut missing, &self.kept[*map].cells));
        let most = self.maps() + self.max_active.min(self.kept.len() - self.maps());
        while chosen.len() < most {
            let adds: Vec<usize> = self.kept.iter().map(|view| common(&missing, &view.cells)).collect();
            let best = adds.iter().copied().max().unwrap_or(0);
            if best < worthwhile {
                break;
            }
            let enough = (best as f64 * OLDER_VIEW_RATIO) as usize;
            let Some(oldest) = adds.iter().position(|count| *count >= enough.max(worthwhile)) else { break };
            remove(&mut missing, &self.kept[oldest].cells);
            chosen.push(oldest);
        }
        chosen
    }

    /// All that the views show.
    pub(super) fn patches(&self) -> impl Iterator<Item = &Patch> {
        self.kept.iter().flat_map(|view| &view.patches)
    }

    pub(super) fn view(&self, index: usize) -> &View {
        &self.kept[index]
    }
}

/// The cells in which patches lie, sorted; the side from which they are seen counts.
pub(super) fn cells_of<'a>(patches: impl Iterator<Item = &'a Patch>) -> Vec<u64> {
    let part = |x: f64| (((x / CELL_M).floor() as i64).wrapping_add(1 << 19)) as u64 & 0xf_ffff;
    let facing = |patch: &Patch| {
        let axis = patch.normal.iamax();
        (axis * 2 + usize::from(patch.normal[axis] > 0.0)) as u64
    };
    let mut cells: Vec<u64> = patches
        .map(|patch| {
            let centre = patch.centre;
            facing(patch) << 60 | part(centre.x) << 40 | part(centre.y) << 20 | part(centre.z)
        })
        .collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

/// How many cells two sorted lists have in common.
fn common(a: &[u64], b: &[u64]) -> usize {
    let (mut i, mut j, mut count) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        match a[i].cmp(&b[j]) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                (i, j, count) = (i + 1, j + 1, count + 1);
            }
        }
    }
    count
}

/// Removes from a sorted list what another has.
fn remove(from: &mut Vec<u64>, others: &[u64]) {
    from.retain(|cell| others.binary_search(cell).is_err());
}
