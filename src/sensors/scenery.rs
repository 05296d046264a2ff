use zsim_base::geometry::Vector;
use zsim_world::{Hit, Ray, TimedRay, World};

/// Intersection of a ray with a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceHit {
    /// Distance along the ray, m.
    pub range_m: f64,
    /// Cosine of the angle between the ray and the surface normal, 0..=1.
    pub cos_incidence: f32,
    /// Fraction of light that returns diffusely at normal incidence, 0..=1.
    pub reflectance: f32,
    /// Fraction of light that a single pass through the surface transmits; 0 for materials other than glass.
    pub transmission: f32,
}

impl SurfaceHit {
    /// Whether a beam can pass through the surface.
    pub fn is_glass(&self) -> bool {
        self.transmission > 0.0
    }
}

/// Part of a ray in a canopy, in which it is stopped at random.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanopyPart {
    /// Distance along the ray at which it enters, m.
    pub from_m: f64,
    /// Distance at which it leaves, m.
    pub to_m: f64,
    /// Extinction coefficient, 1/m.
    pub extinction_per_m: f64,
    /// Fraction of light that a leaf returns diffusely at normal incidence, 0..=1.
    pub reflectance: f32,
}

/// Surroundings of a lidar, into which rays can be cast.
pub trait Scenery: Sync {
    /// The first surface within `reach_m` on the ray from `origin` along the unit vector `direction`, both in the
    /// world, at `t_s` seconds after the start.
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, t_s: f64) -> Option<SurfaceHit>;

    /// The first surface on each ray of a scan, as [`Scenery::first_hit`] finds it. Neighbours in the slice should be
    /// neighbours in space, so that an implementation can search them together.
    fn first_hits(&self, rays: &[TimedRay]) -> Vec<Option<SurfaceHit>> {
        let first_hit = |TimedRay { ray, reach_m, t_s }: &TimedRay| {
            self.first_hit(&ray.origin_in_world, &ray.direction_in_world, *reach_m, *t_s)
        };
        rays.iter().map(first_hit).collect()
    }

    /// Appends the parts of a ray in canopies, within `reach_m`. By default there are none.
    fn canopies(&self, _origin: &Vector, _direction: &Vector, _reach_m: f64, _into: &mut Vec<CanopyPart>) {}
}

impl Scenery for World {
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, t_s: f64) -> Option<SurfaceHit> {
        let ray = Ray { origin_in_world: *origin, direction_in_world: *direction };
        self.cast(&ray, reach_m, t_s).map(|hit| surface_hit(self, direction, &hit))
    }

    fn first_hits(&self, rays: &[TimedRay]) -> Vec<Option<SurfaceHit>> {
        let hits = self.cast_all(rays);
        let surface = |(timed, hit): (&TimedRay, Option<Hit>)| {
            hit.map(|hit| surface_hit(self, &timed.ray.direction_in_world, &hit))
        };
        rays.iter().zip(hits).map(surface).collect()
    }

    fn canopies(&self, origin: &Vector, direction: &Vector, reach_m: f64, into: &mut Vec<CanopyPart>) {
        let ray = Ray { origin_in_world: *origin, direction_in_world: *direction };
        into.extend(self.canopies(&ray, reach_m).map(|part| CanopyPart {
            from_m: part.from_m,
            to_m: part.to_m,
            extinction_per_m: part.extinction_per_m,
            reflectance: self.material(part.material).reflectance as f32,
        }));
    }
}

/// A hit with the optical properties of its material.
fn surface_hit(world: &World, direction: &Vector, hit: &Hit) -> SurfaceHit {
    let material = world.material(hit.material);
    SurfaceHit {
        range_m: hit.distance_m,
        cos_incidence: hit.normal_in_world.dot(direction).abs() as f32,
        reflectance: material.reflectance as f32,
        transmission: material.transmission as f32,
    }
}
