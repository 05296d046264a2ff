use super::build::{WorldParts, build};
use super::canopy::{Canopy, CanopyCrossing};
use super::caster::{Caster, Crossing};
use super::meadow::Meadow;
use super::mover::Mover;
use super::planes::PlaneMap;
use super::section::{SectionPlane, Segment, edges};
use super::{Hit, Material, MaterialId, Ray, SceneSpec, TimedRay, WorldError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use zsim_base::geometry::{Route, Surface, SurfacePoint, Vector};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, find, parse_named};

/// Distance within which two hits are the same surface for [`World::cast_beyond`], m.
const SAME_SURFACE_M: f64 = 1e-4;

/// A world into which rays can be cast, from any number of threads.
pub struct World {
    name: String,
    materials: Vec<Material>,
    static_surfaces: Caster,
    movers: Vec<Mover>,
    meadows: Vec<Meadow>,
    canopies: Vec<Canopy>,
    routes: BTreeMap<String, Route>,
    default_route: Option<String>,
    notes: Vec<String>,
    mesh_files: BTreeSet<PathBuf>,
}

impl World {
    /// Finds a scene by path or name, and builds it.
    ///
    /// # Errors
    /// If there is no such scene, or it is invalid.
    pub fn load(name_or_path: &str) -> Result<Self, WorldError> {
        let source = find(Kind::Scene, name_or_path)?;
        Self::build(&SceneSpec::parse(&source)?, &source)
    }

    /// Builds the world that a scene describes. `source` is the text of the scene, for errors and for the folder of its
    /// meshes.
    ///
    /// # Errors
    /// If an included scene or a mesh is missing or invalid, a name is not defined, or values are inconsistent.
    pub fn build(spec: &SceneSpec, source: &Source) -> Result<Self, WorldError> {
        let spec = &spec.with_includes(source)?;
        let WorldParts { materials, static_surfaces, movers, meadows, canopies, routes, notes, mesh_files } =
            build(spec, source)?;
        Ok(Self {
            name: spec.name.clone(),
            materials,
            static_surfaces: Caster::new(&static_surfaces),
            movers,
            meadows,
            canopies,
            routes,
            default_route: spec.default_route.clone(),
            notes,
            mesh_files,
        })
    }

    /// Name of the scene.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The first surface within `max_range_m` along `ray` at `t_s`, seconds of true time since the start of the run.
    /// Glass counts as a surface; see [`World::cast_beyond`] for surfaces behind it.
    pub fn cast(&self, ray: &Ray, max_range_m: f64, t_s: f64) -> Option<Hit> {
        let timed = TimedRay { ray: *ray, reach_m: max_range_m, t_s };
        self.first_hit(&timed, self.static_surfaces.cast(&ray.origin_in_world, &ray.direction_in_world, max_range_m))
    }

    /// The first static surface within `max_range_m` along `ray`.
    pub(super) fn cast_static(&self, ray: &Ray, max_range_m: f64) -> Option<Hit> {
        let crossing = self.static_surfaces.cast(&ray.origin_in_world, &ray.direction_in_world, max_range_m)?;
        let Crossing { distance, normal, material, face } = crossing;
        Some(Hit { distance_m: distance, normal_in_world: normal, material, face: Some(face) })
    }

    /// The first surface on each ray of a scan, as [`World::cast`] finds it, but several times faster.
    ///
    /// Each 16 rays in sequence are searched together, so neighbours in the slice should be neighbours in space. Rays
    /// that diverge by more than 60 degrees are correct too, but not faster.
    pub fn cast_all(&self, rays: &[TimedRay]) -> Vec<Option<Hit>> {
        let crossings = self.static_surfaces.cast_all(rays);
        rays.iter().zip(crossings).map(|(timed, crossing)| self.first_hit(timed, crossing)).collect()
    }

    /// The first surface on a ray, given the first static one.
    fn first_hit(&self, timed: &TimedRay, static_crossing: Option<Crossing>) -> Option<Hit> {
        let TimedRay { ray, reach_m, t_s } = timed;
        let (origin, direction) = (&ray.origin_in_world, &ray.direction_in_world);
        let (mut first, mut is_static) = (static_crossing, true);
        for mover in &self.movers {
            let reach = first.map_or(*reach_m, |crossing| crossing.distance);
            if let Some(crossing) = mover.cast(origin, direction, reach, *t_s) {
                (first, is_static) = (Some(crossing), false);
            }
        }
        for meadow in &self.meadows {
            let reach = first.map_or(*reach_m, |crossing| crossing.distance);
            if let Some(crossing) = meadow.cast(origin, direction, reach, *t_s) {
                (first, is_static) = (Some(crossing), false);
            }
        }
        first.map(|Crossing { distance, normal, material, face }| Hit {
            distance_m: distance,
            normal_in_world: normal,
            material,
            face: is_static.then_some(face),
        })
    }

    /// The first surface along `ray` farther than `beyond_m`, the distance of a previous hit. Distances are from the
    /// origin of the ray; two surfaces within 0.1 mm count as one.
    pub fn cast_beyond(&self, ray: &Ray, beyond_m: f64, max_range_m: f64, t_s: f64) -> Option<Hit> {
        let skipped = beyond_m + SAME_SURFACE_M;
        let rest = Ray { origin_in_world: ray.at(skipped), ..*ray };
        let hit = self.cast(&rest, max_range_m - skipped, t_s)?;
        Some(Hit { distance_m: hit.distance_m + skipped, ..hit })
    }

