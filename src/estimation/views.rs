//! Fixed views (keyframes): surfels of past segments, fixed in the map, with which the window is matched.
//!
//! Segments that left the window become a view if they cover cells that the stored views do not. A window uses the few
//! views that cover most of its cells. Of about equal ones it uses the oldest, which has drifted least. The poses of a view are
//! fixed; its patches move with the lidar's calibration, or else an early error of it would last (decision 0030).

use super::matching::{Matcher, SearchTrees};
use super::spec::ViewSpec;
use super::surfel::{Patch, PlacedSurfel, Sighting};
use zsim_base::geometry::Vector;
use zsim_base::measurement::LidarCorrection;

/// Edge length of the cells with which the coverage of views is compared, m.
const CELL_M: f64 = 1.0;
/// An older view is preferred if it adds at least this fraction of the cells that the best one adds.
const OLDER_VIEW_RATIO: f64 = 0.7;
/// Minimum fraction of the cells of the window that a view must add to be used.
const MIN_ADDED_FRACTION: f64 = 0.02;

/// View number of the given map.
pub(super) const MAP: u64 = u64::MAX;

/// A patch in the map, and how the lidar saw it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenPatch {
    patch: Patch,
    sighting: Sighting,
}

/// A fixed view, or a given map.
///
/// The patches of a view move with the correction of the lidar's calibration, which applies to all returns.
#[derive(Debug)]
pub(super) struct View {
    patches: Vec<Patch>,
    /// How the lidar saw the patches; empty for a given map.
    sightings: Vec<Sighting>,
    /// The corrections with which patches were placed, each with the number of patches placed up to then.
    placed_by: Vec<(LidarCorrection, usize)>,
    pub(super) trees: SearchTrees,
    cells: Vec<u64>,
    /// View number, in order of storage.
    pub(super) number: u64,
    /// Reference point of the rotation error: the IMU position when the view was stored, m.
    pub(super) pivot: Vector,
}

/// The patches of a part of the trajectory.
#[derive(Debug)]
pub(super) struct SeenSegment {
    pub(super) patches: Vec<SeenPatch>,
    /// The correction with which they were placed.
    pub(super) lidar: LidarCorrection,
    /// Duration, s.
    pub(super) seconds: f64,
}

impl From<&PlacedSurfel> for SeenPatch {
    fn from(placed: &PlacedSurfel) -> Self {
        Self { patch: placed.patch, sighting: placed.sighting }
    }
}

impl View {
    /// The patch at `index` as the correction `lidar` places it.
    pub(super) fn patch(&self, index: u32, lidar: &LidarCorrection) -> Patch {
        let patch = self.patches[index as usize];
        let Some(sighting) = self.sighting(index) else { return patch };
        let by = self.placed_by.partition_point(|(_, until)| *until <= index as usize);
        sighting.recalibrated(&patch, &self.placed_by[by].0, lidar)
    }

    /// How the lidar saw the patch at `index`; `None` for a patch of a given map.
    #[inline]
    pub(super) fn sighting(&self, index: u32) -> Option<&Sighting> {
        self.sightings.get(index as usize)
    }
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
    gathering: Vec<SeenPatch>,
    /// As [`View::placed_by`].
    gathered_by: Vec<(LidarCorrection, usize)>,
    gathered_s: f64,
    next: u64,
}

impl Views {
    pub(super) fn new(spec: &ViewSpec, max_active: usize) -> Self {
        Self {
            spec: spec.clone(),
            max_active,
            stored: Vec::new(),
            gathering: Vec::new(),
            gathered_by: Vec::new(),
            gathered_s: 0.0,
            next: 0,
        }
    }

    /// Adds a given map, with which every window is matched and which is never removed.
    pub(super) fn with_map(mut self, patches: &[Patch], matcher: &Matcher, pivot: Vector) -> Self {
        let (trees, cells) = (matcher.build_trees(patches), cells_of(patches.iter()));
        self.stored.insert(
            0,
            View {
                patches: patches.to_vec(),
                sightings: Vec::new(),
                placed_by: Vec::new(),
                trees,
                cells,
                number: MAP,
                pivot,
            },
        );
        self
    }

