use super::Lidar;
use crate::{CanopyPart, Scenery, SurfaceHit, Track};
use zsim_base::geometry::Rotation;
use zsim_base::time::Stamp;
use zsim_world::{Ray, TimedRay};

/// Maximum number of glass surfaces that a ray passes; a ray that hits more is lost.
const MAX_GLASS: usize = 8;
/// Distance behind a glass surface at which a ray continues, m: more than the rounding of the intersection.
const GLASS_OFFSET_M: f64 = 1e-4;

/// Rays are cast in blocks of about this number, which limits the memory of a scan with many rays.
const BLOCK_RAYS: usize = 1024;

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
        let per_beam = self.rays_per_beam();
        let block = (BLOCK_RAYS / per_beam).max(1);
        let mut timed = Vec::with_capacity(block * per_beam);
        for (beams, rays) in self.beams.chunks(block).zip(self.rays.chunks(block * per_beam)) {
            timed.clear();
            for (beam, rays) in beams.iter().zip(rays.chunks_exact(per_beam)) {
                let t_s = timing.start_s + beam.offset_s / timing.pace;
                let world_from_laser = laser.pose(t_s);
                let world_from_beams =
                    sweep.rotation.map_or(world_from_laser.rotation, |turn| world_from_laser.rotation * turn);
                timed.extend(rays.iter().map(|ray| {
                    let origin_in_world = world_from_laser.translation.vector;
                    let ray = Ray { origin_in_world, direction_in_world: world_from_beams * ray };
                    TimedRay { ray, reach_m: self.spec.range_max_m, t_s }
                }));
            }
            sweep.add(scenery, &timed);
        }
        sweep
    }
}

impl Sweep {
    /// Adds the surfaces and canopies on rays, in sequence.
    fn add(&mut self, scenery: &dyn Scenery, rays: &[TimedRay]) {
        for (timed, hit) in rays.iter().zip(scenery.first_hits(rays)) {
            let end_m = self.trace(scenery, timed, hit);
            let Ray { origin_in_world, direction_in_world } = &timed.ray;
            scenery.canopies(origin_in_world, direction_in_world, end_m, &mut self.canopies);
            self.ends.push([self.surfaces.len(), self.canopies.len()].map(|end| end as u32));
        }
    }

    /// Adds the surfaces on a ray, given the first one: through glass to the last surface. Returns where the ray ends, m.
    fn trace(&mut self, scenery: &dyn Scenery, timed: &TimedRay, first: Option<SurfaceHit>) -> f64 {
        let TimedRay { ray, reach_m, t_s } = timed;
        let (mut next, mut travelled_m) = (first, 0.0);
        for _ in 0..MAX_GLASS {
            let Some(hit) = next else { return *reach_m };
            let range_m = travelled_m + hit.range_m;
            self.surfaces.push(SurfaceHit { range_m, ..hit });
            if !hit.is_glass() {
                return range_m;
            }
            travelled_m = range_m + GLASS_OFFSET_M;
            next = scenery.first_hit(&ray.at(travelled_m), &ray.direction_in_world, reach_m - travelled_m, *t_s);
        }
        *reach_m
    }
}
