//! Wavefront OBJ: `v` and `f` statements; others (normals, textures, groups, materials) are ignored.

use super::error::MeshError;
use super::polygon::triangulate;
use crate::triangle::Triangle;
use zsim_base::geometry::Vector;

/// The triangles of an OBJ file; polygons are split into fans.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let text = std::str::from_utf8(bytes).map_err(|error| malformed(error.to_string()))?;
    let (mut vertices, mut polygons) = (Vec::new(), Vec::new());
    for (number, statement) in statements(text) {
        let mut words = statement.split_whitespace();
        let at_line = |problem: &str| malformed(format!("line {number}: {problem}"));
        match words.next() {
            Some("v") => vertices.push(vertex(words).ok_or_else(|| at_line("`v` wants three numbers"))?),
            Some("f") => {
                let corners: Option<Vec<i64>> = words.map(|word| corner(word, vertices.len())).collect();
                let corners = corners.ok_or_else(|| at_line("`f` wants indices such as 7, 7/1, 7//3 or -1"))?;
                if corners.len() < 3 {
                    return Err(at_line("a face has at least three corners"));
                }
                polygons.push(corners);
            }
            _ => {}
        }
    }
    triangulate(&vertices, polygons.into_iter())
}

fn malformed(problem: String) -> MeshError {
    MeshError::Malformed { format: "OBJ", problem }
}

/// Lines without comments, with their line numbers; a backslash at the end joins a line to the next.
fn statements(text: &str) -> impl Iterator<Item = (usize, String)> {
    let mut lines = text.lines().zip(1..);
    std::iter::from_fn(move || {
        let (line, number) = lines.next()?;
        let mut statement = line.split('#').next().unwrap_or_default().to_owned();
        while let Some(open) = statement.strip_suffix('\\').map(str::len) {
            statement.truncate(open);
            statement.push(' ');
            statement.push_str(lines.next().map_or("", |(line, _)| line.split('#').next().unwrap_or_default()));
        }
        Some((number, statement))
    })
}

/// The first three numbers; a weight or a colour can follow.
fn vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Vector> {
    let mut number = || words.next()?.parse().ok();
    Some(Vector::new(number()?, number()?, number()?))
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
