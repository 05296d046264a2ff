//! The triangles of a scene that a page shows.

use super::MAX_PAGE_TRIANGLES;
use zsim_base::geometry::Vector;
use zsim_world::{MaterialId, World};

/// Corners of a triangle, in the world.
pub(crate) type Triangle = [Vector; 3];

/// Returns the static triangles of a scene that a page shows, and whether others are left out.
pub fn static_surfaces(world: &World) -> (Vec<Triangle>, bool) {
    let (largest, are_partial) = largest(world.triangles().collect());
    (largest.into_iter().map(|(triangle, _)| triangle).collect(), are_partial)
}

/// Returns the largest triangles, at most [`MAX_PAGE_TRIANGLES`], and whether others are left out.
pub(crate) fn largest(mut triangles: Vec<(Triangle, MaterialId)>) -> (Vec<(Triangle, MaterialId)>, bool) {
    let are_partial = triangles.len() > MAX_PAGE_TRIANGLES;
    if are_partial {
        triangles.sort_by(|(a, _), (b, _)| area_m2(b).total_cmp(&area_m2(a)));
        triangles.truncate(MAX_PAGE_TRIANGLES);
    }
    (triangles, are_partial)
}

/// Returns the area of a triangle, m^2.
pub(crate) fn area_m2([a, b, c]: &Triangle) -> f64 {
    (b - a).cross(&(c - a)).norm() / 2.0
}
