//! Echoes of a beam, from the surfaces that the rays hit.

use super::canopy::{LEAF_COS_INCIDENCE, stop};
use super::draws::BeamDraws;
use super::{GlassSpec, Lidar, MAX_RAYS, Sweep};

/// Light returned from one distance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Echo {
    /// Distance, m: the power-weighted mean over the rays.
    pub range_m: f64,
    /// `reflectance cos(incidence) / range^2`, the weighted sum over the rays, 1/m^2.
    pub power: f64,
    /// Cosine of incidence, the power-weighted mean over the rays.
    pub cos_incidence: f64,
}

/// The echoes of a beam in order of distance.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Echoes {
    /// At most one echo for each ray.
    list: [Echo; MAX_RAYS],
    count: usize,
}

impl Echoes {
    pub fn as_slice(&self) -> &[Echo] {
        &self.list[..self.count]
    }

    /// Removes the weakest echoes until `count` remain, in order of distance.
    pub fn keep_strongest(&mut self, count: usize) {
        while self.count > count {
            let weakest = (0..self.count).min_by(|a, b| self.list[*a].power.total_cmp(&self.list[*b].power));
            let Some(weakest) = weakest else { return };
            self.list.copy_within(weakest + 1..self.count, weakest);
            self.count -= 1;
        }
    }

    /// Inserts the echo of a ray in order of distance.
    fn insert(&mut self, echo: Echo) {
        let at = self.as_slice().partition_point(|other| other.range_m <= echo.range_m);
        self.list.copy_within(at..self.count, at + 1);
        self.list[at] = echo;
        self.count += 1;
    }

    /// Merges echoes whose pulses overlap into mixed pixels.
    fn join_within(&mut self, pulse_m: f64) {
        let mut joined = 0;
        let mut first_range_m = f64::NEG_INFINITY;
        for next in 0..self.count {
            let echo = self.list[next];
            if echo.range_m - first_range_m <= pulse_m {
                self.list[joined - 1] = mixed(&self.list[joined - 1], &echo);
            } else {
                first_range_m = echo.range_m;
                self.list[joined] = echo;
                joined += 1;
            }
        }
        self.count = joined;
    }
}

fn mixed(a: &Echo, b: &Echo) -> Echo {
    let power = a.power + b.power;
    let fraction = if power > 0.0 { b.power / power } else { 0.5 };
    Echo {
        range_m: a.range_m + (b.range_m - a.range_m) * fraction,
        power,
        cos_incidence: a.cos_incidence + (b.cos_incidence - a.cos_incidence) * fraction,
    }
}

impl Lidar {
    /// The echoes of beam `beam`.
    ///
    /// `draws` determines which glass surface reflects the beam, and where canopies stop its rays. `None` lets the beam pass
    /// all glass and canopies without attenuation.
    pub(super) fn echoes(&self, sweep: &Sweep, beam: usize, draws: Option<&BeamDraws>) -> Echoes {
        let per_beam = self.rays_per_beam();
        let mut echoes = Echoes::default();
        for (k, weight) in self.weights.iter().enumerate() {
            let ray = beam * per_beam + k;
            let leaf = draws.and_then(|draws| stop(sweep.canopies(ray), draws.canopy[k]));
            if let Some(echo) = self.ray_echo(sweep, ray, (*weight, leaf), draws.map(|draws| draws.glass)) {
                echoes.insert(echo);
            }
        }
        if echoes.count > 1 {
            echoes.join_within(self.spec.pulse_length_m);
        }
        echoes
    }

    /// The echo of a ray; with its weight, and range and reflectance of the leaf that stops it unless a surface is nearer.
    fn ray_echo(
        &self,
        sweep: &Sweep,
        ray: usize,
        (weight, leaf): (f64, Option<(f64, f64)>),
        glass_draw: Option<f64>,
    ) -> Option<Echo> {
        let GlassSpec { echo: glass_echo, delay_m } = self.spec.errors.glass;
        let (mut light, mut late_m, mut draw) = (weight, 0.0, glass_draw.unwrap_or(1.0));
        let returned = |light: f64, late_m: f64, range_m: f64, reflectance: f64, cos_incidence: f64| Echo {
            range_m: range_m + late_m,
            power: light * reflectance * cos_incidence / (range_m * range_m),
            cos_incidence,
        };
        for surface in sweep.surfaces(ray) {
            if leaf.is_some_and(|(range_m, _)| range_m < surface.range_m) {
                break;
            }
            let cos = f64::from(surface.cos_incidence);
            let turns_back = glass_echo * cos;
            if !surface.is_glass() || draw < turns_back {
                return Some(returned(light, late_m, surface.range_m, f64::from(surface.reflectance), cos));
            }
            if glass_draw.is_some() {
                // Given that the beam passed, the draw is uniform in turns_back..1. Rescaled to 0..1 it decides at the
                // next surface.
                draw = (draw - turns_back) / (1.0 - turns_back).max(f64::MIN_POSITIVE);
                light *= f64::from(surface.transmission).powi(2);
                late_m += delay_m;
            }
        }
        leaf.map(|(range_m, reflectance)| returned(light, late_m, range_m, reflectance, LEAF_COS_INCIDENCE))
    }
}
