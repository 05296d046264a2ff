//! Which patches are flat, and what those are worth that are not.
//!
//! Where a wall has ledges, or books stand on a shelf, the mean of a cell's points hangs on where it was seen from:
//! obliquely, what juts out hides what lies behind. To one who walks by all such patches shift the same way, and
//! without noise of any kind this was what the open loop erred by. Such a patch is thicker than noise makes a plane,
//! and by that it is known; its place is put in doubt, so that the flat ones outweigh it, and it holds where there are
//! no others.

use super::Surfel;
use crate::estimation::spec::SurfelSpec;

/// Part of the range's variance below which a patch is not told from a flat one: a fifth of its standard deviation.
const LEAST: f64 = 0.04;

/// A surfel, and how thick it is.
#[derive(Debug, Clone)]
pub(super) struct Shaped {
    pub(super) surfel: Surfel,
    /// Whether it stands, as a wall, or lies, as the ground.
    pub(super) is_upright: bool,
    /// Of its points along the normal, m^2.
    pub(super) variance: f64,
    /// What noise, as it was told, makes of a plane, m^2.
    pub(super) by_noise: f64,
}

/// What noise of variance `noise2` along beams makes across a plane that they hit at an angle of cosine `cos`, m^2.
pub(super) fn noise_across(noise2: f64, cos: f64) -> f64 {
    noise2 * cos.powi(2).max(LEAST)
}

/// The surfels, those that are not flat in doubt.
pub(super) fn doubted(all: Vec<Shaped>, spec: &SurfelSpec) -> Vec<Surfel> {
    let usual = [false, true].map(|upright| usual_thickness(all.iter().filter(|shaped| shaped.is_upright == upright)));
    let doubted = |shaped: Shaped| {
        let flat = usual[usize::from(shaped.is_upright)] * shaped.by_noise;
        Surfel { doubt: spec.excess_doubt * shaped.excess(flat, spec.flat_within_sigmas), ..shaped.surfel }
    };
    all.into_iter().map(doubted).collect()
}

/// The variance that a quarter of the finest patches stay below, as a multiple of what noise as it was told makes of
/// planes: how large noise really is, or how rough this ground. A quarter, and not half: on a staircase most of what
/// lies is the edge of a step, and would pass for rough ground. 1 if there are none.
fn usual_thickness<'a>(all: impl Iterator<Item = &'a Shaped>) -> f64 {
    let mut finest: Vec<f64> = all.filter(|s| s.surfel.level == 0).map(|s| s.variance / s.by_noise).collect();
    if finest.is_empty() {
        return 1.0;
    }
    let quartile = finest.len() / 4;
    finest.select_nth_unstable_by(quartile, f64::total_cmp).1.max(LEAST)
}

impl Shaped {
    /// The variance along the normal beyond that of a plane, `flat`, and beyond `sigmas` of what the number of points
    /// leaves open, m^2: a variance taken of `N` points has a standard deviation of `sqrt(2 / N)` of itself.
    fn excess(&self, flat: f64, sigmas: f64) -> f64 {
        (self.variance - flat * (1.0 + sigmas * (2.0 / self.surfel.points).sqrt())).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::spec;
    use crate::geometry::{Matrix, Vector};
    use approx::assert_relative_eq;

    /// A patch of 200 points that is `thickness_m` thick, seen squarely by beams with a noise of 10 mm.
    fn patch(thickness_m: f64, is_upright: bool) -> Shaped {
        let surfel = Surfel {
            tau_s: 0.0,
            reach_in_imu: Vector::new(0.0, 0.0, -2.0),
            normal_in_imu: Vector::z(),
            covariance_in_imu: Matrix::from_diagonal(&Vector::new(0.013, 0.013, thickness_m.powi(2))),
            points: 200.0,
            doubt: 0.0,
            level: 0,
        };
        Shaped { surfel, is_upright, variance: thickness_m.powi(2), by_noise: noise_across(1e-4, 1.0) }
    }

    fn doubts(all: impl Iterator<Item = Shaped>) -> Vec<f64> {
        let shipped = spec::load("default").unwrap().surfels;
        let spec = SurfelSpec { flat_within_sigmas: 2.0, excess_doubt: 7.0, ..shipped };
        doubted(all.collect(), &spec).iter().map(|surfel| surfel.doubt).collect()
    }

    #[test]
    fn planes_of_noise_are_in_no_doubt_and_a_shelf_of_books_is() {
        let walls = (0..9).map(|k| patch(0.01 * (1.0 + 0.01 * f64::from(k)), true));
        let found = doubts(walls.chain([patch(0.02, true)]));
        assert_eq!(found[..9], [0.0; 9]);
        // The third of the ten is 10.2 mm thick; of 200 points a variance is known to a tenth.
        assert_relative_eq!(found[9], 7.0 * (0.02_f64.powi(2) - 1.2 * 0.0102_f64.powi(2)), max_relative = 1e-9);
    }

    #[test]
    fn edges_of_steps_are_in_doubt_though_most_are_such() {
        let landing = (0..4).map(|_| patch(0.01, false));
        let steps = (0..8).map(|_| patch(0.03, false));
        let found = doubts(landing.chain(steps));
        assert_eq!(found[..4], [0.0; 4]);
        assert!(found[4..].iter().all(|doubt| doubt.sqrt() > 0.05), "{found:?}");
    }

    #[test]
    fn rough_ground_is_usual_and_so_is_noise_greater_than_it_was_told() {
        let ground = (0..9).map(|_| patch(0.025, false));
        let walls = (0..9).map(|_| patch(0.015, true));
        assert_eq!(doubts(ground.chain(walls)), [0.0; 18]);
    }

    #[test]
    fn noise_lies_along_the_beams() {
        // Points scattered along a beam at 60 degrees to the normal scatter across the plane by half as much.
        assert_relative_eq!(noise_across(1e-4, 60_f64.to_radians().cos()), 0.25e-4, max_relative = 1e-12);
    }
}
