//! glTF 2.0, as `.gltf` with its buffers and as `.glb`: the triangles of the scene, each by the transforms of its nodes.
//!
//! In glTF y points up; here z does, so that a model stands as it was made to.

mod accessor;

use super::{MAX_BYTES, MeshError, Triangle, fans};
use crate::geometry::Vector;
use accessor::{base64, indices, positions};
use gltf::mesh::Mode;
use std::path::{Component, Path};

type Transform = nalgebra::Matrix4<f64>;

/// Deepest nesting of nodes, and most visits of nodes: a node may be named by several others.
const MAX_DEPTH: usize = 64;
const MAX_VISITS: usize = 1_000_000;

/// The triangles of a glTF file; `folder` is where its buffers lie.
pub(super) fn parse(bytes: &[u8], folder: Option<&Path>) -> Result<Vec<Triangle>, MeshError> {
    let (json, blob) = split(bytes)?;
    let document = gltf::Gltf::from_slice(json).map_err(|error| malformed(error.to_string()))?;
    let buffers = document.buffers().map(|buffer| load(&buffer, blob, folder)).collect::<Result<Vec<_>, _>>()?;
    let mut walk = Walk { buffers, triangles: Vec::new(), visits: 0 };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    for node in scene.ok_or_else(|| malformed("it has no scene"))?.nodes() {
        walk.visit(&node, &Transform::identity(), 0)?;
    }
    let upright = |corner: Vector| Vector::new(corner.x, -corner.z, corner.y);
    Ok(walk.triangles.into_iter().map(|triangle| triangle.map(upright)).collect())
}

fn malformed(problem: impl Into<String>) -> MeshError {
    MeshError::Malformed { format: "glTF", problem: problem.into() }
}

/// The JSON and the binary chunk of a `.glb`; all is JSON in a `.gltf`.
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
        return Err(MeshError::Lies { said: format!("{length} bytes"), found: format!("{} bytes", bytes.len()) });
    }
    let chunk =
        |at: usize| Some((bytes.get(at + 4..at + 8)?, bytes.get(at + 8..at.checked_add(8)?.checked_add(word(at)?)?)?));
    let (kind, json) = chunk(12).ok_or_else(|| malformed("its first chunk is cut short"))?;
    if kind != b"JSON" {
        return Err(malformed("its first chunk is not JSON"));
    }
    let blob = chunk(20 + json.len()).filter(|(kind, _)| *kind == b"BIN\0").map(|(_, data)| data);
    Ok((json, blob))
}

/// The bytes of a buffer: the binary chunk, a base64 URI, or a file in the mesh's folder or below.
fn load(buffer: &gltf::Buffer<'_>, blob: Option<&[u8]>, folder: Option<&Path>) -> Result<Vec<u8>, MeshError> {
    let data = match buffer.source() {
        gltf::buffer::Source::Bin => blob.ok_or_else(|| malformed("its binary chunk is missing"))?.to_vec(),
        gltf::buffer::Source::Uri(uri) => match uri.strip_prefix("data:") {
            Some(data) => {
                let text = data.split_once(";base64,").map(|(_, text)| text);
                text.and_then(base64).ok_or_else(|| malformed("a buffer's data URI is not base64"))?
            }
            None => read_beside(uri, folder)?,
        },
    };
    if data.len() < buffer.length() {
        let said = format!("{} bytes in buffer {}", buffer.length(), buffer.index());
        return Err(MeshError::Lies { said, found: format!("{} bytes", data.len()) });
    }
    Ok(data)
}

fn read_beside(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, MeshError> {
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

struct Walk {
    buffers: Vec<Vec<u8>>,
    triangles: Vec<Triangle>,
    visits: usize,
}

impl Walk {
    fn visit(&mut self, node: &gltf::Node<'_>, parent: &Transform, depth: usize) -> Result<(), MeshError> {
        self.visits += 1;
        if depth > MAX_DEPTH || self.visits > MAX_VISITS {
            return Err(malformed(format!("its nodes nest deeper than {MAX_DEPTH}, or go round")));
        }
        let own = Transform::from(node.transform().matrix().map(|column| column.map(f64::from)));
        let transform = parent * own;
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            self.add(&primitive, &transform)?;
        }
        for child in node.children() {
            self.visit(&child, &transform, depth + 1)?;
        }
        Ok(())
    }

    /// Adds a primitive; points and lines have no surface.
    fn add(&mut self, primitive: &gltf::Primitive<'_>, transform: &Transform) -> Result<(), MeshError> {
        if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            return Ok(());
        }
        let accessor = primitive.get(&gltf::Semantic::Positions);
        let vertices: Vec<Vector> =
            positions(&accessor.ok_or_else(|| malformed("a primitive has no positions"))?, &self.buffers)?
                .into_iter()
                .map(|point| transform.transform_point(&point.into()).coords)
                .collect();
        let indices = match primitive.indices() {
            Some(accessor) => indices(&accessor, &self.buffers)?,
            None => (0..vertices.len() as i64).collect(),
        };
        self.triangles.extend(match primitive.mode() {
            Mode::TriangleStrip => fans(&vertices, indices.windows(3).map(<[i64]>::to_vec))?,
            Mode::TriangleFan => fans(&vertices, std::iter::once(indices))?,
            _ => fans(&vertices, indices.chunks_exact(3).map(<[i64]>::to_vec))?,
        });
        if self.triangles.len() > super::super::build::MAX_TRIANGLES {
            return Err(malformed("its nodes repeat meshes to more triangles than a scene may have"));
        }
        Ok(())
    }
}
