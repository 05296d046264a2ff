//! Meshes of a scene for other programs: glTF, OBJ and STL.

mod glb;
mod obj;
mod part;
mod stl;

pub use stl::stl;

use super::World;
use part::Part;
use std::path::Path;

/// File format of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// glTF 2.0, binary: one primitive for each material, y up as the format demands.
    Glb,
    /// Wavefront OBJ: one group for each material, z up.
    Obj,
    /// STL, binary: without materials, z up.
    Stl,
}

impl MeshFormat {
    /// The format with the ending of a file's name; `None` if there is none.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "glb" => Some(Self::Glb),
            "obj" => Some(Self::Obj),
            "stl" => Some(Self::Stl),
            _ => None,
        }
    }
}

impl World {
    /// The static surfaces as a mesh file, m. Corners are accurate to single precision.
    ///
    /// # Errors
    /// If the mesh does not fit the format: glTF and STL count bytes and triangles in 32 bits.
    pub fn mesh(&self, format: MeshFormat) -> std::io::Result<Vec<u8>> {
        let mut parts: Vec<Part<'_>> =
            self.materials().iter().map(|material| Part { material, triangles: Vec::new() }).collect();
        for (triangle, material) in self.triangles() {
            parts[material.index()].triangles.push(triangle);
        }
        parts.retain(|part| !part.triangles.is_empty());
        match format {
            MeshFormat::Glb => glb::encode(self.name(), &parts),
            MeshFormat::Obj => Ok(obj::encode(self.name(), &parts).into_bytes()),
            MeshFormat::Stl => stl(parts.iter().flat_map(|part| &part.triangles)),
        }
    }
}
