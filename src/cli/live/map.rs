//! The map so far, thinned to one point in a voxel.

use super::growing::Growing;
use std::collections::BTreeSet;
use zsim_report::page::{LivePoint, MAX_PAGE_POINTS, Volume};

/// Edge of a voxel at first, m.
const VOXEL_M: f64 = 0.05;

/// Indices of a voxel along x, y and z.
type Voxel = [i32; 3];

/// Points of the map, of limited number: the voxels grow if there are too many.
#[derive(Debug)]
pub(super) struct ThinnedMap {
    volume: Volume,
    voxel_m: f64,
    occupied: BTreeSet<Voxel>,
    points: Growing<LivePoint>,
}

impl ThinnedMap {
    pub(super) fn new(volume: Volume) -> Self {
        Self { volume, voxel_m: VOXEL_M, occupied: BTreeSet::new(), points: Growing::default() }
    }

    pub(super) fn points(&self) -> &Growing<LivePoint> {
        &self.points
    }

    /// Adds a point if it is in the volume and the first one in its voxel.
    pub(super) fn add(&mut self, point: LivePoint) {
        if !self.volume.contains(&point.position) || !self.occupied.insert(voxel(&point, self.voxel_m)) {
            return;
        }
        if self.points.items().len() >= MAX_PAGE_POINTS {
            self.coarsen();
            if !self.occupied.insert(voxel(&point, self.voxel_m)) {
                return;
            }
        }
        self.points.push(point);
    }

    /// Removes all points.
    pub(super) fn clear(&mut self) {
        self.occupied.clear();
        self.points.restart_with(|_| false);
        self.voxel_m = VOXEL_M;
    }

    /// Doubles the voxels until at most half of the points remain.
    fn coarsen(&mut self) {
        while self.points.items().len() > MAX_PAGE_POINTS / 2 {
            self.voxel_m *= 2.0;
            let (occupied, voxel_m) = (&mut self.occupied, self.voxel_m);
            occupied.clear();
            self.points.restart_with(|point| occupied.insert(voxel(point, voxel_m)));
        }
    }
}

fn voxel(point: &LivePoint, voxel_m: f64) -> Voxel {
    std::array::from_fn(|k| (point.position[k] / voxel_m).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;

    fn point(x: f64, y: f64) -> LivePoint {
        LivePoint { position: Vector::new(x, y, 0.01), t_s: 0.0 }
    }

    #[test]
    fn a_voxel_has_one_point() {
        let mut map = ThinnedMap::new(Volume::default());
        [0.01, 0.02, 0.049, 0.051, f64::NAN, 1e6].into_iter().for_each(|x| map.add(point(x, 0.01)));
        assert_eq!(map.points().items(), [point(0.01, 0.01), point(0.051, 0.01)]);
    }

    #[test]
    fn the_number_of_points_is_limited() {
        // A wall of 700 by 700 voxels is 490,000 points; with voxels twice as large a quarter of them.
        let mut map = ThinnedMap::new(Volume::default());
        for k in 0..700 * 700 {
            map.add(point(f64::from(k / 700) * VOXEL_M + 0.01, f64::from(k % 700) * VOXEL_M + 0.01));
        }
        assert_eq!(map.points().items().len(), 350 * 350);
    }
}
