//! A flat face: ray intersection and nearest point.

use super::single_precision::{Vec3, single};
use crate::MaterialId;
use crate::triangle::Triangle;
use parry3d::bounding_volume::Aabb;
use zsim_base::geometry::Vector;

/// Tolerance outside the edges of a face, as a fraction of the edges. Neighbouring faces overlap by this, so that no
/// ray passes between them.
pub(super) const OVERLAP: f32 = 1e-6;

/// Two triangles form a parallelogram if the fourth corner deviates by less than this, m.
const SAME_CORNER_M: f64 = 1e-9;

/// A triangle, or a parallelogram of two triangles. Most faces of a scene are parallelograms, which halves the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face {
    pub corner: Vector,
    /// Edges from the corner.
    pub u: Vector,
    pub v: Vector,
    pub is_parallelogram: bool,
}

impl Face {
    fn triangle([a, b, c]: &Triangle) -> Self {
        Self { corner: *a, u: b - a, v: c - a, is_parallelogram: false }
    }

    /// The parallelogram of the triangles `a b c` and `a c d`; `None` if they do not form one.
    fn parallelogram([a, b, c]: &Triangle, second: &Triangle) -> Option<Self> {
        let meets = *a == second[0] && *c == second[1] && (a + c - b - second[2]).amax() < SAME_CORNER_M;
        meets.then(|| Self { corner: *a, u: b - a, v: second[2] - a, is_parallelogram: true })
    }

    /// Approximate centre, for sorting.
    pub fn middle(&self) -> Vector {
        self.corner + (self.u + self.v) / 2.0
    }

    /// The triangles of the face; of a single triangle, the first one.
    pub fn triangles(&self) -> [Triangle; 2] {
        let Self { corner, u, v, .. } = *self;
        [[corner, corner + u, corner + v], [corner + u, corner + u + v, corner + v]]
    }

    /// The corners; of a single triangle, the last one repeats.
    pub fn corners(&self) -> [Vector; 4] {
        let Self { corner, u, v, is_parallelogram } = *self;
        [corner, corner + u, corner + v, if is_parallelogram { corner + u + v } else { corner + v }]
    }

    /// The point of the face nearest to `point`.
    pub fn nearest(&self, point: &Vector) -> Vector {
        let Self { corner, u, v, is_parallelogram } = *self;
        let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
        let (pu, pv) = (u.dot(&(point - corner)), v.dot(&(point - corner)));
        // The foot of the perpendicular is corner + (s u + t v) / area (normal equations, Cramer's rule).
        let (s, t, area) = (vv * pu - uv * pv, uu * pv - uv * pu, uu * vv - uv * uv);
        let is_inside = s >= 0.0 && t >= 0.0 && if is_parallelogram { s.max(t) <= area } else { s + t <= area };
        if is_inside && area > 0.0 {
            return corner + (u * s + v * t) / area;
        }
        let far_edges = if is_parallelogram { [(corner + u, v), (corner + v, u)] } else { [(corner + u, v - u); 2] };
        let edges = [(corner, u), (corner, v), far_edges[0], far_edges[1]];
        let [first, rest @ ..] = edges.map(|(start, edge)| nearest_on_edge(point, start, edge));
        let nearer = |best: Vector, next: Vector| {
            if (next - point).norm_squared() < (best - point).norm_squared() { next } else { best }
        };
        rest.into_iter().fold(first, nearer)
    }
}

/// The point of the segment from `start` along `edge` that is nearest to `point`.
fn nearest_on_edge(point: &Vector, start: Vector, edge: Vector) -> Vector {
    let length2 = edge.norm_squared();
    if length2 == 0.0 { start } else { start + edge * (edge.dot(&(point - start)) / length2).clamp(0.0, 1.0) }
}

/// The faces of triangles relative to `middle`, each with the index of the first triangle.
pub(super) fn faces(triangles: &[Triangle], materials: &[MaterialId], middle: &Vector) -> Vec<(usize, Face)> {
    let local = |at: usize| triangles.get(at).map(|triangle| triangle.map(|corner| corner - middle));
    let (mut faces, mut at) = (Vec::with_capacity(triangles.len()), 0);
    while let Some(first) = local(at) {
        let second = local(at + 1).filter(|_| materials[at] == materials[at + 1]);
        let both = second.and_then(|second| Face::parallelogram(&first, &second));
        faces.push((at, both.unwrap_or_else(|| Face::triangle(&first))));
        at += if both.is_some() { 2 } else { 1 };
    }
    faces
}

