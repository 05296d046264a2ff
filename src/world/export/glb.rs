//! glTF 2.0, binary (specification of Khronos, sections 3.6 and 4.4).

use super::part::Part;
use serde_json::{Value, json};
use std::io::{Error, ErrorKind};
use zsim_base::geometry::Vector;

/// Component type and primitive mode of glTF: 32-bit floats, triangles.
const FLOAT: u32 = 5126;
const TRIANGLES: u32 = 4;
/// Bytes of a corner.
const CORNER_BYTES: usize = 12;

/// The bytes of the file: one node with one primitive for each part.
pub(super) fn encode(name: &str, parts: &[Part<'_>]) -> std::io::Result<Vec<u8>> {
    let mut blob = Vec::new();
    let (mut views, mut accessors, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
    for (index, part) in parts.iter().enumerate() {
        let offset = blob.len();
        let corners = part.triangles.iter().flatten().map(y_up);
        let (mut lower, mut upper) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for corner in corners {
            for axis in 0..3 {
                lower[axis] = lower[axis].min(corner[axis]);
                upper[axis] = upper[axis].max(corner[axis]);
                blob.extend(corner[axis].to_le_bytes());
            }
        }
        let length = blob.len() - offset;
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length }));
        accessors.push(json!({ "bufferView": index, "componentType": FLOAT, "count": length / CORNER_BYTES,
            "type": "VEC3", "min": lower, "max": upper }));
        primitives.push(json!({ "attributes": { "POSITION": index }, "material": index, "mode": TRIANGLES }));
    }
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("zsim ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": primitives }],
        "materials": parts.iter().map(material).collect::<Vec<_>>(),
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": blob.len() }],
    });
    container(serde_json::to_vec(&document)?, blob)
}

/// The header and the two chunks, each padded to four bytes.
fn container(mut json: Vec<u8>, mut blob: Vec<u8>) -> std::io::Result<Vec<u8>> {
    json.resize(json.len().next_multiple_of(4), b' ');
    blob.resize(blob.len().next_multiple_of(4), 0);
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| Error::new(ErrorKind::FileTooLarge, "a .glb file is limited to 4 GiB"))
    };
    let total = length(12 + 8 + json.len() + 8 + blob.len())?;
    let mut bytes = Vec::with_capacity(total as usize);
    bytes.extend(b"glTF");
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend(total.to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &blob)] {
        bytes.extend(length(chunk.len())?.to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    Ok(bytes)
}

/// The grey of a material's reflectance; transparent as far as it transmits light.
fn material(part: &Part<'_>) -> Value {
    let (grey, alpha) = (part.material.reflectance, 1.0 - part.material.transmission);
    let mode = if part.material.is_transparent() { "BLEND" } else { "OPAQUE" };
    json!({
        "name": part.material.name,
        "doubleSided": true,
        "alphaMode": mode,
        "pbrMetallicRoughness": {
            "baseColorFactor": [grey, grey, grey, alpha], "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
    })
}

/// A corner in the axes of glTF: y up, and the front along -z stays where y was.
fn y_up(corner: &Vector) -> [f32; 3] {
    [corner.x as f32, corner.z as f32, -corner.y as f32]
}