    /// The parts of `ray` in canopies, up to `max_range_m`. [`World::cast`] ignores canopies: a ray is stopped in them at
    /// random.
    pub fn canopies(&self, ray: &Ray, max_range_m: f64) -> impl Iterator<Item = CanopyCrossing> {
        self.canopies.iter().filter_map(move |canopy| canopy.crossing(ray, max_range_m))
    }

    /// Distance of a point from the nearest mover, swaying plant or canopy at `t_s`, seconds of true time since the start
    /// of the run, m; `None` above `reach_m`. [`Surface::nearest`] covers static surfaces only.
    pub fn distance_to_movers_m(&self, point_in_world: &Vector, reach_m: f64, t_s: f64) -> Option<f64> {
        let movers = self.movers.iter().filter_map(|mover| mover.distance(point_in_world, reach_m, t_s));
        let meadows = self.meadows.iter().filter_map(|meadow| meadow.distance(point_in_world, reach_m, t_s));
        let canopies = self.canopies.iter().map(|canopy| canopy.distance_m(point_in_world));
        let distances = movers.chain(meadows).chain(canopies.filter(|distance_m| *distance_m <= reach_m));
        distances.min_by(f64::total_cmp)
    }

    /// The static surface point nearest to `point_in_world` within `reach_m` (m), and its material.
    pub fn nearest_material(&self, point_in_world: &Vector, reach_m: f64) -> Option<(SurfacePoint, MaterialId)> {
        self.static_surfaces.nearest(point_in_world, reach_m)
    }

    /// The static triangles: corners in the world, accurate to single precision, and material.
    pub fn triangles(&self) -> impl Iterator<Item = ([Vector; 3], MaterialId)> + '_ {
        self.static_surfaces.triangles()
    }

    /// The triangles of movers and swaying plants at `t_s`, seconds of true time since the start of the run: corners in
    /// the world, m, and material.
    pub fn moving_triangles(&self, t_s: f64) -> impl Iterator<Item = ([Vector; 3], MaterialId)> + '_ {
        let movers = self.movers.iter().flat_map(move |mover| mover.triangles(t_s));
        movers.chain(self.meadows.iter().flat_map(move |meadow| meadow.triangles(t_s)))
    }

    /// The segments along which a plane cuts the static surfaces.
    pub fn section(&self, plane: &SectionPlane) -> Vec<Segment> {
        self.triangles().filter_map(|(triangle, _)| plane.cut(&triangle)).collect()
    }

    /// The planes of the static surfaces: which faces are parts of one plane.
    pub fn planes(&self) -> PlaneMap {
        PlaneMap::of(&self.static_surfaces.flat_faces().collect::<Vec<_>>())
    }

    /// The edges of the static surfaces: where a surface ends, or meets another at more than 25 degrees.
    pub fn edges(&self) -> Vec<Segment> {
        let triangles: Vec<[Vector; 3]> = self.triangles().map(|(triangle, _)| triangle).collect();
        edges(triangles.iter())
    }

    /// A material of this world.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.materials[id.index()]
    }

    /// The materials, in the order of [`MaterialId::index`].
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The routes, by name.
    pub fn routes(&self) -> &BTreeMap<String, Route> {
        &self.routes
    }

    /// The route that a run follows by default: the one that the scene names, or its only one.
    pub fn default_route(&self) -> Option<&Route> {
        match &self.default_route {
            Some(name) => self.routes.get(name),
            None => self.routes.values().next().filter(|_| self.routes.len() == 1),
        }
    }

    /// Lower and upper corner of the bounding box of all static surfaces, m.
    pub fn bounds(&self) -> (Vector, Vector) {
        self.static_surfaces.bounds()
    }

    /// Number of static triangles.
    pub fn triangle_count(&self) -> usize {
        self.static_surfaces.len()
    }

    /// Notes about the meshes, one sentence each: triangles without area that were removed, sizes that suggest another unit,
    /// positions far from the origin, and materials that the scene does not have.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The mesh files that the scene was built from.
    pub fn mesh_files(&self) -> &BTreeSet<PathBuf> {
        &self.mesh_files
    }
}

impl Surface for World {
    fn nearest(&self, point_in_world: &Vector, reach_m: f64) -> Option<SurfacePoint> {
        self.nearest_material(point_in_world, reach_m).map(|(point, _)| point)
    }
}

impl NamedSpec for SceneSpec {
    const KIND: Kind = Kind::Scene;
    type Error = WorldError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        let scene: Self = parse_named(source)?;
        if scene.name.is_empty() {
            return Ok(Self { name: source.stem(), ..scene });
        }
        Ok(scene)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match World::build(self, source) {
            Ok(world) => Ok([world.notes(), &world.route_warnings()].concat()),
            Err(WorldError::Scene(error) | WorldError::Mesh(error)) => Err(error),
        }
    }

    fn resolved(self, source: &Source) -> Result<Self, WorldError> {
        self.with_includes(source)
    }
}
