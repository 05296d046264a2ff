//! Fixed views (keyframes): surfels of past segments, fixed in the map, with which the window is matched.
//!
//! Segments that left the window become a view if they cover cells that the stored views do not. A window uses the few
//! views that cover most of its cells. Of about equal ones it uses the oldest, which has drifted least.

use super::matching::{Matcher, SearchTrees};
use super::spec::ViewSpec;
use super::surfel::{Patch, PlacedSurfel};
use crate::geometry::Vector;

/// Edge length of the cells with which the coverage of views is compared, m.
const CELL_M: f64 = 1.0;
/// An older view is preferred if it adds at least this fraction of the cells that the best one adds.
const OLDER_VIEW_RATIO: f64 = 0.7;
/// Minimum fraction of the cells of the window that a view must add to be used.
const MIN_ADDED_FRACTION: f64 = 0.02;

/// View number of the given map.
pub(super) const MAP: u64 = u64::MAX;

/// A fixed view, or a given map.
#[derive(Debug)]
pub(super) struct View {
    pub(super) patches: Vec<Patch>,
    pub(super) trees: SearchTrees,
    cells: Vec<u64>,
    /// View number, in order of storage.
    pub(super) number: u64,
    /// Reference point of the rotation error: the IMU position when the view was stored, m.
    pub(super) pivot: Vector,
}

/// Change of the stored views.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ViewUpdate {
    /// Number of the new view, if any.
    pub(super) added: Option<u64>,
    /// Number of the view removed in exchange, if any.
    pub(super) removed: Option<u64>,
}

/// The stored views, and the segments collected for the next one.
#[derive(Debug)]
pub(super) struct Views {
    spec: ViewSpec,
    max_active: usize,
    stored: Vec<View>,
    gathering: Vec<Patch>,
    gathered_s: f64,
    next: u64,
}

impl Views {
    pub(super) fn new(spec: &ViewSpec, max_active: usize) -> Self {
        Self { spec: spec.clone(), max_active, stored: Vec::new(), gathering: Vec::new(), gathered_s: 0.0, next: 0 }
    }

    /// Adds a given map, with which every window is matched and which is never removed.
    pub(super) fn with_map(mut self, patches: &[Patch], matcher: &Matcher, pivot: Vector) -> Self {
        let (trees, cells) = (matcher.build_trees(patches), cells_of(patches.iter()));
        self.stored.insert(0, View { patches: patches.to_vec(), trees, cells, number: MAP, pivot });
        self
    }

    /// Number of maps among the views, 0 or 1; the map is the first view.
    fn maps(&self) -> usize {
        usize::from(self.stored.first().is_some_and(|view| view.number == MAP))
    }

    /// Adds the patches of a segment of `seconds` that left the window; `pivot` is the IMU position at the end of it, m.
    pub(super) fn add_segment(
        &mut self,
        patches: &[Patch],
        seconds: f64,
        matcher: &Matcher,
        pivot: Vector,
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
        for view in &self.stored {
            remove(&mut seen, &view.cells);
        }
        let covered = 1.0 - seen.len() as f64 / cells.len().max(1) as f64;
        if cells.is_empty() || covered >= self.spec.keep_below_coverage {
            return ViewUpdate::default();
        }
        let removed =
            if self.stored.len() - self.maps() >= self.spec.max_kept { self.remove_most_redundant() } else { None };
        let (trees, number) = (matcher.build_trees(&patches), self.next);
        self.next += 1;
        self.stored.push(View { patches, trees, cells, number, pivot });
        ViewUpdate { added: Some(number), removed }
    }

    /// Removes the view with the fewest cells that no other view covers; returns its number.
    fn remove_most_redundant(&mut self) -> Option<u64> {
        let own = |index: usize| {
            let mut cells = self.stored[index].cells.clone();
            for (other, view) in self.stored.iter().enumerate() {
                if other != index {
                    remove(&mut cells, &view.cells);
                }
            }
            cells.len()
        };
        let most_redundant = (self.maps()..self.stored.len()).min_by_key(|index| own(*index))?;
        Some(self.stored.remove(most_redundant).number)
    }

    /// Selects the views for a window with the surfels `placed`; returns indices for [`Views::view`].
    pub(super) fn select(&self, placed: &[PlacedSurfel]) -> Vec<usize> {
        let mut missing = cells_of(placed.iter().map(|surfel| &surfel.patch));
        let worthwhile = ((missing.len() as f64 * MIN_ADDED_FRACTION) as usize).max(1);
        let mut chosen: Vec<usize> = (0..self.maps()).collect();
        chosen.iter().for_each(|map| remove(&mut missing, &self.stored[*map].cells));
        let max_views = self.maps() + self.max_active.min(self.stored.len() - self.maps());
        while chosen.len() < max_views {
            let adds: Vec<usize> = self.stored.iter().map(|view| common(&missing, &view.cells)).collect();
            let best = adds.iter().copied().max().unwrap_or(0);
            if best < worthwhile {
                break;
            }
            let enough = (best as f64 * OLDER_VIEW_RATIO) as usize;
            let Some(oldest) = adds.iter().position(|count| *count >= enough.max(worthwhile)) else { break };
            remove(&mut missing, &self.stored[oldest].cells);
            chosen.push(oldest);
        }
        chosen
    }

    /// The patches of all views.
    pub(super) fn patches(&self) -> impl Iterator<Item = &Patch> {
        self.stored.iter().flat_map(|view| &view.patches)
    }

    pub(super) fn view(&self, index: usize) -> &View {
        &self.stored[index]
    }
}

/// Sorted keys of the cells that contain patches; patches seen from different sides have different keys.
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

/// Number of common cells of two sorted lists.
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

/// Removes the cells of a sorted list from another one.
fn remove(from: &mut Vec<u64>, others: &[u64]) {
    from.retain(|cell| others.binary_search(cell).is_err());
}