/// A face in single precision, for the search.
pub(super) struct SingleFace {
    corner: Vec3,
    u: Vec3,
    v: Vec3,
    /// Maximum sum of the fractions along `u` and `v`: 1 for a triangle, 2 for a parallelogram.
    max_sum: f32,
}

impl SingleFace {
    pub fn new(face: &Face) -> Self {
        let corner = single(&face.corner);
        let edge = |edge: Vector| single(&(face.corner + edge)) - corner;
        let max_sum = if face.is_parallelogram { 2.0 } else { 1.0 } + OVERLAP;
        Self { corner, u: edge(face.u), v: edge(face.v), max_sum }
    }

    /// The same face in double precision.
    pub fn to_double(&self) -> Face {
        let [corner, u, v] = [self.corner, self.u, self.v].map(|x| Vector::new(x.x.into(), x.y.into(), x.z.into()));
        Face { corner, u, v, is_parallelogram: self.max_sum > 1.5 }
    }

    /// Coordinates of the corner and the edges, and the maximum sum of the fractions along the edges.
    pub fn corner_and_edges(&self) -> ([[f32; 3]; 3], f32) {
        ([self.corner, self.u, self.v].map(|x| x.to_array()), self.max_sum)
    }

    /// Bounding box, enlarged by `margin` on each side.
    pub fn bounds(&self, margin: f32) -> Aabb {
        let (b, c) = (self.corner + self.u, self.corner + self.v);
        let d = if self.max_sum > 1.5 { b + self.v } else { c };
        let margin = Vec3::splat(margin);
        Aabb::new(self.corner.min(b).min(c).min(d) - margin, self.corner.max(b).max(c).max(d) + margin)
    }

    /// Distance along the ray at which it hits the face from either side (Moeller and Trumbore 1997).
    #[inline]
    pub fn cross(&self, origin: &Vec3, direction: &Vec3) -> Option<f32> {
        let p = direction.cross(self.v);
        let determinant = self.u.dot(p);
        let inverse = 1.0 / determinant;
        let from_corner = *origin - self.corner;
        let along_u = from_corner.dot(p) * inverse;
        let q = from_corner.cross(self.u);
        let along_v = direction.dot(q) * inverse;
        let distance = self.v.dot(q) * inverse;
        let is_inside = along_u >= -OVERLAP
            && along_v >= -OVERLAP
            && along_u <= 1.0 + OVERLAP
            && along_v <= 1.0 + OVERLAP
            && along_u + along_v <= self.max_sum;
        // A ray in the plane of the face divides by zero: the NaN fails the comparison.
        (is_inside && (0.0..f32::INFINITY).contains(&distance)).then_some(distance)
    }
}

/// Plane of a face, `normal . x = offset`, in double precision.
pub(super) struct Plane {
    pub normal: Vector,
    offset: f64,
}

impl Plane {
    pub fn new(face: &Face) -> Self {
        let normal = face.u.cross(&face.v).normalize();
        Self { normal, offset: normal.dot(&face.middle()) }
    }

    /// Distance along the ray to the plane; `None` for a ray parallel to it.
    #[inline]
    pub fn distance(&self, origin: &Vector, direction: &Vector) -> Option<f64> {
        let approach = self.normal.dot(direction);
        let distance = (self.offset - self.normal.dot(origin)) / approach;
        (approach.abs() > 1e-9).then(|| distance.max(0.0))
    }

    /// The foot of the perpendicular from a point.
    pub fn project(&self, point: &Vector) -> Vector {
        point - self.normal * (self.normal.dot(point) - self.offset)
    }
}

/// Sorts faces along a space-filling (Morton) curve, so that neighbours in space are neighbours in memory. Faces with
/// the same key keep their order.
pub(super) fn sort_along_curve(faces: &mut [(usize, Face)]) {
    let largest = faces.iter().map(|(_, face)| face.middle().amax()).fold(f64::MIN_POSITIVE, f64::max);
    faces.sort_by_cached_key(|(_, face)| {
        let cell = face.middle().map(|x| ((x / largest + 1.0) * 511.5) as u32);
        spread_bits(cell.x) | spread_bits(cell.y) << 1 | spread_bits(cell.z) << 2
    });
}

/// Inserts two zero bits before each of the lowest ten bits.
fn spread_bits(bits: u32) -> u32 {
    let x = (bits | bits << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
