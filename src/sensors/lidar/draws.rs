//! Random numbers of the lidar.

use super::MAX_RAYS;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use zsim_base::random::{Seed, Stream};

/// Random numbers of one scan. Each beam takes the same count from each stream, whether or not it hits a surface, so
/// that a change at one beam does not change the noise of another. Numbers for canopies are drawn in scans that cross one.
pub(super) struct ScanDraws {
    range: Stream,
    later: Stream,
    threshold: Stream,
    glass: Stream,
    canopy: Stream,
}

/// Random numbers of one beam.
pub(super) struct BeamDraws {
    pub range: f64,
    pub threshold: f64,
    pub glass: f64,
    /// One number for each ray, in scans that cross a canopy.
    pub canopy: [f64; MAX_RAYS],
}

impl ScanDraws {
    /// The streams of scan number `scan`.
    pub fn of(seed: &Seed, scan: u64) -> Self {
        let part = |name: &str| seed.part(name, scan);
        Self {
            range: part("lidar/range"),
            later: part("lidar/range/later_echoes"),
            threshold: part("lidar/threshold"),
            glass: part("lidar/glass"),
            canopy: part("lidar/canopy"),
        }
    }

    /// The numbers of the next beam, of which `canopy_rays` rays can be stopped in a canopy.
    pub fn next_beam(&mut self, canopy_rays: usize) -> BeamDraws {
        let mut canopy = [0.0; MAX_RAYS];
        canopy[..canopy_rays].fill_with(|| self.canopy.random());
        BeamDraws {
            canopy,
            range: StandardNormal.sample(&mut self.range),
            threshold: f64::from(self.threshold.random::<f32>()),
            glass: f64::from(self.glass.random::<f32>()),
        }
    }

    /// Random number for the second and later echoes of a beam.
    pub fn next_later_echo(&mut self) -> f64 {
        StandardNormal.sample(&mut self.later)
    }
}
