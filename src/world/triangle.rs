//! Triangles of a scene.

use super::MaterialId;
use zsim_base::geometry::Vector;

/// Maximum number of triangles of a scene: each needs about 450 bytes while the scene is built.
pub(super) const MAX_TRIANGLES: usize = 10_000_000;
/// Maximum number of vertices of a mesh: as many as its triangles can have corners.
pub(super) const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;

/// Three corners, m.
pub(super) type Triangle = [Vector; 3];

/// Triangles with one material each.
#[derive(Default)]
pub(super) struct Surfaces {
    pub triangles: Vec<Triangle>,
    pub materials: Vec<MaterialId>,
    /// Number of the solid that each triangle belongs to: one placed shape.
    pub solids: Vec<u32>,
}

/// The two triangles of a parallelogram, in sequence, so that the ray caster can pair them.
pub(super) fn parallelogram(corner: Vector, u: Vector, v: Vector) -> [Triangle; 2] {
    [[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]]
}
