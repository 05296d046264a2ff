//! Builds triangles from the spec of a scene: places templates, scatters objects, reads meshes, and checks everything.

use super::canopy::Canopy;
use super::caster::Caster;
use super::import::{self, MeshTriangles};
use super::meadow::Meadow;
use super::mover::{Mover, Path};
use super::scatter;
use super::triangle::{MAX_TRIANGLES, Surfaces};
use super::{
    CanopySpec, ItemSpec, LengthUnit, Material, MaterialId, MaterialKind, MoverSpec, Placement, ScatterSpec, SceneSpec,
    ShapeSpec, SwaySpec, WorldError,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::rc::Rc;
use zsim_base::geometry::{Pose, Route, Vector};
use zsim_base::spec::{Source, SpecError};

/// A mesh without a unit that is longer is probably in mm, m.
const LARGE_MESH_M: f64 = 500.0;
/// Maximum coordinate of a surface or a route, m: beyond, single precision in the ray search is too coarse.
const MAX_EXTENT_M: f64 = 100_000.0;
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
    let mut builder = Builder {
        spec,
        source,
        material_ids: material_ids(spec, source)?,
        routes: routes(spec, source)?,
        meshes: BTreeMap::new(),
        triangle_count: 0,
        solid_count: 0,
        notes: Vec::new(),
        mesh_files: BTreeSet::new(),
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
    let Builder { routes, notes, mesh_files, .. } = builder;
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

fn routes(spec: &SceneSpec, source: &Source) -> Result<BTreeMap<String, Route>, SpecError> {
    for (name, route) in &spec.routes {
        let count = route.points_m.len();
        if count < 2 {
            let message = format!("the route `{name}` has {count} points; it needs at least 2");
            return Err(SpecError::about(source, name, message));
        }
        if !route.points_m.iter().flatten().all(|x| x.abs() <= MAX_EXTENT_M) {
            let message = format!("the route `{name}` has a point that is not within 100 km of the origin");
            return Err(SpecError::about(source, name, message));
        }
        if route.points_m.windows(2).any(|pair| pair[0] == pair[1]) {
            let message = format!("the route `{name}` has the same point twice in a row");
            return Err(SpecError::about(source, name, message).with_help("to make a walker rest, use the motion"));
        }
    }
    if let Some(name) = &spec.default_route
        && !spec.routes.contains_key(name)
    {
        return Err(unknown_name(source, "route", name, spec.routes.keys()));
    }
    let route = |(name, route): (&String, &super::RouteSpec)| {
        let points_in_world = route.points_m.iter().map(|point| Vector::from(*point)).collect();
        (name.clone(), Route { points_in_world, closed: route.closed })
    };
    Ok(spec.routes.iter().map(route).collect())
}

/// An error about a name that the scene does not define; lists the names that it defines.
fn unknown_name<'a>(source: &Source, what: &str, name: &str, known: impl Iterator<Item = &'a String>) -> SpecError {
    let known: Vec<&str> = known.map(String::as_str).collect();
    SpecError::about(source, name, format!("the scene has no {what} `{name}`"))
        .with_help(format!("it has: {}", if known.is_empty() { "none".to_owned() } else { known.join(", ") }))
}

struct Builder<'a> {
    spec: &'a SceneSpec,
    source: &'a Source,
    material_ids: BTreeMap<&'a str, MaterialId>,
    routes: BTreeMap<String, Route>,
    meshes: BTreeMap<String, Rc<MeshTriangles>>,
    triangle_count: usize,
    solid_count: u32,
    notes: Vec<String>,
    mesh_files: BTreeSet<PathBuf>,
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
                    let id = self.material_id(material)?;
                    let local = self.shape(shape)?;
                    for pose in self.poses(at_m_deg, material)? {
                        self.add(&local, id, &(at * pose), into)?;
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
    fn scattered(&self, scatter: &ScatterSpec, at: &Pose) -> Result<Vec<Pose>, SpecError> {
        let routes: Vec<&Route> = self.routes.values().collect();
        scatter::poses(scatter, at, &routes).map_err(|(key, sentence)| SpecError::about(self.source, key, sentence))
    }

    fn meadow(&mut self, spec: &SwaySpec) -> Result<Meadow, WorldError> {
        let poses = self.scattered(&spec.scatter, &Pose::identity())?;
        Ok(Meadow::new(spec, self.template_surfaces(&spec.scatter.template)?, poses))
    }

    fn canopies(&self, spec: &CanopySpec) -> Result<Vec<Canopy>, SpecError> {
        let id = self.material_id(&spec.material)?;
        let poses = self.poses(&spec.at_m_deg, &spec.material)?;
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
        if mover.waypoints.windows(2).any(|pair| pair[0].time_s >= pair[1].time_s) {
            return Err(wrong("has waypoints whose times do not increase"));
        }
        let waypoints: Vec<(f64, Pose)> =
            mover.waypoints.iter().map(|at| (at.time_s, at.at_m_deg.world_from_body())).collect();
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

    fn shape(&mut self, shape: &ShapeSpec) -> Result<Rc<MeshTriangles>, WorldError> {
        let ShapeSpec::Mesh { file, scale, unit, up } = shape else {
            let wrong = |(key, sentence): (&str, String)| SpecError::about(self.source, key, sentence);
            return Ok(Rc::new(MeshTriangles { triangles: shape.triangles().map_err(wrong)?, without_area: 0 }));
        };
        let scale = scale * unit.map_or(1.0, LengthUnit::metres);
        let key = format!("{file} * {scale}, up {up:?}");
        if let Some(known) = self.meshes.get(&key) {
            return Ok(Rc::clone(known));
        }
        let wrong = |sentence: String| WorldError::Mesh(SpecError::about(self.source, file, sentence));
        let Some(folder) = &self.source.folder else {
            return Err(wrong(format!(
                "the mesh `{file}` needs a folder: a scene without a folder cannot use mesh files"
            )));
        };
        let path = folder.join(file);
        let mesh = import::read(&path, scale, *up).map_err(|error| wrong(format!("the mesh `{file}` {error}")))?;
        if mesh.without_area > 0 {
            let count = mesh.without_area;
            self.notes.push(format!(
                "{file}: removed {count} of {} triangles, which have no area",
                count + mesh.triangles.len()
            ));
        }
        let size_m = mesh.size_m();
        if unit.is_none() && scale == 1.0 && size_m > LARGE_MESH_M {
            self.notes.push(format!("{file} is {size_m:.0} m long: if it is drawn in mm, add `unit: mm`"));
        }
        self.mesh_files.insert(path);
        let mesh = Rc::new(mesh);
        self.meshes.insert(key, Rc::clone(&mesh));
        Ok(mesh)
    }

    fn add(&mut self, mesh: &MeshTriangles, id: MaterialId, at: &Pose, into: &mut Surfaces) -> Result<(), SpecError> {
        self.triangle_count += mesh.triangles.len();
        if self.triangle_count > MAX_TRIANGLES {
            let message = format!("the scene has more than {MAX_TRIANGLES} triangles");
            return Err(SpecError::plain(&self.source.name, message));
        }
        for triangle in &mesh.triangles {
            let corners = triangle.map(|corner| at.rotation * corner + at.translation.vector);
            if !corners.iter().flatten().all(|x| x.abs() <= MAX_EXTENT_M) {
                let message = format!("an item extends to more than {} km from the origin", MAX_EXTENT_M / 1000.0);
                return Err(SpecError::plain(&self.source.name, message).with_help("lengths are metres"));
            }
            into.triangles.push(corners);
            into.materials.push(id);
            into.solids.push(self.solid_count);
        }
        self.solid_count += 1;
        Ok(())
    }
}
