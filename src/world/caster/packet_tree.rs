//! Search of the nearest faces on groups of rays.

use super::face::SingleFace;
use super::lanes::range;
use super::packet::{LeafFace, PACKET, Packet};
use super::wedge::Wedge;
use super::wide_tree::{Child, WIDTH, WideNode, build};
use crate::TimedRay;
use parry3d::bounding_volume::Aabb;
use pulp::{Arch, Simd, WithSimd};
use zsim_base::geometry::Vector;

/// Faces in a tree that groups of rays search.
pub(super) struct PacketTree {
    nodes: Vec<WideNode>,
    /// The faces in the order of the leaves.
    faces: Vec<LeafFace>,
    /// Largest coordinate, m.
    extent: f32,
}

/// What a ray hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found {
    /// The number of the nearest face, and its distance in single precision.
    Face(usize, f32),
    Nothing,
    /// The rays of the group diverge too much to be searched together.
    NotSearched,
}

impl PacketTree {
    /// A tree of faces with these bounding boxes, whose coordinates are at most `extent`, m.
    pub fn new(faces: &[SingleFace], boxes: &[Aabb], extent: f32) -> Self {
        let (nodes, order) = build(boxes);
        let faces = order.iter().map(|number| LeafFace::new(&faces[*number as usize], *number)).collect();
        Self { nodes, faces, extent }
    }

    /// Searches the nearest face on each ray; each 16 in sequence together. Coordinates of faces are relative to `middle`.
    pub fn search(&self, rays: &[TimedRay], middle: &Vector) -> Vec<Found> {
        self.search_with(Arch::new(), rays, middle)
    }

    /// As [`Self::search`], with the SIMD operations of `arch`.
    fn search_with(&self, arch: Arch, rays: &[TimedRay], middle: &Vector) -> Vec<Found> {
        if self.nodes.is_empty() {
            return vec![Found::Nothing; rays.len()];
        }
        arch.dispatch(Search { tree: self, rays, middle })
    }

    /// Searches the nearest face on each ray; false if the rays diverge too much. `stack` is reused to save allocations.
    #[inline(always)]
    fn cast<S: Simd>(&self, simd: S, rays: &mut Packet, stack: &mut Vec<(f32, Child)>) -> bool {
        let Some(wedge) = Wedge::new(simd, rays, self.extent) else { return false };
        let mut depths = [0.0; WIDTH];
        let mut farthest = wedge.farthest(range(simd, &rays.reach).1);
        stack.clear();
        stack.push((f32::NEG_INFINITY, Child::node(0)));
        while let Some((depth, child)) = stack.pop() {
            if depth > farthest {
                continue;
            }
            match child.content() {
                Ok(node) => {
                    let node = &self.nodes[node];
                    wedge.depths(simd, node, farthest, &mut depths);
                    push_nearest_last(stack, &depths, &node.children);
                }
                Err(faces) => {
                    let mut is_nearer = false;
                    for face in &self.faces[faces] {
                        is_nearer |= rays.cross(simd, face);
                    }
                    if is_nearer {
                        farthest = wedge.farthest(range(simd, &rays.reach).1);
                    }
                }
            }
        }
        true
    }
}

/// A search of rays, to be compiled for each kind of SIMD.
struct Search<'a> {
    tree: &'a PacketTree,
    rays: &'a [TimedRay],
    middle: &'a Vector,
}

impl WithSimd for Search<'_> {
    type Output = Vec<Found>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Found> {
        let mut found = Vec::with_capacity(self.rays.len());
        let mut stack = Vec::new();
        for rays in self.rays.chunks(PACKET) {
            let mut packet = Packet::new(rays, self.middle);
            let is_searched = self.tree.cast(simd, &mut packet, &mut stack);
            for ray in 0..rays.len() {
                found.push(match packet.nearest(ray) {
                    Some((face, distance)) => Found::Face(face, distance),
                    None if is_searched => Found::Nothing,
                    None => Found::NotSearched,
                });
            }
        }
        found
    }
}

/// Pushes the children with finite depths in order of decreasing depth.
#[inline(always)]
fn push_nearest_last(stack: &mut Vec<(f32, Child)>, depths: &[f32; WIDTH], children: &[Child; WIDTH]) {
    let first = stack.len();
    for (depth, child) in depths.iter().zip(children).filter(|(depth, _)| **depth < f32::INFINITY) {
        let mut at = stack.len();
        stack.push((*depth, *child));
        while at > first && stack[at - 1].0 < *depth {
            stack.swap(at - 1, at);
            at -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ray;
    use crate::caster::face::Face;
    use rand::RngExt;
    use zsim_base::random::Seed;

    /// Small triangles at random in a cube of 20 m, and groups of rays from its middle.
    fn cloud() -> (PacketTree, Vec<TimedRay>) {
        let mut stream = Seed(3).stream("cloud");
        let mut draw = |scale: f64| Vector::from_fn(|_, _| scale * stream.random_range(-1.0..1.0));
        let face = |corner, u, v| SingleFace::new(&Face { corner, u, v, is_parallelogram: false });
        let faces: Vec<SingleFace> = (0..5000).map(|_| face(draw(10.0), draw(0.5), draw(0.5))).collect();
        let boxes: Vec<Aabb> = faces.iter().map(|face| face.bounds(1e-5)).collect();
        let group = |_| {
            let (origin, axis) = (draw(2.0), draw(1.0));
            let ray =
                |_| Ray { origin_in_world: origin + draw(0.01), direction_in_world: (axis + draw(0.1)).normalize() };
            (0..PACKET).map(ray).collect::<Vec<_>>()
        };
        let rays = (0..500).flat_map(group).map(|ray| TimedRay { ray, reach_m: 15.0, t_s: 0.0 }).collect();
        (PacketTree::new(&faces, &boxes, 10.5), rays)
    }

    #[test]
    fn scalar_operations_give_the_same_bits() {
        let (tree, rays) = cloud();
        let scalar = tree.search_with(Arch::Scalar, &rays, &Vector::zeros());
        let found = scalar.iter().filter(|found| matches!(found, Found::Face(..))).count();
        assert!(found > rays.len() / 4, "{found} of {} rays hit a triangle", rays.len());
        assert!(scalar == tree.search(&rays, &Vector::zeros()));
    }

    #[test]
    fn groups_find_what_a_test_of_all_faces_finds() {
        let (tree, rays) = cloud();
        let found = tree.search(&rays, &Vector::zeros());
        for (rays, found) in rays.chunks(PACKET).zip(found.chunks(PACKET)) {
            let mut packet = Packet::new(rays, &Vector::zeros());
            for face in &tree.faces {
                packet.cross(pulp::Scalar, face);
            }
            let all = (0..PACKET).map(|ray| packet.nearest(ray));
            for (found, expected) in found.iter().zip(all).filter(|(found, _)| **found != Found::NotSearched) {
                assert_eq!(*found, expected.map_or(Found::Nothing, |(face, distance)| Found::Face(face, distance)));
            }
        }
    }

    #[test]
    fn an_empty_tree_is_hit_by_nothing() {
        let (_, rays) = cloud();
        let found = PacketTree::new(&[], &[], 0.0).search(&rays, &Vector::zeros());
        assert!(found.len() == rays.len() && found.iter().all(|found| *found == Found::Nothing));
    }
}
