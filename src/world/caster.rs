//! Ray casting against triangles, with parry's bounding-volume hierarchy; no other module uses parry.
//!
//! The hierarchy finds the face in single precision, relative to the centre of the scene. The distance is then computed
//! from the plane of the face in double precision. Ranges are therefore exact for the given corners, while the search,
//! the costly part, moves half the bytes.
//!
//! Rays of a scan are searched in groups of 16, in a tree of their own; single rays and nearest points use parry's. Both
//! find the same faces.

mod boxes;
mod face;
mod lanes;
mod packet;
mod packet_tree;
mod single_precision;
mod wedge;
mod wide_tree;

pub(super) use boxes::BoxTree;

use super::planes::{FaceId, FlatFace};
use super::triangle::{Surfaces, Triangle};
use super::{MaterialId, TimedRay};
use face::{Plane, SingleFace};
use glamx::Vec3A;
use packet_tree::{Found, PacketTree};
use parry3d::bounding_volume::Aabb;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use single_precision::{Vec3, single, single_reach};
use zsim_base::geometry::{SurfacePoint, Vector};

/// Triangles in a bounding-volume hierarchy for ray casting.
pub(super) struct Caster {
    /// Centre of the scene, subtracted from coordinates so that single precision is sufficient.
    middle: Vector,
    lower: Vector,
    upper: Vector,
    tree: Bvh,
    packet_tree: PacketTree,
    faces: Vec<SingleFace>,
    planes: Vec<Plane>,
    materials: Vec<MaterialId>,
    /// Number of the solid of each face.
    solids: Vec<u32>,
    triangle_count: usize,
}

/// The first intersection of a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// Distance along the ray, m.
    pub distance: f64,
    /// Unit normal that points against the ray.
    pub normal: Vector,
    /// Material of the triangle.
    pub material: MaterialId,
    /// The face.
    pub face: FaceId,
}

impl Caster {
    /// A caster for triangles with non-zero area.
    pub fn new(surfaces: &Surfaces) -> Self {
        let Surfaces { triangles, materials, solids } = surfaces;
        let (lower, upper) = bounds(triangles);
        let middle = if triangles.is_empty() { Vector::zeros() } else { (lower + upper) / 2.0 };
        let mut order = face::faces(triangles, materials, &middle);
        face::sort_along_curve(&mut order);
        let faces: Vec<SingleFace> = order.iter().map(|(_, face)| SingleFace::new(face)).collect();
        // Single precision moves corners by at most half a unit in the last place: enlarge the boxes accordingly.
        let extent = (upper - middle).amax() as f32;
        let margin = 4.0 * f32::EPSILON * extent;
        let boxes: Vec<Aabb> = faces.iter().map(|face| face.bounds(margin)).collect();
        Self {
            middle,
            lower,
            upper,
            tree: Bvh::from_leaves(BvhBuildStrategy::Ploc, &boxes),
            packet_tree: PacketTree::new(&faces, &boxes, extent),
            faces,
            planes: order.iter().map(|(_, face)| Plane::new(face)).collect(),
            materials: order.iter().map(|(at, _)| materials[*at]).collect(),
            solids: order.iter().map(|(at, _)| solids[*at]).collect(),
            triangle_count: triangles.len(),
        }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangle_count
    }

    /// Lower and upper corner of the bounding box.
    pub fn bounds(&self) -> (Vector, Vector) {
        (self.lower, self.upper)
    }

    /// The first triangle within `reach` of `origin` along the unit vector `direction`.
    pub fn cast(&self, origin: &Vector, direction: &Vector, reach: f64) -> Option<Crossing> {
        let origin = origin - self.middle;
        let ray = SingleRay::new(&origin, direction);
        let (at, near) = self.tree.find_best(
            single_reach(reach),
            |node, _| ray.enters(node),
            |leaf, _| self.faces[leaf as usize].cross(&ray.origin, &ray.direction),
        )?;
        self.crossing(at as usize, near, (&origin, direction), reach)
    }

    /// The first triangle on each ray within its reach, in the order of the rays; times are ignored. Rays that are
    /// neighbours in the slice should be neighbours in space.
    pub fn cast_all(&self, rays: &[TimedRay]) -> Vec<Option<Crossing>> {
        let crossing = |(timed, found): (&TimedRay, Found)| {
            let TimedRay { ray, reach_m, .. } = timed;
            let (origin, direction) = (&ray.origin_in_world, &ray.direction_in_world);
            match found {
                Found::Face(at, near) => self.crossing(at, near, (&(origin - self.middle), direction), *reach_m),
                Found::Nothing => None,
                Found::NotSearched => self.cast(origin, direction, *reach_m),
            }
        };
        rays.iter().zip(self.packet_tree.search(rays, &self.middle)).map(crossing).collect()
    }

