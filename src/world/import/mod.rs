//! Meshes from files. The file size is checked before parsing and the triangles afterwards, so that any file gives
//! either triangles with an area or an error message.

mod gltf;
mod obj;
mod ply;
mod stl;

use super::shape::{Triangle, UpAxis};
use crate::geometry::Vector;
use std::path::Path;

/// Maximum file size, bytes: twice the maximum number of triangles of a scene as binary STL.
const MAX_BYTES: u64 = 1 << 30;
/// Maximum fraction of triangles without area: a mesh with more is damaged.
const MAX_FRACTION_WITHOUT_AREA: f64 = 0.1;
/// A triangle counts as flat if its height is below this fraction of the longest edge.
const FLAT_RATIO: f64 = 1e-6;

/// The triangles of a mesh.
#[derive(Debug)]
pub(super) struct MeshTriangles {
    /// Triangles with non-zero area.
    pub triangles: Vec<Triangle>,
    /// Number of removed triangles without area.
    pub without_area: usize,
}

/// Why a mesh cannot be used. The name of the file precedes the message.
#[derive(Debug, thiserror::Error)]
pub(super) enum MeshError {
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    #[error("has {0} bytes; a mesh has at most {MAX_BYTES}")]
    TooLarge(u64),
    #[error("ends in neither .obj, .stl, .ply, .gltf nor .glb")]
    UnknownFormat,
    #[error(
        "is a COLLADA file, which is not supported: convert it to glTF with Blender (import the .dae, export as .glb) or with `assimp export model.dae model.glb`"
    )]
    Collada,
    #[error("is not a valid {format} mesh: {problem}")]
    Malformed { format: &'static str, problem: String },
    #[error("declares {declared}, but contains {found}")]
    CountMismatch { declared: String, found: String },
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

/// Reads the mesh in a file. `scale` is metres per unit of the file; `up` overrides the up axis of the format.
pub(super) fn read(path: &Path, scale: f64, up: Option<UpAxis>) -> Result<MeshTriangles, MeshError> {
    let meta = std::fs::metadata(path)?;
    if !meta.is_file() {
        return Err(MeshError::Io(std::io::Error::other("it is not a file")));
    }
    if meta.len() > MAX_BYTES {
        return Err(MeshError::TooLarge(meta.len()));
    }
    let Format { parse, up: own_up } = format_of(path)?;
    let mut triangles = parse(std::fs::read(path)?, path)?;
    if up.unwrap_or(own_up) == UpAxis::Y {
        triangles.iter_mut().flatten().for_each(|corner| *corner = Vector::new(corner.x, -corner.z, corner.y));
    }
    check(triangles, scale)
}

/// A file format: parser and default up axis.
struct Format {
    parse: fn(Vec<u8>, &Path) -> Result<Vec<Triangle>, MeshError>,
    up: UpAxis,
}

fn format_of(path: &Path) -> Result<Format, MeshError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "obj" => Ok(Format { parse: |bytes, _| obj::parse(&bytes), up: UpAxis::Z }),
        "stl" => Ok(Format { parse: |bytes, _| stl::parse(bytes), up: UpAxis::Z }),
        "ply" => Ok(Format { parse: |bytes, _| ply::parse(&bytes), up: UpAxis::Z }),
        // y is up in glTF 2.0 (specification, section 3.4).
        "gltf" | "glb" => Ok(Format { parse: |bytes, path| gltf::parse(&bytes, path.parent()), up: UpAxis::Y }),
        "dae" => Err(MeshError::Collada),
        _ => Err(MeshError::UnknownFormat),
    }
}

/// Scales triangles, and removes triangles without area unless there are too many.
fn check(triangles: Vec<Triangle>, scale: f64) -> Result<MeshTriangles, MeshError> {
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    let is_finite = |triangle: &Triangle| triangle.iter().flatten().all(|x| (x * scale).is_finite());
    if let Some(at) = triangles.iter().position(|triangle| !is_finite(triangle)) {
        return Err(MeshError::NotFinite(at + 1));
    }
    let all = triangles.len();
    let triangles: Vec<Triangle> =
        triangles.into_iter().map(|triangle| triangle.map(|corner| corner * scale)).collect();
    let with_area: Vec<Triangle> = triangles.into_iter().filter(|triangle| !is_flat(triangle)).collect();
    let without = all - with_area.len();
    if without as f64 > MAX_FRACTION_WITHOUT_AREA * all as f64 {
        return Err(MeshError::WithoutArea { without, all });
    }
    Ok(MeshTriangles { triangles: with_area, without_area: without })
}

/// Whether a triangle is thinner than a millionth of the longest edge.
fn is_flat([a, b, c]: &Triangle) -> bool {
    let edges = [b - a, c - b, a - c];
    let longest = edges.iter().map(Vector::norm).fold(0.0, f64::max);
    let twice_area = edges[0].cross(&edges[1]).norm();
    twice_area <= FLAT_RATIO * longest * longest
}

/// Splits polygons into fans of triangles around their first corners; indices start at 0.
fn triangulate(vertices: &[Vector], polygons: impl Iterator<Item = Vec<i64>>) -> Result<Vec<Triangle>, MeshError> {
    let mut triangles = Vec::new();
    for (face, polygon) in polygons.enumerate() {
        let corner = |index: i64| {
            let found = usize::try_from(index).ok().and_then(|index| vertices.get(index)).copied();
            found.ok_or(MeshError::NoSuchVertex { face: face + 1, index, vertices: vertices.len() })
        };
        let corners = polygon.into_iter().map(corner).collect::<Result<Vec<Vector>, _>>()?;
        if let [first, rest @ ..] = corners.as_slice() {
            triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
    }
    Ok(triangles)
}
