//! Binary STL.

use super::part::Part;
use stl_io::{Normal, Triangle, Vertex};

/// The bytes of the file.
pub(super) fn encode(parts: &[Part<'_>]) -> std::io::Result<Vec<u8>> {
    let single = |v: &crate::geometry::Vector| [v.x as f32, v.y as f32, v.z as f32];
    let faces: Vec<Triangle> = parts
        .iter()
        .flat_map(|part| &part.triangles)
        .map(|[a, b, c]| {
            let normal = (b - a).cross(&(c - a)).normalize();
            Triangle {
                normal: Normal::new(single(&normal)),
                vertices: [a, b, c].map(|corner| Vertex::new(single(corner))),
            }
        })
        .collect();
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, faces.iter())?;
    Ok(bytes)
}
