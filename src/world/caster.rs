//! Rays against triangles: the one file that names parry.
//!
//! parry's bounding-volume tree finds the triangle in single precision, near the middle of the scene; one test against the
//! triangle's plane in double precision then gives the distance. So ranges are exact to the corners as given, while the
//! search, which costs the time, moves half the bytes.

mod triangle;

use super::MaterialId;
use super::shape::Triangle;
use crate::geometry::{SurfacePoint, Vector};
use parry3d::bounding_volume::Aabb;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use triangle::{Face, Plane};

type Vec3 = parry3d::math::Vector;

/// Triangles that rays can be cast against.
pub(super) struct Caster {
    /// Subtracted from coordinates so that single precision serves.
    middle: Vector,
    lower: Vector,
    upper: Vector,
    tree: Bvh,
    faces: Vec<Face>,
    planes: Vec<Plane>,
    materials: Vec<MaterialId>,
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// Distance along the ray, m.
    pub distance: f64,
    /// Unit normal, turned against the ray.
    pub normal: Vector,
    /// The triangle's material.
    pub material: MaterialId,
}

impl Caster {
    /// A caster for triangles that have an area, one material each.
    pub fn new(triangles: &[Triangle], materials: &[MaterialId]) -> Self {
        let (lower, upper) = bounds(triangles);
        let middle = if triangles.is_empty() { Vector::zeros() } else { (lower + upper) / 2.0 };
        let order = triangle::order_in_space(triangles, &lower, &upper);
        let faces: Vec<Face> = order.iter().map(|at| Face::new(&triangles[*at], &middle)).collect();
        // Single precision moves corners by half a step at most: boxes reach that much further.
        let margin = 4.0 * f32::EPSILON * (upper - middle).amax() as f32;
        let boxes: Vec<Aabb> = faces.iter().map(|face| face.bounds(margin)).collect();
        Self {
            middle,
            lower,
            upper,
            tree: Bvh::from_leaves(BvhBuildStrategy::Ploc, &boxes),
            faces,
            planes: order.iter().map(|at| Plane::new(&triangles[*at], &middle)).collect(),
            materials: order.iter().map(|at| materials[*at]).collect(),
        }
    }

    /// How many triangles there are.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Two opposite corners of the box around the triangles, the lower first.
    pub fn bounds(&self) -> (Vector, Vector) {
        (self.lower, self.upper)
    }

    /// The first triangle within `reach` of `origin` along the unit vector `direction`.
    pub fn cast(&self, origin: &Vector, direction: &Vector, reach: f64) -> Option<Crossing> {
        let origin = origin - self.middle;
        let ray = parry3d::query::Ray { origin: single(&origin), dir: single(direction) };
        // A little further in single precision, so that the double one decides.
        let reach_single = (reach * (1.0 + 1e-6)) as f32;
        let (at, near) = self.tree.cast_ray(&ray, reach_single, |leaf, best| {
            self.faces[leaf as usize].cross(&ray.origin, &ray.dir).filter(|distance| *distance < best)
        })?;
        let plane = &self.planes[at as usize];
        let distance = plane.distance(&origin, direction).unwrap_or(f64::from(near));
        let normal = if plane.normal.dot(direction) > 0.0 { -plane.normal } else { plane.normal };
        (distance <= reach).then(|| Crossing { distance, normal, material: self.materials[at as usize] })
    }

    /// The point of the triangles that is nearest to `point`, within `reach`.
    pub fn nearest(&self, point: &Vector, reach: f64) -> Option<SurfacePoint> {
        let local = point - self.middle;
        let probe = single(&local);
        // The search is in single precision; the margin keeps a surface at the very edge of the reach.
        let search = (reach * (1.0 + 1e-6) + 1e-5) as f32;
        let cost = |leaf: u32, _| Some((self.faces[leaf as usize].nearest(&local) - local).norm() as f32);
        let box_distance = |node: &parry3d::partitioning::BvhNode, _| {
            let outside = (node.mins() - probe).max(probe - node.maxs()).max(Vec3::ZERO);
            outside.length()
        };
        let (at, _) = self.tree.find_best(search, box_distance, cost)?;
        let plane = &self.planes[at as usize];
        let nearest = plane.onto(&self.faces[at as usize].nearest(&local));
        let is_within = (nearest - local).norm() <= reach;
        is_within.then(|| SurfacePoint { point_in_world: nearest + self.middle, normal_in_world: plane.normal })
    }
}

/// The box around triangles; the origin for none.
fn bounds(triangles: &[Triangle]) -> (Vector, Vector) {
    let first = triangles.first().map_or(Vector::zeros(), |[corner, ..]| *corner);
    triangles.iter().flatten().fold((first, first), |(lower, upper), corner| (lower.inf(corner), upper.sup(corner)))
}

fn single(v: &Vector) -> Vec3 {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}
