//! From a scene's spec to triangles: templates are placed, objects scattered, meshes read, and all of it checked.

use super::caster::Caster;
use super::import::{self, MeshTriangles};
use super::mover::{Mover, Path};
use super::scatter;
use super::shape::Triangle;
use super::{
    ItemSpec, LengthUnit, Material, MaterialId, MaterialKind, MoverSpec, Placement, SceneSpec, ShapeSpec, WorldError,
};
use crate::geometry::{Pose, Route, Vector};
use crate::spec::{Source, SpecError};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Most triangles of a scene: they take about 350 bytes each while it is built.
pub(super) const MAX_TRIANGLES: usize = 10_000_000;
/// Furthest from the origin that a surface or a route may be, m.
const MAX_EXTENT_M: f64 = 100_000.0;
/// Deepest nesting of templates.
const MAX_DEPTH: usize = 8;

/// What a world is made of.
pub(super) struct Parts {
    pub materials: Vec<Material>,
    pub still: Surfaces,
    pub movers: Vec<Mover>,
    pub routes: BTreeMap<String, Route>,
    pub notes: Vec<String>,
}

/// Triangles, one material each.
#[derive(Default)]
pub(super) struct Surfaces {
    pub triangles: Vec<Triangle>,
    pub materials: Vec<MaterialId>,
}

/// Builds all parts of a world.
pub(super) fn build(spec: &SceneSpec, source: &Source) -> Result<Parts, WorldError> {
    let mut builder = Builder {
        spec,
        source,
        material_ids: material_ids(spec, source)?,
        routes: routes(spec, source)?,
        meshes: BTreeMap::new(),
        triangle_count: 0,
        notes: Vec::new(),
    };
    let mut still = Surfaces::default();
    builder.add_items(&spec.items, &Pose::identity(), 0, &mut still)?;
    if still.triangles.is_empty() {
        return Err(SpecError::about(source, "items", "the scene has no surfaces: `items` is empty").into());
    }
    let movers = spec.movers.iter().map(|mover| builder.mover(mover)).collect::<Result<_, _>>()?;
    let Builder { routes, notes, .. } = builder;
    Ok(Parts { materials: materials(spec), still, movers, routes, notes })
}

/// The materials, in the order of their names, as their ids have it.
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
        let message = format!("the scene has {} materials; it may have {}", spec.materials.len(), u16::MAX);
        return Err(SpecError::about(source, "materials", message));
    }
    for (name, material) in &spec.materials {
        if let MaterialKind::Glass { transmission } = material.kind
            && transmission + material.reflectance > 1.0
        {
            let message =
                format!("`{name}` reflects {} and lets {transmission} through: more than all of the light", {
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
            return Err(SpecError::about(source, name, message)
                .with_help("a walker who stands still is a matter of the motion"));
        }
    }
    if let Some(name) = &spec.default_route
        && !spec.routes.contains_key(name)
    {
        return Err(unknown(source, "route", name, spec.routes.keys()));
    }
    let route = |(name, route): (&String, &super::RouteSpec)| {
        let points_in_world = route.points_m.iter().map(|point| Vector::from(*point)).collect();
        (name.clone(), Route { points_in_world, closed: route.closed })
    };
    Ok(spec.routes.iter().map(route).collect())
}

/// An error about a name that the scene does not define, with those that it does.
fn unknown<'a>(source: &Source, what: &str, name: &str, known: impl Iterator<Item = &'a String>) -> SpecError {
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
    notes: Vec<String>,
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
                    for place in self.places(at_m_deg, material)? {
                        self.add(&local, id, &(at * place), into)?;
                    }
                }
                ItemSpec::Place { template, at_m_deg } => {
                    for place in self.places(at_m_deg, template)? {
                        self.add_template(template, &(at * place), depth, into)?;
                    }
                }
                ItemSpec::Scatter(scatter) => {
                    let routes: Vec<&Route> = self.routes.values().collect();
                    let places = scatter::places(scatter, at, &routes)
                        .map_err(|(key, sentence)| SpecError::about(self.source, key, sentence))?;
                    for place in places {
                        self.add_template(&scatter.template, &(at * place), depth, into)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn add_template(&mut self, name: &str, at: &Pose, depth: usize, into: &mut Surfaces) -> Result<(), WorldError> {
        let Some(items) = self.spec.templates.get(name) else {
            return Err(unknown(self.source, "template", name, self.spec.templates.keys()).into());
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
            return Err(wrong("turns by 180 degrees between two waypoints: say which way, by one more between them"));
        }
        let mut surfaces = Surfaces::default();
        self.add_template(&mover.template, &Pose::identity(), 0, &mut surfaces)?;
        Ok(Mover::new(Caster::new(&surfaces.triangles, &surfaces.materials), Path::new(&waypoints, mover.repeats)))
    }

    fn material_id(&self, name: &str) -> Result<MaterialId, SpecError> {
        let id = self.material_ids.get(name).copied();
        id.ok_or_else(|| unknown(self.source, "material", name, self.spec.materials.keys()))
    }

    fn places(&self, places: &[Placement], name: &str) -> Result<Vec<Pose>, SpecError> {
        if places.is_empty() {
            let message = format!("`at_m_deg` of an item of `{name}` is an empty list");
            return Err(
                SpecError::about(self.source, name, message).with_help("leave it out to place it at the origin")
            );
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
            return Err(wrong(format!("a scene without a folder of its own cannot name the mesh `{file}`")));
        };
        let mesh = import::read(&folder.join(file), scale, *up)
            .map_err(|error| wrong(format!("the mesh `{file}` {error}")))?;
        if mesh.without_area > 0 {
            let count = mesh.without_area;
            self.notes.push(format!(
                "{file}: removed {count} of {} triangles, which have no area",
                count + mesh.triangles.len()
            ));
        }
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
                let message = format!("an item reaches further than {} km from the origin", MAX_EXTENT_M / 1000.0);
                return Err(SpecError::plain(&self.source.name, message).with_help("lengths are metres"));
            }
            into.triangles.push(corners);
            into.materials.push(id);
        }
        Ok(())
    }
}
