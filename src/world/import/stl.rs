//! STL, binary and ASCII. Both can start with `solid`; the file length distinguishes them.

use super::builder::{Faces, MeshBuilder};
use super::error::MeshError;
use super::polygon::MAX_CORNERS;
use super::text;
use zsim_base::geometry::Vector;

const HEADER: usize = 84;
const RECORD: usize = 50;
/// Corners in a binary record, after the normal: three of three floats of four bytes each.
const CORNERS: std::ops::Range<usize> = 12..48;

/// The triangles of an STL file.
pub(super) fn parse(bytes: &[u8]) -> Result<Faces, MeshError> {
    let declared = binary_count(bytes);
    if let Some(count) = declared.filter(|count| bytes.len() == HEADER + RECORD * count) {
        return parse_binary(&bytes[HEADER..], count);
    }
    // Zero bytes are in no text: a binary file that is cut can start with `solid` as well.
    let start = text::without_mark(bytes).trim_ascii_start();
    if start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !bytes.contains(&0) {
        return parse_text(bytes);
    }
    let count = declared.ok_or_else(|| malformed(format!("{} bytes are too few for a header", bytes.len())))?;
    let (declared, found) = (format!("{count} triangles ({} bytes)", HEADER + RECORD * count), bytes.len());
    Err(MeshError::CountMismatch { declared, found: format!("{found} bytes") })
}

/// The triangle count in the header of a binary file.
fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    usize::try_from(u32::from_le_bytes(count.try_into().ok()?)).ok()
}

fn parse_binary(records: &[u8], count: usize) -> Result<Faces, MeshError> {
    let mut mesh = MeshBuilder::default();
    mesh.reserve(count)?;
    for record in records.chunks_exact(RECORD) {
        let mut numbers =
            record[CORNERS].chunks_exact(4).map(|x| f64::from(f32::from_le_bytes([x[0], x[1], x[2], x[3]])));
        let mut number = || numbers.next().unwrap_or(f64::NAN);
        mesh.triangle([0; 3].map(|_: i32| Vector::new(number(), number(), number())))?;
    }
    Ok(mesh.finish())
}

/// Reads the loops of all solids. Keywords are in any case; the name of a solid can be any words.
fn parse_text(bytes: &[u8]) -> Result<Faces, MeshError> {
    let mut mesh = MeshBuilder::default();
    let mut corners: Vec<Vector> = Vec::new();
    for (number, line) in text::lines(bytes) {
        let at_line = |problem: &str| malformed(format!("line {number}: {problem}"));
        let mut words = line.split_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") if corners.len() <= MAX_CORNERS => {
                corners.push(text::point(words).ok_or_else(|| at_line("`vertex` wants three numbers"))?);
            }
            Some("endloop") => {
                if corners.len() < 3 {
                    return Err(at_line("a facet has at least three corners"));
                }
                mesh.polygon(&std::mem::take(&mut corners))?;
            }
            Some("solid" | "endsolid" | "facet" | "outer" | "vertex" | "endfacet") | None => {}
            Some(_) => return Err(at_line("it does not begin with a keyword of STL")),
        }
    }
    if corners.is_empty() { Ok(mesh.finish()) } else { Err(malformed("it ends within a facet".to_owned())) }
}

fn malformed(problem: String) -> MeshError {
    MeshError::Malformed { format: "STL", problem }
}
