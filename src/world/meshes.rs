//! Meshes of a scene: read once per file, with notes about what is probably a mistake.

use super::import::{self, MeshTriangles};
use super::{LengthUnit, MaterialId, UpAxis, WorldError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::rc::Rc;
use zsim_base::geometry::{Pose, Vector};
use zsim_base::spec::{Source, SpecError};

/// A mesh without a unit that is longer is probably in mm or cm, m.
const LARGE_MESH_M: f64 = 500.0;
/// A mesh that is shorter is probably in another unit, m.
const SMALL_MESH_M: f64 = 0.02;
/// Beyond this distance from the origin the single precision of the ray search is coarser than 1 mm, m.
const FAR_M: f64 = 10_000.0;
/// Maximum number of names in a note.
const MAX_NAMES: usize = 5;

/// A mesh as a scene names it.
#[derive(Debug)]
pub(super) struct MeshFile<'a> {
    pub file: &'a str,
    pub scale: f64,
    pub unit: Option<LengthUnit>,
    pub up: Option<UpAxis>,
}

/// The meshes that a scene has read.
#[derive(Default)]
pub(super) struct Meshes {
    known: BTreeMap<String, Rc<MeshTriangles>>,
    /// The files.
    pub files: BTreeSet<PathBuf>,
    /// One sentence each.
    pub notes: Vec<String>,
}

impl Meshes {
    /// The triangles of a mesh, m.
    pub fn read(&mut self, mesh: &MeshFile<'_>, source: &Source) -> Result<Rc<MeshTriangles>, WorldError> {
        let key = format!("{mesh:?}");
        if let Some(known) = self.known.get(&key) {
            return Ok(Rc::clone(known));
        }
        let MeshFile { file, scale, unit, up } = *mesh;
        let wrong = |sentence: String| WorldError::Mesh(SpecError::about(source, file, sentence));
        let Some(folder) = &source.folder else {
            let sentence = format!("the mesh `{file}` needs a folder: a scene without a folder cannot use mesh files");
            return Err(wrong(sentence));
        };
        let path = folder.join(file);
        let scale = scale * unit.map_or(1.0, LengthUnit::metres);
        let read = import::read(&path, scale, up).map_err(|error| wrong(format!("the mesh `{file}` {error}")))?;
        self.note_size(mesh, &read);
        self.files.insert(path);
        let read = Rc::new(read);
        self.known.insert(key, Rc::clone(&read));
        Ok(read)
    }

    fn note_size(&mut self, mesh: &MeshFile<'_>, read: &MeshTriangles) {
        let file = mesh.file;
        if read.without_area > 0 {
            let (count, all) = (read.without_area, read.without_area + read.triangles.len());
            self.notes.push(format!("{file}: removed {count} of {all} triangles, which have no area"));
        }
        let (lower, upper) = read.bounds();
        let size_m = (upper - lower).max();
        if mesh.unit.is_none() && mesh.scale == 1.0 && size_m > LARGE_MESH_M {
            self.notes.push(format!(
                "{file} is {size_m:.0} m long: if it is drawn in mm ({} m) or cm ({} m), add `unit: mm` or `unit: cm`",
                size_m / 1000.0,
                size_m / 100.0
            ));
        }
        if size_m < SMALL_MESH_M {
            self.notes.push(format!(
                "{file} is only {:.3} mm long: its `unit` or `scale` is probably wrong",
                size_m * 1000.0
            ));
        }
    }

    /// Notes the materials of a mesh that the scene does not have.
    pub fn note_unknown_materials(&mut self, file: &str, mesh: &MeshTriangles, ids: &[Option<MaterialId>], item: &str) {
        let unknown = mesh.material_names.iter().zip(ids).filter(|(_, id)| id.is_none());
        let names: Vec<String> = unknown.map(|(name, _)| format!("`{name}`")).collect();
        if names.is_empty() {
            return;
        }
        let more = match names.len().saturating_sub(MAX_NAMES) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let listed = names[..names.len().min(MAX_NAMES)].join(", ");
        self.note(format!("{file}: the scene has no material {listed}{more}; these faces are `{item}`"));
    }

    /// Notes a mesh that is placed far from the origin.
    pub fn note_far(&mut self, mesh: &MeshTriangles, file: Option<&str>, at: &Pose) {
        let Some(file) = file else { return };
        let middle = middle(mesh, at);
        if middle.amax() > FAR_M {
            let help = offset(mesh, at);
            self.note(format!(
                "{file} is {:.1} km from the origin, where ranges have errors of mm: {help}",
                middle.norm() / 1000.0
            ));
        }
    }

    fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}

/// Centre of the bounding box of a mesh that is placed at `at`.
fn middle(mesh: &MeshTriangles, at: &Pose) -> Vector {
    let (lower, upper) = mesh.bounds();
    at.transform_point(&((lower + upper) / 2.0).into()).coords
}

/// The remedy for a mesh that is far from the origin: where to place it.
pub(super) fn offset(mesh: &MeshTriangles, at: &Pose) -> String {
    let (lower, upper) = mesh.bounds();
    let size = upper - lower;
    let [x, y, z] = (at.translation.vector - middle(mesh, at)).map(f64::round).into();
    format!(
        "the mesh is {:.1} x {:.1} x {:.1} m; to bring its middle to the origin, place it with an offset: at_m_deg: [({x}, {y}, {z})]",
        size.x, size.y, size.z
    )
}
