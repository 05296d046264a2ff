//! Errors of meshes.

use super::polygon::FaceFault;
use crate::triangle::{MAX_TRIANGLES, MAX_VERTICES};

/// Maximum size of a mesh's file, and of the buffers of a glTF file together, bytes: twice the maximum number of triangles of
/// a scene as binary STL.
pub(super) const MAX_BYTES: u64 = 1 << 30;

/// Why a mesh cannot be used. The name of the file precedes the message.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MeshError {
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    #[error("has {0} bytes; a mesh has at most {MAX_BYTES}")]
    TooLarge(u64),
    #[error("has more than {MAX_TRIANGLES} triangles")]
    TooManyTriangles,
    #[error("has more than {MAX_VERTICES} vertices")]
    TooManyVertices,
    #[error("has too many faces with thousands of corners: export it with triangles")]
    TooManyCorners,
    #[error("has more than {} materials", u16::MAX)]
    TooManyMaterials,
    #[error("ends in neither .obj, .stl, .ply, .gltf nor .glb")]
    UnknownFormat,
    #[error(
        "is a COLLADA file, which is not supported: convert it to glTF with Blender (import the .dae, export as .glb) or with `assimp export model.dae model.glb`"
    )]
    Collada,
    #[error("is UTF-16 text: save it as UTF-8, for example with `iconv -f UTF-16 -t UTF-8`")]
    Utf16,
    #[error("is not a valid {format} mesh: {problem}")]
    Malformed { format: &'static str, problem: String },
    #[error("declares {declared}, but contains {found}")]
    CountMismatch { declared: String, found: String },
    #[error("face {face} {fault}")]
    Face { face: usize, fault: FaceFault },
    #[error("face {face} names the vertex {index}; there are {vertices}")]
    NoSuchVertex { face: usize, index: i64, vertices: usize },
    #[error("has no triangles")]
    Empty,
    #[error("triangle {0} has a corner that is not finite")]
    NotFinite(usize),
    #[error(
        "{without} of its {all} triangles have no area (thinner than a millionth of their length); the maximum is 10 %: repair the mesh"
    )]
    WithoutArea { without: usize, all: usize },
}
