//! The wire of the springs of a head at rest as a triangle mesh.

use nalgebra::Point3;
use std::f64::consts::TAU;
use zsim_base::geometry::{Pose, Vector};
use zsim_report::page::CoilLink;

/// Sections of the wire per coil, and corners of a section: the faces are within 1 % of the radii of coil and wire.
const SECTIONS_PER_COIL: usize = 36;
const CORNERS: usize = 24;

/// A closed surface, faces counterclockwise from outside, in the base frame, m.
pub(super) type Surface = Vec<[Vector; 3]>;

/// The surface of a spring's wire, with the head at rest at `base_from_head`; `None` for a spring given by a stiffness.
pub(super) fn wire_surface(spring: &CoilLink, base_from_head: &Pose) -> Option<Surface> {
    if spring.is_assumed || spring.coils <= 0.0 {
        return None;
    }
    let sections = (spring.coils * SECTIONS_PER_COIL as f64).ceil() as usize;
    let middles: Vec<Vector> =
        (0..=sections).map(|k| middle(spring, base_from_head, k as f64 / sections as f64)).collect();
    let rings: Vec<Vec<Vector>> = (0..=sections)
        .map(|k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(sections));
            let along = (middles[after] - middles[before]).normalize();
            ring(&middles[k], &along, &spring.base_from_foot, 0.5 * spring.wire_diameter_m)
        })
        .collect();
    let mut faces = Vec::new();
    for pair in rings.windows(2) {
        for corner in 0..CORNERS {
            let next = (corner + 1) % CORNERS;
            faces.push([pair[0][corner], pair[0][next], pair[1][next]]);
            faces.push([pair[0][corner], pair[1][next], pair[1][corner]]);
        }
    }
    for corner in 0..CORNERS {
        let next = (corner + 1) % CORNERS;
        faces.push([middles[0], rings[0][next], rings[0][corner]]);
        faces.push([middles[sections], rings[sections][corner], rings[sections][next]]);
    }
    Some(faces)
}

/// The middle of the wire at a fraction `u` of its turns, on a helix around a cubic Hermite curve from foot to top.
fn middle(spring: &CoilLink, base_from_head: &Pose, u: f64) -> Vector {
    let top = base_from_head * spring.head_from_top;
    let (p, q) = (spring.base_from_foot.translation.vector, top.translation.vector);
    let length = (q - p).norm();
    let tangents = [spring.base_from_foot, top].map(|end| end.rotation * Vector::z() * length);
    let axis = p * ((1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u))
        + q * (u * u * (3.0 - 2.0 * u))
        + tangents[0] * (u * (1.0 - u) * (1.0 - u))
        + tangents[1] * (u * u * (u - 1.0));
    let rotation = spring.base_from_foot.rotation.slerp(&top.rotation, u);
    let (sin, cos) = (u * spring.coils * TAU).sin_cos();
    axis + rotation * (Point3::new(cos, sin, 0.0).coords * spring.coil_radius_m)
}

/// The corners of a section of the wire, counterclockwise around `along`.
fn ring(middle: &Vector, along: &Vector, foot: &Pose, wire_radius_m: f64) -> Vec<Vector> {
    // The wire runs around the axis of the spring, so that it is never parallel to it.
    let across = (foot.rotation * Vector::z()).cross(along).normalize();
    let up = along.cross(&across);
    let corner = |k: usize| {
        let (sin, cos) = (k as f64 / CORNERS as f64 * TAU).sin_cos();
        middle + (across * cos + up * sin) * wire_radius_m
    };
    (0..CORNERS).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spring::HeadExport;
    use approx::assert_relative_eq;
    use std::collections::BTreeMap;
    use std::f64::consts::PI;
    use zsim_dynamics::{HeadModel, load};
    use zsim_report::page::{Link, links};

    /// The only spring of the handheld head, and the pose of the head at rest.
    fn handheld() -> (CoilLink, Pose) {
        let (spec, source) = load("handheld").unwrap();
        let head = HeadModel::new(&spec, &source).unwrap();
        match &links::of(&spec.linkage)[..] {
            [Link::Spring(spring)] => (*spring, *head.base_from_head_at_rest()),
            _ => panic!("the handheld head has one spring"),
        }
    }

    #[test]
    fn the_surface_is_closed_and_has_the_volume_of_the_wire() {
        let (spring, rest) = handheld();
        let surface = wire_surface(&spring, &rest).unwrap();
        // Each edge belongs to two faces, in opposite directions.
        let key = |v: &Vector| [v.x, v.y, v.z].map(f64::to_bits);
        let mut edges: BTreeMap<_, i32> = BTreeMap::new();
        for [a, b, c] in &surface {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((key(from), key(to))).or_default() += 1;
                *edges.entry((key(to), key(from))).or_default() -= 1;
            }
        }
        assert!(edges.values().all(|count| *count == 0));
        // Divergence theorem; and Pappus: the area of the section times the length of the middle line.
        let volume: f64 = surface.iter().map(|[a, b, c]| a.dot(&b.cross(c)) / 6.0).sum();
        let length_m = spring.coils * TAU * spring.coil_radius_m;
        let section = PI * (0.5 * spring.wire_diameter_m).powi(2);
        // The climb of the helix lengthens the wire, the corners make section and coil smaller.
        assert_relative_eq!(volume, section * length_m, max_relative = 0.03);
        // It reaches from the foot to the top, around the axis.
        let top = rest * spring.head_from_top;
        let heights: Vec<f64> = surface.iter().flatten().map(|v| v.z).collect();
        let (low, high) =
            (heights.iter().copied().fold(f64::INFINITY, f64::min), heights.iter().copied().fold(0.0, f64::max));
        assert_relative_eq!(low, spring.base_from_foot.translation.z - 0.5 * spring.wire_diameter_m, epsilon = 1e-3);
        assert_relative_eq!(high, top.translation.z + 0.5 * spring.wire_diameter_m, epsilon = 1e-3);
    }

    #[test]
    fn the_file_has_the_faces_of_the_surface() {
        let (spec, source) = load("handheld").unwrap();
        let export = HeadExport::new(&spec, &HeadModel::new(&spec, &source).unwrap()).unwrap();
        let bytes = export.spring_mesh().unwrap().unwrap();
        let mesh = stl_io::read_stl(&mut std::io::Cursor::new(bytes)).unwrap();
        let (spring, rest) = handheld();
        assert_eq!(mesh.faces.len(), wire_surface(&spring, &rest).unwrap().len());
        mesh.validate().unwrap();
    }
}
