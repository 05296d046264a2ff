//! Triangles of polygons.

use super::error::MeshError;
use crate::triangle::Triangle;
use zsim_base::geometry::Vector;

/// Splits polygons into fans of triangles around their first corners; indices start at 0.
pub(super) fn triangulate(
    vertices: &[Vector],
    polygons: impl Iterator<Item = Vec<i64>>,
) -> Result<Vec<Triangle>, MeshError> {
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
