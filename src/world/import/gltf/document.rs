//! The geometry part of a glTF document (glTF 2.0 specification, section 5). Indices are validated where they are used.

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;
use zsim_base::geometry::Vector;

type Transform = nalgebra::Matrix4<f64>;

/// Maximum length of a document, bytes: its lists need up to 8 times as much memory.
pub(super) const MAX_JSON_BYTES: usize = 256 << 20;
/// Maximum number of nodes, meshes, accessors or other objects of one kind.
const MAX_OBJECTS: usize = 1_000_000;
/// Prefixes of extensions that do not change the geometry. Compressed or encoded geometry uses others.
const IGNORED_EXTENSIONS: [&str; 4] = ["KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_"];

#[derive(Debug, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    #[serde(default)]
    pub scene: usize,
    #[serde(default)]
    pub scenes: Objects<Scene>,
    #[serde(default)]
    pub nodes: Objects<Node>,
    #[serde(default)]
    pub meshes: Objects<Mesh>,
    #[serde(default)]
    pub materials: Objects<Material>,
    #[serde(default)]
    pub accessors: Objects<Accessor>,
    #[serde(default)]
    pub buffer_views: Objects<BufferView>,
    #[serde(default)]
    pub buffers: Objects<Buffer>,
    #[serde(default)]
    extensions_required: Objects<String>,
}

/// Objects of one kind, at most [`MAX_OBJECTS`]: one is up to 100 times as large in memory as in the file.
#[derive(Debug)]
pub(super) struct Objects<T>(pub Vec<T>);

impl<T> Default for Objects<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Objects<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ObjectsVisitor(PhantomData)).map(Self)
    }
}

struct ObjectsVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectsVisitor<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at most {MAX_OBJECTS} objects")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
        let mut objects = Vec::new();
        while let Some(object) = list.next_element()? {
            if objects.len() == MAX_OBJECTS {
                return Err(A::Error::custom(format!("more than {MAX_OBJECTS} objects of one kind")));
            }
            objects.push(object);
        }
        Ok(objects)
    }
}

#[derive(Debug, serde::Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Debug, serde::Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Debug, serde::Deserialize)]
pub(super) struct Mesh {
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, serde::Deserialize)]
pub(super) struct Material {
    pub name: Option<String>,
}

#[derive(Debug, serde::Deserialize)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    /// Default: 4, triangles.
    #[serde(default = "triangles")]
    pub mode: u32,
}

#[derive(Debug, serde::Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
}

#[derive(Debug, serde::Deserialize)]
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

#[derive(Debug, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Debug, serde::Deserialize)]
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
        if json.len() > MAX_JSON_BYTES {
            return Err(format!("its document has {} bytes; the maximum is {MAX_JSON_BYTES}", json.len()));
        }
        let document: Self = serde_json::from_slice(json).map_err(|error| error.to_string())?;
        let is_ignored = |name: &&String| IGNORED_EXTENSIONS.iter().any(|kind| name.starts_with(kind));
        match document.extensions_required.0.iter().find(|name| !is_ignored(name)) {
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
