use super::Lidar;
use crate::geometry::{Rotation, Vector};
use crate::sensors::{CanopyPart, Scenery, SurfaceHit, Track};
use crate::time::Stamp;

/// Maximum number of glass surfaces that a ray passes; a ray that hits more is lost.
const MAX_GLASS: usize = 8;
/// Distance behind a glass surface at which a ray continues, m: more than the rounding of the intersection.
const GLASS_OFFSET_M: f64 = 1e-4;

/// A ray is first cast up to the range of the previous ray plus this margin: fraction of the range, and m.
///
/// Successive rays mostly hit the same surface, so the short cast usually succeeds, and it is faster.
const SEARCH_MARGIN: (f64, f64) = (0.05, 0.1);

/// Timing of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanTiming {
    /// Number of the scan in the run, from 0; it selects the scan's part of each noise stream.
    pub index: u64,
    /// Time of the first beam, true seconds after the start.
    pub start_s: f64,
    /// Crystal seconds of the lidar per true second.
    pub pace: f64,
    /// Stamp of the scan on the lidar clock.
    pub stamp: Stamp,
}

/// Ray intersections of one scan, exact, without sensor errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Timing of the scan.
    pub timing: ScanTiming,
    /// Rotation of the beams relative to scan 0.
    pub(super) rotation: Option<Rotation>,
    surfaces: Vec<SurfaceHit>,
    canopies: Vec<CanopyPart>,
    /// End indices in `surfaces` and `canopies` for each ray.
    ends: Vec<[u32; 2]>,
}

impl Sweep {
    /// The surfaces that ray `ray` hits, in order: any number of glass surfaces, then at most one of another material.
    pub fn surfaces(&self, ray: usize) -> &[SurfaceHit] {
        let [start, _] = self.starts(ray);
        &self.surfaces[start as usize..self.ends[ray][0] as usize]
    }

    /// The parts of ray `ray` in canopies, before its last surface.
    pub fn canopies(&self, ray: usize) -> &[CanopyPart] {
        let [_, start] = self.starts(ray);
        &self.canopies[start as usize..self.ends[ray][1] as usize]
    }

    /// Whether any ray crosses a canopy.
    pub fn has_canopies(&self) -> bool {
        !self.canopies.is_empty()
    }

    fn starts(&self, ray: usize) -> [u32; 2] {
        ray.checked_sub(1).map_or([0; 2], |before| self.ends[before])
    }

    /// Number of rays cast, over all beams.
    pub fn rays(&self) -> usize {
        self.ends.len()
    }
}

/// A ray of a beam in the world.
struct LidarRay {
    origin: Vector,
    direction: Vector,
    /// Firing time of the beam, true seconds.
    t_s: f64,
}

impl Lidar {
    /// Casts the rays of the scan with `timing` into `scenery`. Each ray starts at the pose of the lidar frame at the
    /// firing time of its beam; `laser` is the track of that frame.
    pub fn sweep(&self, scenery: &dyn Scenery, laser: &Track, timing: &ScanTiming) -> Sweep {
        let mut sweep = Sweep {
            timing: *timing,
            rotation: self.scan_rotation(timing.index),
            surfaces: Vec::with_capacity(self.rays.len() + self.rays.len() / 8),
            canopies: Vec::new(),
            ends: Vec::with_capacity(self.rays.len()),
        };
        let mut previous_m = self.spec.range_max_m;
        for (beam, rays) in self.beams.iter().zip(self.rays.chunks_exact(self.rays_per_beam())) {
            let t_s = timing.start_s + beam.offset_s / timing.pace;
            let world_from_laser = laser.pose(t_s);
            let origin = world_from_laser.translation.vector;
            let world_from_beams =
                sweep.rotation.map_or(world_from_laser.rotation, |turn| world_from_laser.rotation * turn);
            for ray in rays {
                let direction = world_from_beams * ray;
                self.trace(scenery, &LidarRay { origin, direction, t_s }, &mut previous_m, &mut sweep.surfaces);
                scenery.canopies(&origin, &direction, previous_m, &mut sweep.canopies);
                sweep.ends.push([sweep.surfaces.len(), sweep.canopies.len()].map(|end| end as u32));
            }
        }
        sweep
    }

    /// Traces a ray through glass to the last surface. `previous_m` is the range of the previous ray on entry, and of
    /// this ray on return.
    fn trace(&self, scenery: &dyn Scenery, ray: &LidarRay, previous_m: &mut f64, surfaces: &mut Vec<SurfaceHit>) {
        let LidarRay { origin, direction, t_s } = ray;
        let cast = |from: &Vector, reach_m: f64| scenery.first_hit(from, direction, reach_m, *t_s);
        let near_m = *previous_m * (1.0 + SEARCH_MARGIN.0) + SEARCH_MARGIN.1;
        *previous_m = self.spec.range_max_m;
        let (mut from, mut travelled_m) = (*origin, 0.0);
        for _ in 0..MAX_GLASS {
            let (near_m, reach_m) = (near_m - travelled_m, self.spec.range_max_m - travelled_m);
            let near = if (0.0..reach_m).contains(&near_m) { cast(&from, near_m) } else { None };
            let Some(hit) = near.or_else(|| cast(&from, reach_m)) else { return };
            let range_m = travelled_m + hit.range_m;
            surfaces.push(SurfaceHit { range_m, ..hit });
            if !hit.is_glass() {
                *previous_m = range_m;
                return;
            }
            travelled_m = range_m + GLASS_OFFSET_M;
            from = origin + direction * travelled_m;
        }
    }
}