    /// Number of maps among the views, 0 or 1; the map is the first view.
    fn maps(&self) -> usize {
        usize::from(self.stored.first().is_some_and(|view| view.number == MAP))
    }

    /// Adds a segment that left the window; `pivot` is the IMU position at the end of it, m.
    pub(super) fn add_segment(&mut self, segment: &SeenSegment, matcher: &Matcher, pivot: Vector) -> ViewUpdate {
        if self.max_active == 0 {
            return ViewUpdate::default();
        }
        self.gathering.extend(&segment.patches);
        self.gathered_by.push((segment.lidar, self.gathering.len()));
        self.gathered_s += segment.seconds;
        if self.gathered_s < self.spec.length_s - 1e-9 {
            return ViewUpdate::default();
        }
        self.gathered_s = 0.0;
        let gathered = std::mem::take(&mut self.gathering);
        let placed_by = std::mem::take(&mut self.gathered_by);
        let (patches, sightings): (Vec<_>, Vec<_>) = gathered.iter().map(|seen| (seen.patch, seen.sighting)).unzip();
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
        self.stored.push(View { patches, sightings, placed_by, trees, cells, number, pivot });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;
    use zsim_base::geometry::{Matrix, Rotation};

    /// A wall 3 m ahead of a lidar at the origin, by the calibration, as `lidar` places it.
    fn wall(lidar: &LidarCorrection) -> SeenPatch {
        let ray = lidar.apply(&Vector::new(3.0, 0.0, 0.0));
        let covariance = Matrix::from_diagonal(&Vector::new(1e-4, 0.05, 0.05));
        let (centre, normal) = (lidar.translation + ray, -ray.normalize());
        let patch = Patch { centre, normal, points: 50.0, covariance, roughness_variance: 0.0, level: 0 };
        let sighting = Sighting { beam: ray.normalize(), range_m: ray.norm(), map_from_imu: Matrix::identity() };
        SeenPatch { patch, sighting }
    }

    #[test]
    fn patches_of_a_view_move_with_the_calibration_and_those_of_a_given_map_do_not() {
        let spec = load("default").unwrap();
        let matcher = Matcher::new(&spec.matching, &spec.surfels);
        let lidar = |range_m: f64, turn_rad: f64, shift_m: f64| LidarCorrection {
            range_m,
            rotation: Rotation::from_scaled_axis(Vector::new(0.1, -0.3, 1.0) * turn_rad),
            translation: Vector::new(0.5, 1.0, -0.2) * shift_m,
        };
        let map = wall(&LidarCorrection::default()).patch;
        let mut views = Views::new(&spec.views, 5).with_map(&[map], &matcher, Vector::zeros());
        // Two segments of one view, placed with different corrections.
        for by in [lidar(0.004, 0.0, 0.0), lidar(-0.002, 1e-3, 2e-3)] {
            let segment = SeenSegment { patches: vec![wall(&by)], lidar: by, seconds: 0.5 * spec.views.length_s };
            views.add_segment(&segment, &matcher, Vector::zeros());
        }
        let now = lidar(0.007, -2e-3, 1e-3);
        let expected = wall(&now).patch;
        for index in [0, 1] {
            let patch = views.view(1).patch(index, &now);
            assert!(views.view(1).sighting(index).is_some());
            // Terms of second order: 3 mrad times 9 mm, and half of 3 mrad squared times 3 m.
            assert!((patch.centre - expected.centre).norm() < 5e-5, "{patch:?}");
            assert!((patch.normal - expected.normal).norm() < 1e-5, "{patch:?}");
        }
        assert_eq!((views.view(0).patch(0, &now), views.view(0).sighting(0)), (map, None));
    }
}
