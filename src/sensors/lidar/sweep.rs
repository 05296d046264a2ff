use super::Lidar;
use crate::geometry::{Rotation, Vector};
use crate::sensors::{Scenery, SurfaceHit, Track};
use crate::time::Stamp;

/// Surfaces of glass that a ray may pass; a ray that meets more is lost.
const MAX_GLASS: usize = 8;
/// Beyond a surface of glass, a ray goes on from here, m.
const BEYOND_GLASS_M: f64 = 1e-4;

/// A ray is sought first up to where the one before it ended, and this much further: fraction of the range, and m.
///
/// Rays that follow each other mostly end on one surface, and a search need not look behind it.
const FURTHER: (f64, f64) = (0.05, 0.1);

/// When a scan is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Firing {
    /// Which scan of the run, from 0: names the scan's part of each noise stream.
    pub index: u64,
    /// When its first beam is fired, true seconds after the start.
    pub start_s: f64,
    /// Seconds of the lidar's crystal a true second.
    pub pace: f64,
    /// The scan's stamp, on the lidar's clock.
    pub stamp: Stamp,
}

/// What the rays of one scan met: exact, before any error of the sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// When the scan was taken.
    pub firing: Firing,
    /// By what its beams are turned against those of scan 0.
    pub(super) turned: Option<Rotation>,
    surfaces: Vec<SurfaceHit>,
    /// Where the surfaces of each ray end in `surfaces`.
    ends: Vec<u32>,
}

impl Sweep {
    /// The surfaces that ray `ray` met, in order: any number of glass, then one of another material, or none.
    pub fn surfaces(&self, ray: usize) -> &[SurfaceHit] {
        let start = ray.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.surfaces[start as usize..self.ends[ray] as usize]
    }

    /// How many rays were cast: those of every beam.
    pub fn rays(&self) -> usize {
        self.ends.len()
    }
}

impl Lidar {
    /// Casts the rays of the scan of `firing` into `scenery`, each from where `laser`, the track of the lidar's frame,
    /// was when its beam was fired.
    pub fn sweep(&self, scenery: &dyn Scenery, laser: &Track, firing: &Firing) -> Sweep {
        let mut sweep = Sweep {
            firing: *firing,
            turned: self.turned(firing.index),
            surfaces: Vec::with_capacity(self.rays.len() + self.rays.len() / 8),
            ends: Vec::with_capacity(self.rays.len()),
        };
        let mut last_m = self.spec.range_max_m;
        for (beam, rays) in self.beams.iter().zip(self.rays.chunks_exact(self.rays_per_beam())) {
            let t_s = firing.start_s + beam.offset_s / firing.pace;
            let world_from_laser = laser.pose(t_s);
            let origin = world_from_laser.translation.vector;
            let world_from_beams =
                sweep.turned.map_or(world_from_laser.rotation, |turn| world_from_laser.rotation * turn);
            for ray in rays {
                let direction = world_from_beams * ray;
                self.follow(scenery, (&origin, &direction, t_s), &mut last_m, &mut sweep.surfaces);
                sweep.ends.push(sweep.surfaces.len() as u32);
            }
        }
        sweep
    }

    /// Follows a ray through glass to where it ends; `last_m` is how far the ray before it went, and becomes how far
    /// this one did.
    fn follow(
        &self,
        scenery: &dyn Scenery,
        (origin, direction, t_s): (&Vector, &Vector, f64),
        last_m: &mut f64,
        surfaces: &mut Vec<SurfaceHit>,
    ) {
        let seek = |from: &Vector, reach_m: f64| scenery.first_hit(from, direction, reach_m, t_s);
        let near_m = *last_m * (1.0 + FURTHER.0) + FURTHER.1;
        *last_m = self.spec.range_max_m;
        let (mut from, mut gone_m) = (*origin, 0.0);
        for _ in 0..MAX_GLASS {
            let (near_m, reach_m) = (near_m - gone_m, self.spec.range_max_m - gone_m);
            let near = if (0.0..reach_m).contains(&near_m) { seek(&from, near_m) } else { None };
            let Some(hit) = near.or_else(|| seek(&from, reach_m)) else { return };
            let range_m = gone_m + hit.range_m;
            surfaces.push(SurfaceHit { range_m, ..hit });
            if !hit.is_glass() {
                *last_m = range_m;
                return;
            }
            gone_m = range_m + BEYOND_GLASS_M;
            from = origin + direction * gone_m;
        }
    }
}
