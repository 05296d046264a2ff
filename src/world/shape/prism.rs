//! Boxes, cylinders and stairs: closed surfaces with outward faces.

use crate::triangle::{Triangle, parallelogram};
use zsim_base::geometry::Vector;

/// The box with edges along the axes from `corner`, of size `size`.
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

/// The prism about z over a regular polygon with `sides` corners at `radius`.
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

/// A flight of `steps` that climbs along x; `step` is tread, width, rise. The soffit is `slab` below the inner edges of
/// the steps, sloped; at z = 0 for a slab of 0.
pub(super) fn stairs(steps: usize, step: Vector, slab: f64) -> Vec<Triangle> {
    let across = Vector::y() * step.y;
    let at = |k: usize, height: f64| Vector::new(k as f64 * step.x, -step.y / 2.0, height);
    let top = |k: usize| k as f64 * step.z;
    let below = |k: usize| if slab > 0.0 { top(k) - slab } else { 0.0 };
    let mut triangles = Vec::with_capacity(steps * 10 + 4);
    for k in 0..steps {
        let front = if k == 0 { below(0) } else { top(k) };
        let [inner, outer] = [at(k, top(k + 1)), at(k + 1, top(k + 1))];
        let [under, under_next] = [at(k, below(k)), at(k + 1, below(k + 1))];
        triangles.extend(parallelogram(at(k, front), inner - at(k, front), across));
        triangles.extend(parallelogram(inner, outer - inner, across));
        triangles.extend(parallelogram(under, across, under_next - under));
        triangles.extend([[under, under_next, outer], [under, outer, inner]]);
        triangles.extend([[under, outer, under_next], [under, inner, outer]].map(|side| side.map(|c| c + across)));
    }
    let end = at(steps, below(steps));
    triangles.extend(parallelogram(end, across, at(steps, top(steps)) - end));
    triangles
}
