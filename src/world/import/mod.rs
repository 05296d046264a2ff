//! Meshes from files. The file size is checked before parsing and the triangles afterwards, so that any file gives
//! either triangles with an area or an error message.

mod error;
mod gltf;
mod obj;
mod ply;
mod polygon;
mod stl;

pub(super) use error::MeshError;

use super::shape::UpAxis;
use super::triangle::Triangle;
use error::MAX_BYTES;
use std::path::Path;
use zsim_base::geometry::Vector;

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

impl MeshTriangles {
    /// The longest side of the bounding box, m.
    pub fn size_m(&self) -> f64 {
        let side = |axis: usize| {
            let coordinates = self.triangles.iter().flatten().map(|corner| corner[axis]);
            let (low, high) = coordinates.fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        (0..3).map(side).fold(0.0, f64::max)
    }
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
