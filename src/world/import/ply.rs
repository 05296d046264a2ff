//! PLY, ASCII and binary: the elements `vertex` (x, y, z) and `face` (`vertex_indices` or `vertex_index`).

use super::error::MeshError;
use super::polygon::triangulate;
use crate::triangle::Triangle;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Header, Property, PropertyAccess, PropertyAccessResult};
use std::io::BufRead;
use zsim_base::geometry::Vector;

/// The triangles of a PLY file; polygons are split into fans.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(malformed)?;
    let (mut vertices, mut faces) = (None, None);
    for element in header.elements.values() {
        check_count(element, bytes.len())?;
        match element.name.as_str() {
            "vertex" => vertices = Some(read::<Vertex, _>(&mut reader, element, &header)?),
            "face" => faces = Some(read::<Face, _>(&mut reader, element, &header)?),
            _ => drop(read::<Skipped, _>(&mut reader, element, &header)?),
        }
    }
    let missing = |name: &str| MeshError::Malformed { format: "PLY", problem: format!("it has no element `{name}`") };
    let vertices: Vec<Vector> = vertices.ok_or_else(|| missing("vertex"))?.into_iter().map(|vertex| vertex.0).collect();
    triangulate(&vertices, faces.ok_or_else(|| missing("face"))?.into_iter().map(|face| face.0))
}

/// An element has at least one byte, so a larger count is wrong, and parsing it would take long.
fn check_count(element: &ElementDef, bytes: usize) -> Result<(), MeshError> {
    if element.count <= bytes && !element.properties.is_empty() {
        return Ok(());
    }
    let declared = format!("{} of `{}` with {} properties", element.count, element.name, element.properties.len());
    Err(MeshError::CountMismatch { declared, found: format!("{bytes} bytes") })
}

fn read<E: PropertyAccess, B: BufRead>(
    reader: &mut Reader<B>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, MeshError> {
    Parser::<E>::new().read_payload_for_element(reader, element, header).map_err(malformed)
}

#[expect(clippy::needless_pass_by_value, reason = "it is handed to map_err")]
fn malformed(error: ParseError) -> MeshError {
    // The message of the parser quotes the failing line, which may be an entire binary file.
    let first = error.to_string().lines().next().unwrap_or_default().chars().take(200).collect();
    MeshError::Malformed { format: "PLY", problem: first }
}

struct Vertex(Vector);
struct Face(Vec<i64>);
struct Skipped;

impl PropertyAccess for Vertex {
    fn new() -> Self {
        // A missing coordinate stays NaN, which the check of the corners detects.
        Self(Vector::repeat(f64::NAN))
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.0[axis] = match property {
            Property::Char(x) => x.into(),
            Property::UChar(x) => x.into(),
            Property::Short(x) => x.into(),
            Property::UShort(x) => x.into(),
            Property::Int(x) => x.into(),
            Property::UInt(x) => x.into(),
            Property::Float(x) => x.into(),
            Property::Double(x) => x,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        fn widened<T: Into<i64>>(list: Vec<T>) -> Vec<i64> {
            list.into_iter().map(Into::into).collect()
        }
        if !["vertex_indices", "vertex_index"].contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match property {
            Property::ListChar(list) => widened(list),
            Property::ListUChar(list) => widened(list),
            Property::ListShort(list) => widened(list),
            Property::ListUShort(list) => widened(list),
            Property::ListInt(list) => widened(list),
            Property::ListUInt(list) => widened(list),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
