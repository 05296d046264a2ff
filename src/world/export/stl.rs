//! Binary STL.

use stl_io::{Normal, Triangle, Vertex};
use zsim_base::geometry::Vector;

/// Triangles as a binary STL file: corners counterclockwise from outside, m, accurate to single precision.
///
/// # Errors
/// If there are more triangles than STL can count in 32 bits.
pub fn stl<'a>(triangles: impl Iterator<Item = &'a [Vector; 3]>) -> std::io::Result<Vec<u8>> {
    let single = |v: &Vector| [v.x as f32, v.y as f32, v.z as f32];
    let face = |[a, b, c]: &[Vector; 3]| Triangle {
        normal: Normal::new(single(&(b - a).cross(&(c - a)).normalize())),
        vertices: [a, b, c].map(|corner| Vertex::new(single(corner))),
    };
    let faces: Vec<Triangle> = triangles.map(face).collect();
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, faces.iter())?;
    Ok(bytes)
}
