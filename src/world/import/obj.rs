//! Wavefront OBJ: vertices (`v`), faces (`f`) and names of materials (`usemtl`); other statements are ignored.

use super::builder::{Faces, MeshBuilder, corners};
use super::error::MeshError;
use super::polygon::MAX_CORNERS;
use super::text;
use crate::triangle::{MAX_TRIANGLES, MAX_VERTICES};
use std::borrow::Cow;
use zsim_base::geometry::Vector;

/// A statement of the file about its faces.
enum Statement {
    Material(String),
    /// A face, by the end of its corners in the list of all corners.
    Face(usize),
}

/// The triangles of an OBJ file.
pub(super) fn parse(bytes: &[u8]) -> Result<Faces, MeshError> {
    let (mut vertices, mut indices, mut found) = (Vec::new(), Vec::new(), Vec::new());
    // A face has at least as many corners as triangles and two more, so this bounds the corners too.
    let mut triangle_count = 0;
    for (number, statement) in statements(bytes) {
        let mut words = statement.split_whitespace();
        let at_line = |problem: &str| malformed(format!("line {number}: {problem}"));
        match words.next() {
            Some("v") => vertices.push(text::point(words).ok_or_else(|| at_line("`v` wants three numbers"))?),
            Some("f") => {
                let before = indices.len();
                for word in words.take(MAX_CORNERS + 1) {
                    let index = corner(word, vertices.len());
                    indices.push(index.ok_or_else(|| at_line("`f` wants indices such as 7, 7/1, 7//3 or -1"))?);
                }
                let count = indices.len() - before;
                if count < 3 {
                    return Err(at_line("a face has at least three corners"));
                }
                triangle_count += count - 2;
                found.push(Statement::Face(indices.len()));
            }
            Some("usemtl") => found.push(Statement::Material(words.collect::<Vec<_>>().join(" "))),
            _ => {}
        }
        if triangle_count > MAX_TRIANGLES || found.len() > 2 * MAX_TRIANGLES {
            return Err(MeshError::TooManyTriangles);
        }
        if vertices.len() > MAX_VERTICES {
            return Err(MeshError::TooManyVertices);
        }
    }
    built(&vertices, &indices, found)
}

/// Builds the faces after all vertices are known: some programs write the faces first.
fn built(vertices: &[Vector], indices: &[i64], statements: Vec<Statement>) -> Result<Faces, MeshError> {
    let (mut mesh, mut start) = (MeshBuilder::default(), 0);
    for statement in statements {
        match statement {
            Statement::Material(name) => mesh.set_material((!name.is_empty()).then_some(name.as_str()))?,
            Statement::Face(end) => {
                mesh.polygon(&corners(vertices, &indices[start..end], mesh.next_face())?)?;
                start = end;
            }
        }
    }
    Ok(mesh.finish())
}

fn malformed(problem: String) -> MeshError {
    MeshError::Malformed { format: "OBJ", problem }
}

/// Lines without comments, with their line numbers; a backslash at the end joins a line to the next.
fn statements(bytes: &[u8]) -> impl Iterator<Item = (usize, String)> {
    let mut lines = text::lines(bytes);
    let without_comment = |line: Cow<'_, str>| line.split('#').next().unwrap_or_default().to_owned();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let mut statement = without_comment(line);
        while let Some(open) = statement.strip_suffix('\\').map(str::len) {
            statement.truncate(open);
            statement.push(' ');
            statement.push_str(&lines.next().map_or_else(String::new, |(_, line)| without_comment(line)));
        }
        Some((number, statement))
    })
}

/// Vertex index of a corner, from 0. In the file a positive index starts at 1, a negative one counts back from the last
/// vertex.
fn corner(word: &str, vertices: usize) -> Option<i64> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    match index {
        0 => None,
        1.. => Some(index - 1),
        _ => i64::try_from(vertices).ok()?.checked_add(index),
    }
}