    /// The intersection of a ray, given its local origin and direction, with the plane of a face at about `near`.
    #[inline(always)]
    fn crossing(&self, at: usize, near: f32, ray: (&Vector, &Vector), reach: f64) -> Option<Crossing> {
        let plane = &self.planes[at];
        let (origin, direction) = ray;
        let distance = plane.distance(origin, direction).unwrap_or(f64::from(near));
        let normal = if plane.normal.dot(direction) > 0.0 { -plane.normal } else { plane.normal };
        let (material, face) = (self.materials[at], FaceId(at as u32));
        (distance <= reach).then_some(Crossing { distance, normal, material, face })
    }

    /// The corners of all triangles, in single precision, with their materials.
    pub fn triangles(&self) -> impl Iterator<Item = (Triangle, MaterialId)> + '_ {
        self.faces.iter().zip(&self.materials).flat_map(|(face, material)| {
            let face = face.to_double();
            let count = if face.is_parallelogram { 2 } else { 1 };
            let in_world = |triangle: Triangle| (triangle.map(|corner| corner + self.middle), *material);
            face.triangles().into_iter().take(count).map(in_world)
        })
    }

    /// The faces, in the order of their [`FaceId`].
    pub fn flat_faces(&self) -> impl Iterator<Item = FlatFace> + '_ {
        self.faces.iter().zip(&self.planes).zip(&self.solids).map(|((face, plane), solid)| {
            let face = face.to_double();
            FlatFace { corners: face.corners(), normal: plane.normal, solid: *solid }
        })
    }

    /// The point of the triangles that is nearest to `point`, within `reach`, and its material.
    pub fn nearest(&self, point: &Vector, reach: f64) -> Option<(SurfacePoint, MaterialId)> {
        let local = point - self.middle;
        let probe = single(&local);
        // The search is in single precision; the margin includes a surface exactly at `reach`.
        let search = (reach * (1.0 + 1e-6) + 1e-5) as f32;
        let nearest = |leaf: u32| self.faces[leaf as usize].to_double().nearest(&local);
        let cost = |leaf: u32, _| Some((nearest(leaf) - local).norm() as f32);
        let box_distance = |node: &BvhNode, _| {
            let outside = (node.mins() - probe).max(probe - node.maxs()).max(Vec3::ZERO);
            outside.length()
        };
        let (at, _) = self.tree.find_best(search, box_distance, cost)?;
        let plane = &self.planes[at as usize];
        let nearest = plane.project(&nearest(at));
        let is_within = (nearest - local).norm() <= reach;
        let surface = SurfacePoint { point_in_world: nearest + self.middle, normal_in_world: plane.normal };
        is_within.then_some((surface, self.materials[at as usize]))
    }
}

/// A ray in the form that the search uses.
struct SingleRay {
    origin: Vec3,
    direction: Vec3,
    from: Vec3A,
    inverse: Vec3A,
}

impl SingleRay {
    fn new(origin: &Vector, direction: &Vector) -> Self {
        let (origin, direction) = (single(origin), single(direction));
        // Finite also for a ray along an axis, so that no product is NaN.
        let inverse = direction.map(|x| 1.0 / if x.abs() < 1e-20 { 1e-20_f32.copysign(x) } else { x });
        Self { origin, direction, from: origin.into(), inverse: inverse.into() }
    }

    /// Distance at which the ray enters the box of a node, by the slab test on all three axes at once; `f32::MAX` for a
    /// miss. parry's own test treats one axis at a time.
    #[inline]
    fn enters(&self, node: &BvhNode) -> f32 {
        let to_lower = (Vec3A::from(node.mins()) - self.from) * self.inverse;
        let to_upper = (Vec3A::from(node.maxs()) - self.from) * self.inverse;
        let enter = to_lower.min(to_upper).max_element();
        let leave = to_lower.max(to_upper).min_element();
        if leave >= enter && leave >= 0.0 { enter } else { f32::MAX }
    }
}

/// Bounding box of triangles; the origin for none.
fn bounds(triangles: &[Triangle]) -> (Vector, Vector) {
    let first = triangles.first().map_or(Vector::zeros(), |[corner, ..]| *corner);
    triangles.iter().flatten().fold((first, first), |(lower, upper), corner| (lower.inf(corner), upper.sup(corner)))
}
