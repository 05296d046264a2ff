//! Boxes, cylinders, stairs: closed surfaces whose triangles face outwards.

use super::{Triangle, parallelogram};
use crate::geometry::Vector;

/// The box from `corner` along `size`.
pub(super) fn cuboid(corner: Vector, size: Vector) -> Vec<Triangle> {
    let (x, y, z) = (Vector::x() * size.x, Vector::y() * size.y, Vector::z() * size.z);
    let faces = [
        parallelogram(corner, y, x),
        parallelogram(corner + z, x, y),
        parallelogram(corner, x, z),
        parallelogram(corner + y, z, x),
        parallelogram(corner, z, y),
        parallelogram(corner + x, y, z),
    ];
    faces.concat()
}

/// The prism about z over a regular polygon of `sides` corners at `radius`.
pub(super) fn cylinder(radius: f64, height: f64, sides: usize) -> Vec<Triangle> {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * (k % sides) as f64 / sides as f64;
        Vector::new(radius * angle.cos(), radius * angle.sin(), 0.0)
    };
    let up = Vector::z() * height;
    let side = |k: usize| {
        let (a, b) = (corner(k), corner(k + 1));
        let [lower, upper] = parallelogram(a, b - a, up);
        [lower, upper, [Vector::zeros(), b, a], [up, a + up, b + up]]
    };
    (0..sides).flat_map(side).collect()
}

/// A solid flight of `steps` that climbs along x; `step` is tread, width, rise.
pub(super) fn stairs(steps: usize, step: Vector) -> Vec<Triangle> {
    let corner = |k: usize, rise: usize| Vector::new(k as f64 * step.x, -step.y / 2.0, rise as f64 * step.z);
    let (tread, across, rise) = (Vector::x() * step.x, Vector::y() * step.y, Vector::z() * step.z);
    let mut triangles = Vec::with_capacity(steps * 8 + 4);
    for k in 0..steps {
        let height = rise * (k + 1) as f64;
        triangles.extend(parallelogram(corner(k, k), rise, across));
        triangles.extend(parallelogram(corner(k, k + 1), tread, across));
        triangles.extend(parallelogram(corner(k, 0), tread, height));
        triangles.extend(parallelogram(corner(k, 0) + across, height, tread));
    }
    triangles.extend(parallelogram(corner(0, 0), across, tread * steps as f64));
    triangles.extend(parallelogram(corner(steps, 0), across, rise * steps as f64));
    triangles
}
