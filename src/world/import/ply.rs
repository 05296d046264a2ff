//! PLY, ASCII and binary: the elements `vertex` (x, y, z) and `face` (`vertex_indices` or `vertex_index`).

use super::builder::{Faces, MeshBuilder, corners};
use super::error::MeshError;
use crate::triangle::MAX_VERTICES;
use zsim_base::geometry::Vector;
use zsim_base::ply::{Element, Failure, PlyReader, Row};

/// The triangles of a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<Faces, MeshError> {
    let mut file = PlyReader::new(bytes).map_err(|(line, problem)| at_line(line, &problem))?;
    let (mut vertices, mut mesh) = (None, MeshBuilder::default());
    let mut has_faces = false;
    for element in file.header().elements.clone() {
        check_count(&element, bytes.len())?;
        match element.name.as_str() {
            "vertex" => vertices = Some(read_vertices(&mut file, &element)?),
            "face" => {
                let vertices = vertices.as_ref().ok_or_else(|| malformed("its faces are before its vertices"))?;
                read_faces(&mut file, &element, vertices, &mut mesh)?;
                has_faces = true;
            }
            _ => read_each(&mut file, &element, |_| Ok(()))?,
        }
    }
    match (vertices, has_faces) {
        (None, _) => Err(malformed("it has no element `vertex`")),
        (_, false) => Err(malformed("it has no element `face`: it is a point cloud, not a mesh")),
        (Some(_), true) => Ok(mesh.finish()),
    }
}

fn read_vertices(file: &mut PlyReader<&[u8]>, element: &Element) -> Result<Vec<Vector>, MeshError> {
    let axis = |name| element.property(&[name]).ok_or_else(|| malformed("its vertices have no properties x, y and z"));
    let axes = [axis("x")?, axis("y")?, axis("z")?];
    if element.count > MAX_VERTICES as u64 {
        return Err(MeshError::TooManyVertices);
    }
    let mut vertices = Vec::new();
    read_each(file, element, |row| {
        vertices.push(Vector::from(axes.map(|axis| row.number(axis))));
        Ok(())
    })?;
    Ok(vertices)
}

fn read_faces(
    file: &mut PlyReader<&[u8]>,
    element: &Element,
    vertices: &[Vector],
    mesh: &mut MeshBuilder,
) -> Result<(), MeshError> {
    let list = element.property(&["vertex_indices", "vertex_index"]);
    let list = list.ok_or_else(|| malformed("its faces have no property `vertex_indices`"))?;
    let mut indices: Vec<i64> = Vec::new();
    read_each(file, element, |row| {
        indices.clear();
        // A number with a fraction is no index, just as a negative one.
        indices.extend(row.property(list).iter().map(|index| if index.fract() == 0.0 { *index as i64 } else { -1 }));
        let corners = corners(vertices, &indices, mesh.next_face())?;
        mesh.polygon(&corners)
    })
}

/// Reads all elements of a kind.
fn read_each(
    file: &mut PlyReader<&[u8]>,
    element: &Element,
    mut each: impl FnMut(&Row) -> Result<(), MeshError>,
) -> Result<(), MeshError> {
    let mut row = Row::default();
    for index in 0..element.count {
        file.read(element, &mut row).map_err(|failure| match failure {
            Failure::Problem(problem) => at_line(file.line(), &problem),
            Failure::End => {
                let declared = format!("{} of `{}`", element.count, element.name);
                MeshError::CountMismatch { declared, found: index.to_string() }
            }
        })?;
        each(&row)?;
    }
    Ok(())
}

/// An element has at least one byte, so a larger count is wrong, and reading elements without properties would take long.
fn check_count(element: &Element, bytes: usize) -> Result<(), MeshError> {
    if element.count <= bytes as u64 && !element.properties.is_empty() {
        return Ok(());
    }
    let declared = format!("{} of `{}` with {} properties", element.count, element.name, element.properties.len());
    Err(MeshError::CountMismatch { declared, found: format!("{bytes} bytes") })
}

fn at_line(line: usize, problem: &str) -> MeshError {
    malformed(&format!("line {line}: {problem}"))
}

fn malformed(problem: &str) -> MeshError {
    MeshError::Malformed { format: "PLY", problem: problem.to_owned() }
}
