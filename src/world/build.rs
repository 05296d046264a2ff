//! Builds triangles from the spec of a scene: places templates, scatters objects, reads meshes, and checks everything.

use super::canopy::Canopy;
use super::caster::Caster;
use super::error::unknown_name;
use super::import::MeshTriangles;
use super::material::one_word;
use super::meadow::Meadow;
use super::meshes::{self, MeshFile, Meshes};
use super::mover::{Mover, Path};
use super::routes::routes;
use super::scatter;
use super::sway::check_sway;
use super::triangle::{MAX_TRIANGLES, Surfaces};
use super::{
    CanopySpec, ItemSpec, Material, MaterialId, MaterialKind, MoverSpec, Placement, ScatterSpec, SceneSpec, ShapeSpec,
    SwaySpec, WorldError,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::rc::Rc;
use zsim_base::geometry::{Pose, Route};
use zsim_base::spec::checked::MAX_LENGTH_M;
use zsim_base::spec::{Source, SpecError};

/// Maximum time of a waypoint, s: differences of times stay exact to below a microsecond.
const MAX_TIME_S: f64 = 1e9;
/// Maximum nesting depth of templates: a guard against a template that contains itself.
const MAX_DEPTH: usize = 8;

/// The parts from which a world is assembled.
pub(super) struct WorldParts {
    pub materials: Vec<Material>,
    pub static_surfaces: Surfaces,
    pub movers: Vec<Mover>,
    pub meadows: Vec<Meadow>,
    pub canopies: Vec<Canopy>,
    pub routes: BTreeMap<String, Route>,
    pub notes: Vec<String>,
    pub mesh_files: BTreeSet<PathBuf>,
}

/// Builds all parts of a world.
pub(super) fn build(spec: &SceneSpec, source: &Source) -> Result<WorldParts, WorldError> {
    let material_ids = material_ids(spec, source)?;
    let mut builder = Builder {
        spec,
        source,
        materials_by_word: material_ids.iter().map(|(name, id)| (one_word(name), *id)).collect(),
        material_ids,
        routes: routes(spec, source)?,
        meshes: Meshes::default(),
        scatter_budget: scatter::Budget::default(),
        triangle_count: 0,
        solid_count: 0,
    };
    let mut static_surfaces = Surfaces::default();
    builder.add_items(&spec.items, &Pose::identity(), 0, &mut static_surfaces)?;
    if static_surfaces.triangles.is_empty() {
        return Err(SpecError::about(source, "items", "the scene has no surfaces: `items` is empty").into());
    }
    let movers = spec.movers.iter().map(|mover| builder.mover(mover)).collect::<Result<_, _>>()?;
    let meadows = spec.swaying.iter().map(|sway| builder.meadow(sway)).collect::<Result<_, _>>()?;
    let canopies: Vec<Vec<Canopy>> =
        spec.canopies.iter().map(|canopy| builder.canopies(canopy)).collect::<Result<_, _>>()?;
    let canopies = canopies.into_iter().flatten().collect();
    let Builder { routes, meshes: Meshes { notes, files: mesh_files, .. }, .. } = builder;
    let materials = materials(spec);
    Ok(WorldParts { materials, static_surfaces, movers, meadows, canopies, routes, notes, mesh_files })
}

/// The materials in order of their names, which is the order of their ids.
fn materials(spec: &SceneSpec) -> Vec<Material> {
    let material = |(name, spec): (&String, &super::MaterialSpec)| Material {
        name: name.clone(),
        reflectance: spec.reflectance,
        transmission: match spec.kind {
            MaterialKind::Opaque => 0.0,
            MaterialKind::Glass { transmission } => transmission,
        },
    };
    spec.materials.iter().map(material).collect()
}

fn material_ids<'a>(spec: &'a SceneSpec, source: &Source) -> Result<BTreeMap<&'a str, MaterialId>, SpecError> {
    if spec.materials.len() > usize::from(u16::MAX) {
        let message = format!("the scene has {} materials; the maximum is {}", spec.materials.len(), u16::MAX);
        return Err(SpecError::about(source, "materials", message));
    }
    for (name, material) in &spec.materials {
        if let MaterialKind::Glass { transmission } = material.kind
            && transmission + material.reflectance > 1.0
        {
            let message = format!("`{name}` reflects {} and transmits {transmission}: more than all of the light", {
                material.reflectance
            });
            return Err(SpecError::about(source, name, message));
        }
    }
    Ok(spec.materials.keys().zip(0..).map(|(name, id)| (name.as_str(), MaterialId(id))).collect())
}

