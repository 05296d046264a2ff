//! Part of an exported mesh.

use crate::Material;
use crate::triangle::Triangle;

/// The triangles of a material.
pub(super) struct Part<'a> {
    pub material: &'a Material,
    pub triangles: Vec<Triangle>,
}
