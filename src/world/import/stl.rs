//! STL, binary and ASCII. Both can start with `solid`; the file length distinguishes them.

use super::error::MeshError;
use crate::triangle::Triangle;
use std::io::Cursor;
use zsim_base::geometry::Vector;

const HEADER: usize = 84;
const RECORD: usize = 50;

/// The triangles of an STL file.
pub(super) fn parse(mut bytes: Vec<u8>) -> Result<Vec<Triangle>, MeshError> {
    let declared = binary_count(&bytes);
    let is_binary_length = declared.is_some_and(|count| bytes.len() == HEADER + RECORD * count);
    let is_ascii = !is_binary_length && bytes.starts_with(b"solid");
    if is_binary_length {
        // The reader treats a file that starts with `solid` as ASCII.
        bytes[..5].fill(b' ');
    } else if !is_ascii {
        let count = declared.ok_or_else(|| malformed(format!("{} bytes are too few for a header", bytes.len())))?;
        let (declared, found) = (format!("{count} triangles ({} bytes)", HEADER + RECORD * count), bytes.len());
        return Err(MeshError::CountMismatch { declared, found: format!("{found} bytes") });
    }
    let facets = if is_ascii { count_of(b"endfacet", &bytes) } else { declared.unwrap_or_default() };
    let mut cursor = Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut cursor).map_err(|error| malformed(error.to_string()))?;
    let mut triangles = Vec::with_capacity(facets);
    for triangle in reader {
        let triangle = triangle.map_err(|error| malformed(error.to_string()))?;
        triangles.push(triangle.vertices.map(|corner| Vector::from(corner.0.map(f64::from))));
    }
    if triangles.len() < facets {
        let after = facets - triangles.len();
        let problem = format!("{after} of its {facets} facets follow the end of the first solid: merge the solids");
        return Err(malformed(problem));
    }
    Ok(triangles)
}

/// The triangle count in the header of a binary file.
fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    usize::try_from(u32::from_le_bytes(count.try_into().ok()?)).ok()
}

fn count_of(word: &[u8], bytes: &[u8]) -> usize {
    bytes.windows(word.len()).filter(|window| *window == word).count()
}

fn malformed(problem: String) -> MeshError {
    MeshError::Malformed { format: "STL", problem }
}
