//! One triangle: where a ray crosses it, which of its points is nearest.

use super::{Aabb, Vec3, single};
use crate::geometry::Vector;
use crate::world::shape::Triangle;

/// How far outside its edges a triangle still counts, in fractions of its edges. Neighbours overlap by this much, so that no
/// ray slips between them.
const OVERLAP: f32 = 1e-6;

/// A triangle in single precision.
pub(super) struct Face {
    corner: Vec3,
    u: Vec3,
    v: Vec3,
}

impl Face {
    pub fn new([a, b, c]: &Triangle, middle: &Vector) -> Self {
        let corner = single(&(a - middle));
        Self { corner, u: single(&(b - middle)) - corner, v: single(&(c - middle)) - corner }
    }

    /// The box around it, `margin` larger on each side.
    pub fn bounds(&self, margin: f32) -> Aabb {
        let (b, c) = (self.corner + self.u, self.corner + self.v);
        let margin = Vec3::splat(margin);
        Aabb::new(self.corner.min(b).min(c) - margin, self.corner.max(b).max(c) + margin)
    }

    /// How far along the ray it is crossed, from either side (Moeller and Trumbore 1997).
    #[inline]
    pub fn cross(&self, origin: &Vec3, direction: &Vec3) -> Option<f32> {
        let p = direction.cross(self.v);
        let determinant = self.u.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let from_corner = *origin - self.corner;
        let along_u = from_corner.dot(p) * inverse;
        let q = from_corner.cross(self.u);
        let along_v = direction.dot(q) * inverse;
        let distance = self.v.dot(q) * inverse;
        let is_inside = along_u >= -OVERLAP && along_v >= -OVERLAP && along_u + along_v <= 1.0 + OVERLAP;
        (is_inside && distance >= 0.0).then_some(distance)
    }

    /// Its point nearest to `point` (Ericson, Real-Time Collision Detection, section 5.1.5), in double precision.
    pub fn nearest(&self, point: &Vector) -> Vector {
        let [corner, u, v] = [self.corner, self.u, self.v].map(|x| Vector::new(x.x.into(), x.y.into(), x.z.into()));
        let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
        let (pu, pv) = (u.dot(&(point - corner)), v.dot(&(point - corner)));
        let (s, t) = (vv * pu - uv * pv, uu * pv - uv * pu);
        let area = uu * vv - uv * uv;
        if s >= 0.0 && t >= 0.0 && s + t <= area && area > 0.0 {
            return corner + (u * s + v * t) / area;
        }
        let candidates = [on_edge(point, corner, u), on_edge(point, corner, v), on_edge(point, corner + u, v - u)];
        let [first, rest @ ..] = candidates;
        let nearer = |best: Vector, next: Vector| {
            if (next - point).norm_squared() < (best - point).norm_squared() { next } else { best }
        };
        rest.into_iter().fold(first, nearer)
    }
}

/// The point of the segment from `start` along `edge` that is nearest to `point`.
fn on_edge(point: &Vector, start: Vector, edge: Vector) -> Vector {
    let length2 = edge.norm_squared();
    if length2 == 0.0 { start } else { start + edge * (edge.dot(&(point - start)) / length2).clamp(0.0, 1.0) }
}

/// A triangle's plane `normal . x = offset`, in double precision.
pub(super) struct Plane {
    pub normal: Vector,
    offset: f64,
}

impl Plane {
    pub fn new([a, b, c]: &Triangle, middle: &Vector) -> Self {
        let normal = (b - a).cross(&(c - a)).normalize();
        Self { normal, offset: normal.dot(&((a + b + c) / 3.0 - middle)) }
    }

    /// How far along the ray the plane is crossed, or `None` for a ray in the plane.
    #[inline]
    pub fn distance(&self, origin: &Vector, direction: &Vector) -> Option<f64> {
        let approach = self.normal.dot(direction);
        let distance = (self.offset - self.normal.dot(origin)) / approach;
        (approach.abs() > 1e-9).then(|| distance.max(0.0))
    }

    /// The foot of the perpendicular from a point.
    pub fn onto(&self, point: &Vector) -> Vector {
        point - self.normal * (self.normal.dot(point) - self.offset)
    }
}

/// The triangles' indices along a space-filling curve, so that neighbours in space are neighbours in memory. Those at one
/// place of the curve keep their order.
pub(super) fn order_in_space(triangles: &[Triangle], lower: &Vector, upper: &Vector) -> Vec<usize> {
    let scale = (upper - lower).map(|extent| if extent > 0.0 { 1023.0 / extent } else { 0.0 });
    let code = |[a, b, c]: &Triangle| {
        let cell = ((a + b + c) / 3.0 - lower).component_mul(&scale);
        spread(cell.x as u32) | spread(cell.y as u32) << 1 | spread(cell.z as u32) << 2
    };
    let codes: Vec<u32> = triangles.iter().map(code).collect();
    let mut order: Vec<usize> = (0..triangles.len()).collect();
    order.sort_by_key(|at| codes[*at]);
    order
}

/// Puts two zero bits before each of the lowest ten bits.
fn spread(bits: u32) -> u32 {
    let x = (bits | bits << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
