//! glTF 2.0 (`.gltf` with buffers, or `.glb`): the triangles of the scene with the transforms of the nodes.

mod accessor;
mod document;
mod error;

use super::error::{MAX_BYTES, MeshError};
use super::polygon::triangulate;
use crate::triangle::{MAX_TRIANGLES, Triangle};
use accessor::{Data, base64};
use document::{Buffer, Document, Primitive};
use error::malformed;
use std::path::{Component, Path};
use zsim_base::geometry::Vector;

type Transform = nalgebra::Matrix4<f64>;

/// Maximum nesting depth, and maximum number of node visits: several nodes may refer to the same child.
const MAX_DEPTH: usize = 64;
const MAX_VISITS: usize = 1_000_000;

/// `mode` of a primitive: smaller values are points and lines.
const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// The triangles of a glTF file; `folder` contains the buffers.
pub(super) fn parse(bytes: &[u8], folder: Option<&Path>) -> Result<Vec<Triangle>, MeshError> {
    let (json, blob) = split(bytes)?;
    let document = Document::parse(json).map_err(malformed)?;
    let buffers = document.buffers.iter().map(|buffer| load(buffer, blob, folder)).collect::<Result<Vec<_>, _>>()?;
    let scene = document.scenes.get(document.scene).ok_or_else(|| malformed("it has no scene"))?;
    let roots = scene.nodes.clone();
    let mut traversal = NodeTraversal { data: &Data { document, buffers }, triangles: Vec::new(), visits: 0 };
    for root in roots {
        traversal.visit(root, &Transform::identity(), 0)?;
    }
    Ok(traversal.triangles)
}

/// The JSON and the binary chunk of a `.glb`; a `.gltf` is JSON only.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| {
        let word = bytes.get(at..at.checked_add(4)?)?;
        usize::try_from(u32::from_le_bytes(word.try_into().ok()?)).ok()
    };
    let length = word(8).unwrap_or_default();
    if length != bytes.len() {
        return Err(MeshError::CountMismatch {
            declared: format!("{length} bytes"),
            found: format!("{} bytes", bytes.len()),
        });
    }
    let chunk =
        |at: usize| Some((bytes.get(at + 4..at + 8)?, bytes.get(at + 8..at.checked_add(8)?.checked_add(word(at)?)?)?));
    let (kind, json) = chunk(12).ok_or_else(|| malformed("its first chunk is truncated"))?;
    if kind != b"JSON" {
        return Err(malformed("its first chunk is not JSON"));
    }
    let blob = chunk(20 + json.len()).filter(|(kind, _)| *kind == b"BIN\0").map(|(_, data)| data);
    Ok((json, blob))
}

/// The bytes of a buffer: the binary chunk, a base64 URI, or a file in the mesh's folder or a subfolder.
fn load(buffer: &Buffer, blob: Option<&[u8]>, folder: Option<&Path>) -> Result<Vec<u8>, MeshError> {
    let data = match &buffer.uri {
        None => blob.ok_or_else(|| malformed("its binary chunk is missing"))?.to_vec(),
        Some(uri) => match uri.strip_prefix("data:") {
            Some(data) => {
                let text = data.split_once(";base64,").map(|(_, text)| text);
                text.and_then(base64).ok_or_else(|| malformed("a buffer's data URI is not base64"))?
            }
            None => read_buffer_file(uri, folder)?,
        },
    };
    if data.len() < buffer.byte_length {
        let declared = format!("{} bytes in a buffer", buffer.byte_length);
        return Err(MeshError::CountMismatch { declared, found: format!("{} bytes", data.len()) });
    }
    Ok(data)
}

fn read_buffer_file(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, MeshError> {
    let relative = uri.replace("%20", " ");
    let relative = Path::new(&relative);
    let stays = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let Some(folder) = folder.filter(|_| stays) else {
        return Err(malformed(format!("the buffer `{uri}` is not a file in the mesh's folder")));
    };
    let path = folder.join(relative);
    let named = |error: std::io::Error| malformed(format!("the buffer `{}` cannot be read: {error}", path.display()));
    let meta = std::fs::metadata(&path).map_err(named)?;
    if meta.len() > MAX_BYTES {
        return Err(MeshError::TooLarge(meta.len()));
    }
    std::fs::read(&path).map_err(named)
}

struct NodeTraversal<'a> {
    data: &'a Data,
    triangles: Vec<Triangle>,
    visits: usize,
}

impl NodeTraversal<'_> {
    fn visit(&mut self, index: usize, parent: &Transform, depth: usize) -> Result<(), MeshError> {
        self.visits += 1;
        if depth > MAX_DEPTH || self.visits > MAX_VISITS {
            return Err(malformed(format!("its nodes nest deeper than {MAX_DEPTH}, or form a cycle")));
        }
        let document = &self.data.document;
        let node = document.nodes.get(index);
        let node = node.ok_or_else(|| malformed(format!("it refers to node {index}, which does not exist")))?;
        let transform = parent * node.transform();
        if let Some(mesh) = node.mesh {
            let known = document.meshes.get(mesh);
            let known = known.ok_or_else(|| malformed(format!("it refers to mesh {mesh}, which does not exist")))?;
            for primitive in &known.primitives {
                self.add(primitive, &transform)?;
            }
        }
        for child in &node.children {
            self.visit(*child, &transform, depth + 1)?;
        }
        Ok(())
    }

    /// Adds a primitive; points and lines have no surface.
    fn add(&mut self, primitive: &Primitive, transform: &Transform) -> Result<(), MeshError> {
        if primitive.mode < TRIANGLES {
            return Ok(());
        }
        let positions =
            primitive.attributes.get("POSITION").ok_or_else(|| malformed("a primitive has no positions"))?;
        let place = |point: Vector| transform.transform_point(&point.into()).coords;
        let vertices: Vec<Vector> = self.data.positions(*positions)?.into_iter().map(place).collect();
        let indices = match primitive.indices {
            Some(index) => self.data.indices(index)?,
            None => (0..vertices.len() as i64).collect(),
        };
        self.triangles.extend(match primitive.mode {
            TRIANGLES => triangulate(&vertices, indices.chunks_exact(3).map(<[i64]>::to_vec))?,
            TRIANGLE_STRIP => triangulate(&vertices, indices.windows(3).map(<[i64]>::to_vec))?,
            TRIANGLE_FAN => triangulate(&vertices, std::iter::once(indices))?,
            mode => return Err(malformed(format!("a primitive has the unknown mode {mode}"))),
        });
        if self.triangles.len() > MAX_TRIANGLES {
            return Err(malformed("its nodes repeat meshes to more triangles than a scene can have"));
        }
        Ok(())
    }
}