struct Builder<'a> {
    spec: &'a SceneSpec,
    source: &'a Source,
    material_ids: BTreeMap<&'a str, MaterialId>,
    materials_by_word: BTreeMap<String, MaterialId>,
    routes: BTreeMap<String, Route>,
    meshes: Meshes,
    scatter_budget: scatter::Budget,
    triangle_count: usize,
    solid_count: u32,
}

impl Builder<'_> {
    fn add_items(
        &mut self,
        items: &[ItemSpec],
        at: &Pose,
        depth: usize,
        into: &mut Surfaces,
    ) -> Result<(), WorldError> {
        for item in items {
            match item {
                ItemSpec::Solid { shape, material, at_m_deg } => {
                    let solid = self.solid(shape, material)?;
                    for pose in self.poses(at_m_deg, material)? {
                        let at = at * pose;
                        self.add(&solid, &at, into)?;
                        self.meshes.note_far(&solid.mesh, solid.file, &at);
                    }
                }
                ItemSpec::Place { template, at_m_deg } => {
                    for pose in self.poses(at_m_deg, template)? {
                        self.add_template(template, &(at * pose), depth, into)?;
                    }
                }
                ItemSpec::Scatter(scatter) => {
                    for pose in self.scattered(scatter, at)? {
                        self.add_template(&scatter.template, &(at * pose), depth, into)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn add_template(&mut self, name: &str, at: &Pose, depth: usize, into: &mut Surfaces) -> Result<(), WorldError> {
        let Some(items) = self.spec.templates.get(name) else {
            return Err(unknown_name(self.source, "template", name, self.spec.templates.keys()).into());
        };
        if items.is_empty() {
            return Err(SpecError::about(self.source, name, format!("the template `{name}` is empty")).into());
        }
        if depth == MAX_DEPTH {
            let message = format!("the templates nest deeper than {MAX_DEPTH} at `{name}`");
            let help = "a template must not place itself, directly or through another";
            return Err(SpecError::about(self.source, name, message).with_help(help).into());
        }
        self.add_items(items, at, depth + 1, into)
    }

    /// Poses of scattered copies in the frame of the scatter, whose pose is `at`.
    fn scattered(&mut self, scatter: &ScatterSpec, at: &Pose) -> Result<Vec<Pose>, SpecError> {
        let routes: Vec<&Route> = self.routes.values().collect();
        let poses = scatter::poses(scatter, at, &routes, &mut self.scatter_budget);
        poses.map_err(|(key, sentence)| SpecError::about(self.source, key, sentence))
    }

    fn meadow(&mut self, spec: &SwaySpec) -> Result<Meadow, WorldError> {
        check_sway(spec).map_err(|(key, message)| SpecError::about(self.source, key, message))?;
        let poses = self.scattered(&spec.scatter, &Pose::identity())?;
        Ok(Meadow::new(spec, self.template_surfaces(&spec.scatter.template)?, poses))
    }

    fn canopies(&self, spec: &CanopySpec) -> Result<Vec<Canopy>, SpecError> {
        let id = self.material_id(&spec.material)?;
        let poses = self.poses(&spec.at_m_deg, &spec.material)?;
        if !poses.iter().all(is_within) {
            let message =
                format!("a canopy of `{}` is not within {} km of the origin", spec.material, MAX_LENGTH_M / 1000.0);
            return Err(SpecError::about(self.source, "canopies", message));
        }
        Ok(poses.iter().map(|pose| Canopy::new(pose, spec.size_m, spec.extinction_per_m, id)).collect())
    }

    /// The surfaces of a template in its own frame.
    fn template_surfaces(&mut self, name: &str) -> Result<Caster, WorldError> {
        let mut surfaces = Surfaces::default();
        self.add_template(name, &Pose::identity(), 0, &mut surfaces)?;
        Ok(Caster::new(&surfaces))
    }

    fn mover(&mut self, mover: &MoverSpec) -> Result<Mover, WorldError> {
        let wrong = |sentence: &str| {
            let message = format!("the mover `{}` {sentence}", mover.template);
            WorldError::Scene(SpecError::about(self.source, "movers", message))
        };
        if mover.waypoints.is_empty() {
            return Err(wrong("has no waypoints; it needs at least one"));
        }
        if mover.waypoints.iter().any(|at| at.time_s.abs() > MAX_TIME_S) {
            return Err(wrong("has a waypoint at more than 1e9 s"));
        }
        if mover.waypoints.windows(2).any(|pair| pair[0].time_s >= pair[1].time_s) {
            return Err(wrong("has waypoints whose times do not increase"));
        }
        let waypoints: Vec<(f64, Pose)> =
            mover.waypoints.iter().map(|at| (at.time_s, at.at_m_deg.world_from_body())).collect();
        if !waypoints.iter().all(|(_, pose)| is_within(pose)) {
            return Err(wrong("has a waypoint that is not within 100 km of the origin"));
        }
        let turns_half = |pair: &[(f64, Pose)]| pair[0].1.rotation.angle_to(&pair[1].1.rotation) > 3.1;
        if waypoints.windows(2).any(turns_half) {
            return Err(wrong("turns by 180 degrees between two waypoints: add a waypoint to fix the direction"));
        }
        let surfaces = self.template_surfaces(&mover.template)?;
        Ok(Mover::new(surfaces, Path::new(&waypoints, mover.repeats)))
    }

    fn material_id(&self, name: &str) -> Result<MaterialId, SpecError> {
        let id = self.material_ids.get(name).copied();
        id.ok_or_else(|| unknown_name(self.source, "material", name, self.spec.materials.keys()))
    }

    fn poses(&self, places: &[Placement], name: &str) -> Result<Vec<Pose>, SpecError> {
        if places.is_empty() {
            let message = format!("`at_m_deg` of an item of `{name}` is an empty list");
            return Err(SpecError::about(self.source, name, message)
                .with_help("remove the key to place the item at the origin"));
        }
        Ok(places.iter().map(Placement::world_from_body).collect())
    }

    fn solid<'s>(&mut self, shape: &'s ShapeSpec, material: &str) -> Result<Solid<'s>, WorldError> {
        let fallback = self.material_id(material)?;
        let ShapeSpec::Mesh { file, scale, unit, up } = shape else {
            let wrong = |(key, sentence): (&str, String)| SpecError::about(self.source, key, sentence);
            let mesh = Rc::new(MeshTriangles::plain(shape.triangles().map_err(wrong)?));
            return Ok(Solid { mesh, ids: vec![fallback], file: None });
        };
        let mesh = self.meshes.read(&MeshFile { file, scale: *scale, unit: *unit, up: *up }, self.source)?;
        // An OBJ file has a name with blanks as one word.
        let id =
            |name: &String| self.material_ids.get(name.as_str()).or_else(|| self.materials_by_word.get(name)).copied();
        let ids: Vec<Option<MaterialId>> = mesh.material_names.iter().map(id).collect();
        self.meshes.note_unknown_materials(file, &mesh, &ids, material);
        let ids = std::iter::once(fallback).chain(ids.into_iter().map(|id| id.unwrap_or(fallback))).collect();
        Ok(Solid { mesh, ids, file: Some(file) })
    }

    fn add(&mut self, solid: &Solid, at: &Pose, into: &mut Surfaces) -> Result<(), SpecError> {
        let Solid { mesh, ids, .. } = solid;
        self.triangle_count += mesh.triangles.len();
        if self.triangle_count > MAX_TRIANGLES {
            let message = format!("the scene has more than {MAX_TRIANGLES} triangles");
            return Err(SpecError::plain(&self.source.name, message));
        }
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let corners = triangle.map(|corner| at.rotation * corner + at.translation.vector);
            if !corners.iter().flatten().all(|x| x.abs() <= MAX_LENGTH_M) {
                return Err(self.too_far(solid, at));
            }
            into.triangles.push(corners);
            into.materials.push(ids[mesh.materials.get(index).map_or(0, |number| usize::from(*number))]);
            into.solids.push(self.solid_count);
        }
        self.solid_count += 1;
        Ok(())
    }

    fn too_far(&self, solid: &Solid, at: &Pose) -> SpecError {
        let message = format!("an item extends to more than {} km from the origin", MAX_LENGTH_M / 1000.0);
        match solid.file {
            Some(file) => SpecError::about(self.source, file, message).with_help(meshes::offset(&solid.mesh, at)),
            None => SpecError::plain(&self.source.name, message).with_help("lengths are metres"),
        }
    }
}

fn is_within(pose: &Pose) -> bool {
    pose.translation.vector.iter().all(|x| x.abs() <= MAX_LENGTH_M)
}

/// A shape to be placed.
struct Solid<'a> {
    mesh: Rc<MeshTriangles>,
    /// Materials: that of the item, then those of the mesh's names.
    ids: Vec<MaterialId>,
    /// File of a mesh.
    file: Option<&'a str>,
}
