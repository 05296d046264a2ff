//! glTF 2.0 (`.gltf` with buffers, or `.glb`): the triangles of the scene with the transforms of the nodes.

mod accessor;
mod buffers;
mod document;
mod error;

use super::builder::{Faces, MeshBuilder, corners};
use super::error::MeshError;
use super::text::without_mark;
use crate::triangle::MAX_VERTICES;
use accessor::Data;
use document::{Document, Primitive};
use error::malformed;
use std::path::Path;
use zsim_base::geometry::Vector;

type Transform = nalgebra::Matrix4<f64>;

/// Maximum nesting depth, and maximum number of visits of nodes and primitives: several nodes may refer to the same child.
const MAX_DEPTH: usize = 64;
const MAX_VISITS: usize = 1_000_000;

/// `mode` of a primitive: smaller values are points and lines.
const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// The triangles of a glTF file; `folder` contains the buffers.
pub(super) fn parse(bytes: &[u8], folder: Option<&Path>) -> Result<Faces, MeshError> {
    let (json, blob) = split(bytes)?;
    let document = Document::parse(json).map_err(malformed)?;
    let buffers = buffers::load(&document.buffers.0, blob, folder)?;
    let scene = document.scenes.0.get(document.scene).ok_or_else(|| malformed("it has no scene"))?;
    let roots = scene.nodes.clone();
    let data = &Data { document, buffers };
    let mut traversal = NodeTraversal { data, mesh: MeshBuilder::default(), vertices: 0, visits: 0 };
    for root in roots {
        traversal.visit(root, &Transform::identity(), 0)?;
    }
    Ok(traversal.mesh.finish())
}

/// The JSON and the binary chunk of a `.glb`; a `.gltf` is JSON only.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((without_mark(bytes), None));
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

struct NodeTraversal<'a> {
    data: &'a Data<'a>,
    mesh: MeshBuilder,
    /// Number of vertices of the primitives so far; a primitive counts as often as nodes repeat it.
    vertices: usize,
    visits: usize,
}

impl NodeTraversal<'_> {
    fn visit(&mut self, index: usize, parent: &Transform, depth: usize) -> Result<(), MeshError> {
        self.count_visit()?;
        if depth > MAX_DEPTH {
            return Err(malformed(format!("its nodes nest deeper than {MAX_DEPTH}, or form a cycle")));
        }
        let document = &self.data.document;
        let node = document.nodes.0.get(index);
        let node = node.ok_or_else(|| malformed(format!("it refers to node {index}, which does not exist")))?;
        let transform = parent * node.transform();
        if let Some(mesh) = node.mesh {
            let known = document.meshes.0.get(mesh);
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

    fn count_visit(&mut self) -> Result<(), MeshError> {
        self.visits += 1;
        match self.visits > MAX_VISITS {
            true => {
                Err(malformed(format!("its nodes repeat each other more than {MAX_VISITS} times, or form a cycle")))
            }
            false => Ok(()),
        }
    }

    /// Adds a primitive; points and lines have no surface. Counts are checked before anything is built.
    fn add(&mut self, primitive: &Primitive, transform: &Transform) -> Result<(), MeshError> {
        self.count_visit()?;
        match primitive.mode {
            TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN => {}
            mode if mode < TRIANGLES => return Ok(()),
            mode => return Err(malformed(format!("a primitive has the unknown mode {mode}"))),
        }
        let data = self.data;
        let positions = primitive.attributes.position.ok_or_else(|| malformed("a primitive has no positions"))?;
        let positions = data.positions(positions)?;
        self.vertices += positions.len();
        if self.vertices > MAX_VERTICES {
            return Err(MeshError::TooManyVertices);
        }
        let name = primitive.material.and_then(|index| data.document.materials.0.get(index)?.name.as_deref());
        self.mesh.set_material(name)?;
        match primitive.indices {
            Some(index) => {
                let indices = data.indices(index)?;
                self.add_triangles(primitive.mode, positions, indices, transform)
            }
            None => {
                let indices = 0..positions.len() as u32;
                self.add_triangles(primitive.mode, positions, indices.map(i64::from), transform)
            }
        }
    }

    fn add_triangles(
        &mut self,
        mode: u32,
        positions: impl Iterator<Item = Vector>,
        mut indices: impl ExactSizeIterator<Item = i64>,
        transform: &Transform,
    ) -> Result<(), MeshError> {
        let count = if mode == TRIANGLES { indices.len() / 3 } else { indices.len().saturating_sub(2) };
        self.mesh.reserve(count)?;
        let vertices: Vec<Vector> = positions.map(|point| transform.transform_point(&point.into()).coords).collect();
        let mut next = || indices.next().unwrap_or(-1);
        let mut triangle = [0; 3];
        for k in 0..count {
            triangle = match mode {
                TRIANGLES => [next(), next(), next()],
                _ if k == 0 => [next(), next(), next()],
                TRIANGLE_STRIP => [triangle[1], triangle[2], next()],
                _ => [triangle[0], triangle[2], next()],
            };
            let [a, b, c] = triangle;
            // Strips are joined by triangles that repeat a vertex.
            if mode == TRIANGLES || (a != b && b != c && a != c) {
                let corners = corners(&vertices, &triangle, self.mesh.next_face())?;
                self.mesh.triangle([corners[0], corners[1], corners[2]])?;
            }
        }
        Ok(())
    }
}
