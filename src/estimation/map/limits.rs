//! Where something is looked for in a map, from where, and what is believed of what is found.

use super::locate::{Located, apart, tried};
use crate::geometry::{Pose, Vector};

/// How far apart starts are, m, and by what angle, rad: what the coarsest surfels reach.
const APART: (f64, f64) = (0.7, 14.0 / 180.0 * std::f64::consts::PI);
/// Behind a silence the head is at most so far from where it was expected, m: at once, a second, and at most.
const AWAY: (f64, f64, f64) = (0.3, 1.0, 2.5);
/// Starts go no farther, m: what is seen from there reaches the rest.
const FARTHEST_M: f64 = 1.4;
/// Behind a longer silence a place must agree better: it is looked for far about, s.
const LONG_S: f64 = 1.5;
/// It is turned by at most so much, degrees: at once, a second, and at most.
const TURNED_DEG: (f64, f64, f64) = (15.0, 60.0, 90.0);

/// How far from about where it may be something is looked for, and what is believed.
#[derive(Debug)]
pub(in crate::estimation) struct Search {
    /// On the level, m, and turned, rad.
    reach: (f64, f64),
    /// Patches this far apart along their normals lie on each other, m; the share of a voxel's edge where nothing is
    /// said.
    pub(super) gate_m: Option<f64>,
    /// Least share of the finest patches that lies on the map.
    share: f64,
    /// Least share of those that have a patch of the map beside them.
    agreement: f64,
    /// Largest residual of those that lie on the map, root mean square, m.
    residual_m: f64,
    /// Whether of places that are as good the nearest counts; if not, none of them.
    pub(super) nearest: bool,
}

/// Largest residual in a map, m: at right places it is 3 to 7 mm, where surfaces match by chance 10 to 17 mm.
const RESIDUAL_M: f64 = 0.01;

/// In a map which shows all that is seen: with what the coarsest surfels reach, a metre and twenty degrees.
pub(in crate::estimation) const IN_MAP: Search =
    Search { reach: APART, gate_m: None, share: 0.4, agreement: 0.0, residual_m: RESIDUAL_M, nearest: false };

impl Search {
    /// In what was seen before a silence of `seconds`, matches being good to `sigma_m`. It may show little of what is
    /// seen behind it, but where both show a place, it must be the same; and the head cannot have gone far.
    pub(in crate::estimation) fn behind_silence(seconds: f64, sigma_m: f64) -> Self {
        let reach_m = (AWAY.0 + AWAY.1 * seconds).min(AWAY.2);
        let reach_deg = (TURNED_DEG.0 + TURNED_DEG.1 * seconds).min(TURNED_DEG.2);
        let reach = (reach_m, reach_deg.to_radians());
        let agreement = if seconds > LONG_S { 0.85 } else { 0.6 };
        Self { reach, gate_m: Some(1.5 * sigma_m), share: 0.1, agreement, residual_m: f64::INFINITY, nearest: true }
    }

    /// Each start, twice: as what it began, and as what it becomes.
    pub(super) fn starts(&self, map_from_seen: &Pose, from: &Vector) -> Vec<(Pose, Pose)> {
        let steps = |reach: f64, apart: f64| {
            let most = (reach / apart).floor() as i32;
            (-most..=most).map(move |k| f64::from(k) * apart)
        };
        let far_m = self.reach.0.min(FARTHEST_M);
        let mut starts = Vec::new();
        for yaw in steps(self.reach.1, APART.1) {
            for (x, y) in steps(far_m, APART.0).flat_map(|x| steps(far_m, APART.0).map(move |y| (x, y))) {
                let start = tried(map_from_seen, from, yaw, Vector::new(x, y, 0.0));
                starts.push((start, start));
            }
        }
        starts
    }

    /// Whether enough of what was seen, and of what could, lies on the map where it was found.
    pub(super) fn believes(&self, found: &Located) -> bool {
        found.share >= self.share && found.agreement >= self.agreement && found.residual_rms_m <= self.residual_m
    }

    /// How likely a head is where it was found, as far as where it was expected says, 0..1.
    pub(super) fn likely(&self, found: &Pose, expected: &Pose, from: &Vector) -> f64 {
        if !self.nearest {
            return 1.0;
        }
        let (far_m, turned) = apart(found, expected, from);
        let sigmas = 2.0 * (far_m / self.reach.0).max(turned / self.reach.1);
        if sigmas > 3.0 { 0.0 } else { (-0.5 * sigmas * sigmas).exp() }
    }
}
