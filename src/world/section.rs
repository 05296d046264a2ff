//! Sections of a scene with planes, and the edges that outline its surfaces.

use super::triangle::Triangle;
use std::collections::BTreeMap;
use zsim_base::geometry::Vector;

/// Corners within this distance are one corner of the outline, m.
const SAME_CORNER_M: f64 = 1e-3;
/// Two surfaces that meet at a larger angle have an edge: cosine of 25 degrees.
const MAX_SMOOTH_COSINE: f64 = 0.906;

/// A line segment, m.
pub type Segment = [Vector; 2];

/// A plane through a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionPlane {
    /// A point of the plane, m.
    pub point_in_world: Vector,
    /// Unit normal.
    pub normal_in_world: Vector,
}

impl SectionPlane {
    /// Signed distance of a point from the plane, positive on the side of the normal, m.
    pub fn distance_m(&self, point_in_world: &Vector) -> f64 {
        (point_in_world - self.point_in_world).dot(&self.normal_in_world)
    }

    /// The segment along which the plane cuts a triangle; `None` if it does not.
    pub(super) fn cut(&self, triangle: &Triangle) -> Option<Segment> {
        let distances = triangle.map(|corner| self.distance_m(&corner));
        let mut crossings = (0..3).filter_map(|k| {
            let (from, to) = (k, (k + 1) % 3);
            let (near, far) = (distances[from], distances[to]);
            ((near < 0.0) != (far < 0.0)).then(|| triangle[from].lerp(&triangle[to], near / (near - far)))
        });
        Some([crossings.next()?, crossings.next()?])
    }
}

/// The edges of surfaces: where a surface ends, or meets another at an angle.
pub(super) fn edges<'a>(triangles: impl Iterator<Item = &'a Triangle>) -> Vec<Segment> {
    let mut normals: BTreeMap<[[i64; 3]; 2], Edge> = BTreeMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle;
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let mut key = [rounded(from), rounded(to)];
            key.sort_unstable();
            normals
                .entry(key)
                .and_modify(|edge| edge.is_smooth = normal.dot(&edge.normal).abs() > MAX_SMOOTH_COSINE)
                .or_insert(Edge { segment: [*from, *to], normal, is_smooth: false });
        }
    }
    normals.into_values().filter(|edge| !edge.is_smooth).map(|edge| edge.segment).collect()
}

/// An edge of a triangle: the normal of the first triangle, and whether the last one continues it.
struct Edge {
    segment: Segment,
    normal: Vector,
    is_smooth: bool,
}

/// A corner in units in which equal corners are equal.
fn rounded(corner: &Vector) -> [i64; 3] {
    [0, 1, 2].map(|axis| (corner[axis] / SAME_CORNER_M).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triangle::parallelogram;

    fn cube() -> Vec<Triangle> {
        let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
        let o = Vector::zeros();
        let sides = [(o, x, y), (z, x, y), (o, x, z), (y, x, z), (o, y, z), (x, y, z)];
        sides.into_iter().flat_map(|(corner, u, v)| parallelogram(corner, u, v)).collect()
    }

    #[test]
    fn a_cube_has_twelve_edges_and_no_diagonals() {
        let edges = edges(cube().iter());
        assert_eq!(edges.len(), 12);
        assert!(edges.iter().all(|[from, to]| ((to - from).norm() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_plane_cuts_a_cube_along_its_perimeter() {
        let plane = SectionPlane { point_in_world: Vector::new(0.0, 0.0, 0.3), normal_in_world: Vector::z() };
        let segments: Vec<Segment> = cube().iter().filter_map(|triangle| plane.cut(triangle)).collect();
        let length: f64 = segments.iter().map(|[from, to]| (to - from).norm()).sum();
        assert!((length - 4.0).abs() < 1e-12, "{length}");
        assert!(segments.iter().flatten().all(|point| (point.z - 0.3).abs() < 1e-12));
    }
}
