//! Flatness of surfels, and the extra variance of surfels that are not flat.
//!
//! On an uneven surface (ledges, books on a shelf) the mean of a cell's points depends on the viewpoint: at oblique incidence
//! the protruding parts occlude the recessed ones. As the head passes by, all such surfels shift in the same direction. In
//! noise-free trials this was the main error of the odometry. Such a surfel is thicker than range noise explains. The excess
//! adds variance to the position along the normal, so that flat surfels outweigh it; it still constrains the pose where
//! there are no flat ones.

use super::Surfel;
use crate::spec::SurfelSpec;

/// Lower limit of the expected thickness variance, as a fraction of the range variance (0.2 standard deviations): at grazing
/// incidence the projected noise vanishes, and no surfel would count as flat.
const MIN_NOISE_FRACTION: f64 = 0.04;

/// A surfel with measured and expected thickness.
#[derive(Debug, Clone)]
pub(super) struct SurfelThickness {
    pub(super) surfel: Surfel,
    /// Whether the surface is a wall (true) or ground or ceiling (false).
    pub(super) is_upright: bool,
    /// Variance of the points along the normal, m^2.
    pub(super) variance: f64,
    /// Variance along the normal that the specified range noise causes on a plane, m^2.
    pub(super) noise_variance: f64,
}

/// Variance across a plane from range noise of variance `noise2` (m^2) at incidence of cosine `cos`, m^2.
pub(super) fn noise_across(noise2: f64, cos: f64) -> f64 {
    noise2 * cos.powi(2).max(MIN_NOISE_FRACTION)
}

/// Returns the surfels with the roughness variance added to uneven ones.
pub(super) fn add_roughness_variance(all: Vec<SurfelThickness>, spec: &SurfelSpec) -> Vec<Surfel> {
    let usual = [false, true].map(|upright| usual_thickness(all.iter().filter(|shaped| shaped.is_upright == upright)));
    let add = |shaped: SurfelThickness| {
        let flat = usual[usize::from(shaped.is_upright)] * shaped.noise_variance;
        Surfel {
            roughness_variance: spec.excess_doubt * shaped.excess(flat, spec.max_thickness_sigmas),
            ..shaped.surfel
        }
    };
    all.into_iter().map(add).collect()
}

/// Lower quartile of the finest surfels' thickness variance, relative to the variance expected from the specified noise.
///
/// It measures the actual noise, or the usual roughness of the ground. The quartile is used instead of the median because on
/// a staircase most horizontal surfels contain the edge of a step, and the median would take them for rough ground. 1 if
/// there are no surfels.
fn usual_thickness<'a>(all: impl Iterator<Item = &'a SurfelThickness>) -> f64 {
    let mut finest: Vec<f64> = all.filter(|s| s.surfel.level == 0).map(|s| s.variance / s.noise_variance).collect();
    if finest.is_empty() {
        return 1.0;
    }
    let quartile = finest.len() / 4;
    finest.select_nth_unstable_by(quartile, f64::total_cmp).1.max(MIN_NOISE_FRACTION)
}

impl SurfelThickness {
    /// Variance along the normal in excess of that of a plane, `flat`, plus `sigmas` standard deviations of it, m^2.
    ///
    /// The standard deviation of a variance estimated from `N` points is `sqrt(2 / N)` times the variance.
    fn excess(&self, flat: f64, sigmas: f64) -> f64 {
        (self.variance - flat * (1.0 + sigmas * (2.0 / self.surfel.points).sqrt())).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Matrix, Vector};

    /// A surfel of 200 points with a thickness of `thickness_m`, at normal incidence, range noise 10 mm.
    fn surfel_with(thickness_m: f64, is_upright: bool) -> SurfelThickness {
        let surfel = Surfel {
            tau_s: 0.0,
            ray_in_imu: Vector::new(0.0, 0.0, -2.0),
            normal_in_imu: Vector::z(),
            covariance_in_imu: Matrix::from_diagonal(&Vector::new(0.013, 0.013, thickness_m.powi(2))),
            points: 200.0,
            weakness: 0.0,
            roughness_variance: 0.0,
            level: 0,
        };
        SurfelThickness { surfel, is_upright, variance: thickness_m.powi(2), noise_variance: noise_across(1e-4, 1.0) }
    }

    fn roughness_variances(all: impl Iterator<Item = SurfelThickness>) -> Vec<f64> {
        let shipped = spec::load("default").unwrap().surfels;
        let spec = SurfelSpec { max_thickness_sigmas: 2.0, excess_doubt: 7.0, ..shipped };
        add_roughness_variance(all.collect(), &spec).iter().map(|surfel| surfel.roughness_variance).collect()
    }

    #[test]
    fn noisy_planes_have_no_roughness_variance_and_a_bookshelf_has() {
        let walls = (0..9).map(|k| surfel_with(0.01 * (1.0 + 0.01 * f64::from(k)), true));
        let found = roughness_variances(walls.chain([surfel_with(0.02, true)]));
        assert_eq!(found[..9], [0.0; 9]);
        // The quartile (third of ten) is 10.2 mm thick; the variance of 200 points has a standard deviation of 10 %.
        assert_relative_eq!(found[9], 7.0 * (0.02_f64.powi(2) - 1.2 * 0.0102_f64.powi(2)), max_relative = 1e-9);
    }

    #[test]
    fn edges_of_steps_have_roughness_variance_even_if_they_are_the_majority() {
        let landing = (0..4).map(|_| surfel_with(0.01, false));
        let steps = (0..8).map(|_| surfel_with(0.03, false));
        let found = roughness_variances(landing.chain(steps));
        assert_eq!(found[..4], [0.0; 4]);
        assert!(found[4..].iter().all(|roughness_variance| roughness_variance.sqrt() > 0.05), "{found:?}");
    }

    #[test]
    fn uniformly_rough_ground_and_underspecified_noise_add_no_variance() {
        let ground = (0..9).map(|_| surfel_with(0.025, false));
        let walls = (0..9).map(|_| surfel_with(0.015, true));
        assert_eq!(roughness_variances(ground.chain(walls)), [0.0; 18]);
    }

    #[test]
    fn range_noise_is_projected_on_the_normal() {
        // At 60 degrees to the normal the standard deviation across the plane is half of that along the beam.
        assert_relative_eq!(noise_across(1e-4, 60_f64.to_radians().cos()), 0.25e-4, max_relative = 1e-12);
    }
}
