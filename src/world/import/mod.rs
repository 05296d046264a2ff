//! Meshes from files. A file is measured before it is parsed, and checked after: whatever it holds, the answer is
//! triangles with an area, or a sentence.

mod gltf;
mod obj;
mod ply;
mod stl;

use super::shape::{Triangle, UpAxis};
use crate::geometry::Vector;
use std::path::Path;

/// Largest file of a mesh: twice the triangles that a scene may have, as binary STL.
const MAX_BYTES: u64 = 1 << 30;
/// Largest share of triangles without area that a mesh may have.
const MAX_SHARE_WITHOUT_AREA: f64 = 0.1;
/// A triangle is flat when its height is less than this part of its longest edge.
const FLAT: f64 = 1e-6;

/// The triangles of a mesh.
#[derive(Debug)]
pub(super) struct MeshTriangles {
    /// Those that have an area.
    pub triangles: Vec<Triangle>,
    /// How many were left out because they have none.
    pub without_area: usize,
}

/// Why a mesh cannot be used. The file's name stands before it.
#[derive(Debug, thiserror::Error)]
pub(super) enum MeshError {
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    #[error("has {0} bytes; a mesh has at most {MAX_BYTES}")]
    TooLarge(u64),
    #[error("ends in neither .obj, .stl, .ply, .gltf nor .glb")]
    UnknownFormat,
    #[error(
        "is a COLLADA file, which is not read: convert it to glTF with Blender (import the .dae, export as .glb) or with `assimp export model.dae model.glb`"
    )]
    Collada,
    #[error("is no {format} mesh: {problem}")]
    Malformed { format: &'static str, problem: String },
    #[error("says it has {said}, but holds {found}")]
    Lies { said: String, found: String },
    #[error("face {face} names the vertex {index}; there are {vertices}")]
    NoSuchVertex { face: usize, index: i64, vertices: usize },
    #[error("has no triangles")]
    Empty,
    #[error("triangle {0} has a corner that is not finite")]
    NotFinite(usize),
    #[error(
        "{without} of its {all} triangles have no area (thinner than a millionth of their length); at most 10 % may: repair the mesh"
    )]
    WithoutArea { without: usize, all: usize },
}

/// Reads the mesh in a file; `scale` is metres per unit of it, `up` the axis that points up where that is not its
/// format's own.
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

/// How a file is read: the triangles as it has them, and the axis that points up unless the scene says otherwise.
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
        // The specification of glTF 2.0 has y up (section 3.4).
        "gltf" | "glb" => Ok(Format { parse: |bytes, path| gltf::parse(&bytes, path.parent()), up: UpAxis::Y }),
        "dae" => Err(MeshError::Collada),
        _ => Err(MeshError::UnknownFormat),
    }
}

/// Scales triangles, and removes those that have no area, unless they are too many.
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
    if without as f64 > MAX_SHARE_WITHOUT_AREA * all as f64 {
        return Err(MeshError::WithoutArea { without, all });
    }
    Ok(MeshTriangles { triangles: with_area, without_area: without })
}

/// Whether a triangle is thinner than a millionth of its longest edge.
fn is_flat([a, b, c]: &Triangle) -> bool {
    let edges = [b - a, c - b, a - c];
    let longest = edges.iter().map(Vector::norm).fold(0.0, f64::max);
    let twice_area = edges[0].cross(&edges[1]).norm();
    twice_area <= FLAT * longest * longest
}

/// The triangles of polygons, each as a fan around its first corner; indices count from 0.
fn fans(vertices: &[Vector], polygons: impl Iterator<Item = Vec<i64>>) -> Result<Vec<Triangle>, MeshError> {
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
