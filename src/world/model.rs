use super::build::{Parts, build};
use super::caster::{Caster, Crossing};
use super::mover::Mover;
use super::{Hit, Material, MaterialId, Ray, SceneSpec, WorldError};
use crate::geometry::{Route, Surface, SurfacePoint, Vector};
use crate::spec::{Kind, Source, find, parse};
use std::collections::BTreeMap;

/// A hit this close behind another, m, is the same surface to [`World::cast_beyond`].
const SAME_SURFACE_M: f64 = 1e-4;

/// A world, ready to be looked at: from any number of threads at once, without allocating.
pub struct World {
    name: String,
    materials: Vec<Material>,
    still: Caster,
    movers: Vec<Mover>,
    routes: BTreeMap<String, Route>,
    default_route: Option<String>,
    notes: Vec<String>,
}

impl World {
    /// Finds a scene by path or name, and builds it.
    ///
    /// # Errors
    /// When there is no such scene, or it is wrong.
    pub fn load(name_or_path: &str) -> Result<Self, WorldError> {
        let source = find(Kind::Scene, name_or_path)?;
        Self::build(&parse(&source)?, &source)
    }

    /// Builds the world that a scene describes; `source` is the text it came from, for errors and for the folder of its
    /// meshes.
    ///
    /// # Errors
    /// When the scene includes what it cannot, names what it does not have, gives numbers that do not fit together, or
    /// names a bad mesh.
    pub fn build(spec: &SceneSpec, source: &Source) -> Result<Self, WorldError> {
        let spec = &spec.with_includes(source)?;
        let Parts { materials, still, movers, routes, notes } = build(spec, source)?;
        let still = Caster::new(&still.triangles, &still.materials);
        let (name, default_route) = (spec.name.clone(), spec.default_route.clone());
        Ok(Self { name, materials, still, movers, routes, default_route, notes })
    }

    /// What the scene calls itself.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The first surface within `max_range_m` along `ray` at `t_s`, seconds of true time since the run's start. Glass
    /// is a surface like any other; see [`World::cast_beyond`] for what stands behind it.
    pub fn cast(&self, ray: &Ray, max_range_m: f64, t_s: f64) -> Option<Hit> {
        let (origin, direction) = (&ray.origin_in_world, &ray.direction_in_world);
        let mut first = self.still.cast(origin, direction, max_range_m);
        for mover in &self.movers {
            let reach = first.map_or(max_range_m, |crossing| crossing.distance);
            first = mover.cast(origin, direction, reach, t_s).or(first);
        }
        first.map(|Crossing { distance, normal, material }| Hit {
            distance_m: distance,
            normal_in_world: normal,
            material,
        })
    }

    /// The first surface along `ray` that is further than `beyond_m`, where a hit was. Distances are from the ray's
    /// origin still; two surfaces within 0.1 mm are one.
    pub fn cast_beyond(&self, ray: &Ray, beyond_m: f64, max_range_m: f64, t_s: f64) -> Option<Hit> {
        let skipped = beyond_m + SAME_SURFACE_M;
        let rest = Ray { origin_in_world: ray.at(skipped), ..*ray };
        let hit = self.cast(&rest, max_range_m - skipped, t_s)?;
        Some(Hit { distance_m: hit.distance_m + skipped, ..hit })
    }

    /// How far a point is from the nearest of what moves at `t_s`, seconds of true time since the run's start, m;
    /// `None` where that is more than `reach_m`. [`Surface::nearest`] knows what stands alone.
    pub fn distance_to_movers_m(&self, point_in_world: &Vector, reach_m: f64, t_s: f64) -> Option<f64> {
        let distances = self.movers.iter().filter_map(|mover| mover.distance(point_in_world, reach_m, t_s));
        distances.min_by(f64::total_cmp)
    }

    /// A material of this world.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.materials[usize::from(id.0)]
    }

    /// The ways to walk, by name.
    pub fn routes(&self) -> &BTreeMap<String, Route> {
        &self.routes
    }

    /// The way that is walked unless another is asked for.
    pub fn default_route(&self) -> Option<&Route> {
        self.default_route.as_ref().and_then(|name| self.routes.get(name))
    }

    /// Two opposite corners of the box around all that stands still, the lower first, m.
    pub fn bounds(&self) -> (Vector, Vector) {
        self.still.bounds()
    }

    /// How many triangles stand still.
    pub fn triangle_count(&self) -> usize {
        self.still.len()
    }

    /// What the builder of the scene should know, a sentence each: triangles without area that a mesh was built
    /// without.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

impl Surface for World {
    fn nearest(&self, point_in_world: &Vector, reach_m: f64) -> Option<SurfacePoint> {
        self.still.nearest(point_in_world, reach_m)
    }
}
