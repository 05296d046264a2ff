//! The geometry part of a glTF document (glTF 2.0 specification, section 5). Indices are validated where they are used.

use serde::Deserialize;
use std::collections::BTreeMap;
use zsim_base::geometry::Vector;

type Transform = nalgebra::Matrix4<f64>;

/// Prefixes of extensions that do not change the geometry. Compressed or encoded geometry uses others.
const IGNORED_EXTENSIONS: [&str; 4] = ["KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_"];

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    #[serde(default)]
    pub scene: usize,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    /// Default: 4, triangles.
    #[serde(default = "triangles")]
    pub mode: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

fn triangles() -> u32 {
    4
}

impl Document {
    /// Reads a document's JSON.
    pub fn parse(json: &[u8]) -> Result<Self, String> {
        let document: Self = serde_json::from_slice(json).map_err(|error| error.to_string())?;
        let is_ignored = |name: &&String| IGNORED_EXTENSIONS.iter().any(|kind| name.starts_with(kind));
        match document.extensions_required.iter().find(|name| !is_ignored(name)) {
            Some(name) => Err(format!("it requires the extension {name}, which is not supported: export without it")),
            None => Ok(document),
        }
    }
}

impl Node {
    /// Transform from the frame of the node to the frame of the parent.
    pub fn transform(&self) -> Transform {
        if let Some(columns) = &self.matrix {
            return Transform::from_column_slice(columns);
        }
        let translation = Vector::from(self.translation.unwrap_or_default());
        let [x, y, z, w] = self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = zsim_base::geometry::Rotation::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let scale = Vector::from(self.scale.unwrap_or([1.0; 3]));
        Transform::new_translation(&translation) * rotation.to_homogeneous() * Transform::new_nonuniform_scaling(&scale)
    }
}
