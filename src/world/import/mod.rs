//! Meshes from files. The file size is checked before parsing and the triangles afterwards, so that any file gives
//! either triangles with an area or an error message.

mod builder;
mod error;
mod file;
mod gltf;
mod obj;
mod ply;
mod polygon;
mod stl;
mod text;

pub(super) use error::MeshError;

use super::shape::UpAxis;
use super::triangle::Triangle;
use builder::Faces;
use error::MAX_BYTES;
use file::read_file;
use std::path::Path;
use zsim_base::geometry::Vector;

/// Maximum fraction of triangles without area: a mesh with more is damaged.
const MAX_FRACTION_WITHOUT_AREA: f64 = 0.1;
/// A triangle counts as flat if its height is below this fraction of the longest edge.
const FLAT_RATIO: f64 = 1e-6;

/// The triangles of a mesh.
#[derive(Debug, Default)]
pub(super) struct MeshTriangles {
    /// Triangles with non-zero area.
    pub triangles: Vec<Triangle>,
    /// Material of each triangle: 0 for none, otherwise the number in `material_names`, from 1. Empty if the shape has none.
    pub materials: Vec<u16>,
    /// Names of the materials in the file.
    pub material_names: Vec<String>,
    /// Number of removed triangles without area.
    pub without_area: usize,
}

impl MeshTriangles {
    /// Triangles without materials of their own.
    pub fn plain(triangles: Vec<Triangle>) -> Self {
        Self { triangles, ..Self::default() }
    }

    /// Lower and upper corner of the bounding box, m.
    pub fn bounds(&self) -> (Vector, Vector) {
        let first = self.triangles.first().map_or(Vector::zeros(), |[corner, ..]| *corner);
        let corners = self.triangles.iter().flatten();
        corners.fold((first, first), |(lower, upper), corner| (lower.inf(corner), upper.sup(corner)))
    }
}

/// Reads the mesh in a file. `scale` is metres per unit of the file; `up` overrides the up axis of the format.
pub(super) fn read(path: &Path, scale: f64, up: Option<UpAxis>) -> Result<MeshTriangles, MeshError> {
    let format = format_of(path)?;
    let bytes = read_file(path, MAX_BYTES)?;
    if text::is_utf16(&bytes) {
        return Err(MeshError::Utf16);
    }
    let mut faces = (format.parse)(&bytes, path)?;
    if up.unwrap_or(format.up) == UpAxis::Y {
        faces.triangles.iter_mut().flatten().for_each(|corner| *corner = Vector::new(corner.x, -corner.z, corner.y));
    }
    check(faces, scale)
}

/// A file format: parser and default up axis.
struct Format {
    parse: fn(&[u8], &Path) -> Result<Faces, MeshError>,
    up: UpAxis,
}

fn format_of(path: &Path) -> Result<Format, MeshError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "obj" => Ok(Format { parse: |bytes, _| obj::parse(bytes), up: UpAxis::Z }),
        "stl" => Ok(Format { parse: |bytes, _| stl::parse(bytes), up: UpAxis::Z }),
        "ply" => Ok(Format { parse: |bytes, _| ply::parse(bytes), up: UpAxis::Z }),
        // y is up in glTF 2.0 (specification, section 3.4).
        "gltf" | "glb" => Ok(Format { parse: |bytes, path| gltf::parse(bytes, path.parent()), up: UpAxis::Y }),
        "dae" => Err(MeshError::Collada),
        _ => Err(MeshError::UnknownFormat),
    }
}

/// Scales triangles, and removes triangles without area unless there are too many.
fn check(faces: Faces, scale: f64) -> Result<MeshTriangles, MeshError> {
    let Faces { mut triangles, mut materials, names } = faces;
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    triangles.iter_mut().flatten().for_each(|corner| *corner *= scale);
    if let Some(at) = triangles.iter().position(|triangle| !triangle.iter().flatten().all(|x| x.is_finite())) {
        return Err(MeshError::NotFinite(at + 1));
    }
    let all = triangles.len();
    let has_area: Vec<bool> = triangles.iter().map(|triangle| !is_flat(triangle)).collect();
    let mut keeps = has_area.iter();
    triangles.retain(|_| keeps.next() == Some(&true));
    let mut keeps = has_area.iter();
    materials.retain(|_| keeps.next() == Some(&true));
    let without = all - triangles.len();
    if without as f64 > MAX_FRACTION_WITHOUT_AREA * all as f64 {
        return Err(MeshError::WithoutArea { without, all });
    }
    Ok(MeshTriangles { triangles, materials, material_names: names, without_area: without })
}

/// Whether a triangle is thinner than a millionth of the longest edge.
fn is_flat([a, b, c]: &Triangle) -> bool {
    let edges = [b - a, c - b, a - c];
    let longest = edges.iter().map(Vector::norm).fold(0.0, f64::max);
    let twice_area = edges[0].cross(&edges[1]).norm();
    twice_area <= FLAT_RATIO * longest * longest
}
