//! Boxes in a bounding-volume hierarchy.

use super::SingleRay;
use super::single_precision::{single, single_reach};
use parry3d::bounding_volume::Aabb;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use zsim_base::geometry::Vector;

/// Boxes whose content is tested by the caller.
pub(crate) struct BoxTree {
    /// Subtracted from coordinates so that single precision is sufficient.
    middle: Vector,
    tree: Bvh,
}

impl BoxTree {
    /// A tree of boxes (lower and upper corner).
    pub fn new(boxes: &[(Vector, Vector)]) -> Self {
        let middle = boxes.first().map_or(Vector::zeros(), |(lower, upper)| (lower + upper) / 2.0);
        let local = |(lower, upper): &(Vector, Vector)| Aabb::new(single(&(lower - middle)), single(&(upper - middle)));
        let boxes: Vec<Aabb> = boxes.iter().map(local).collect();
        Self { middle, tree: Bvh::from_leaves(BvhBuildStrategy::Ploc, &boxes) }
    }

    /// The box in which `distance`, given its index, is smallest on a ray; `None` without a distance within `reach`.
    pub fn first(
        &self,
        origin: &Vector,
        direction: &Vector,
        reach: f64,
        distance: impl Fn(usize) -> Option<f64>,
    ) -> Option<usize> {
        let ray = SingleRay::new(&(origin - self.middle), direction);
        let in_box = |leaf: u32, _| distance(leaf as usize).map(|distance| distance as f32);
        let found = self.tree.find_best(single_reach(reach), |node, _| ray.enters(node), in_box);
        found.map(|(leaf, _)| leaf as usize)
    }
}
