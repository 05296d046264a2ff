//! Error bound of a pose.

use zsim_base::geometry::{Matrix, PoseCovariance};
use zsim_base::signal::chi_squared_quantile;

/// Probability that a position is within the bound.
const PROBABILITY: f64 = 0.99;

/// Computes the radius that contains a Gaussian error with a probability of 99 %.
///
/// In the unit of the standard deviations; infinite if the matrix is not a valid covariance.
///
/// The squared error is a weighted sum of chi-squared variables, approximated by one scaled chi-squared variable of the
/// same mean `tr P` and variance `2 tr P^2` (Satterthwaite, Biometrics Bulletin 2, 1946), which is exact for equal
/// eigenvalues and for a single one.
pub fn radius_99(covariance: &Matrix) -> f64 {
    let (mean, variance) = (covariance.trace(), 2.0 * (covariance * covariance).trace());
    if !(mean.is_finite() && variance.is_finite() && mean >= 0.0) {
        return f64::INFINITY;
    }
    if mean <= 0.0 || variance <= 0.0 {
        return 0.0;
    }
    let degrees = 2.0 * mean * mean / variance;
    (0.5 * variance / mean * chi_squared_quantile(PROBABILITY, degrees)).sqrt()
}

/// Returns the position and attitude blocks of a pose covariance, m^2 and rad^2.
pub fn covariance_blocks(covariance: &PoseCovariance) -> (Matrix, Matrix) {
    (covariance.fixed_view::<3, 3>(0, 0).into_owned(), covariance.fixed_view::<3, 3>(3, 3).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use zsim_base::geometry::Vector;

    #[test]
    fn the_radius_is_the_textbook_quantile_where_eigenvalues_are_equal_or_single() {
        // 99 % of chi-squared: 11.345 with three degrees of freedom, 6.635 with one.
        assert!((radius_99(&Matrix::identity()) - 11.345_f64.sqrt()).abs() < 0.02);
        let line = Matrix::from_diagonal(&Vector::new(4.0, 0.0, 0.0));
        assert!((radius_99(&line) - 2.0 * 6.635_f64.sqrt()).abs() < 0.03);
        assert_eq!(radius_99(&Matrix::zeros()), 0.0);
        assert_eq!(radius_99(&Matrix::from_element(f64::NAN)), f64::INFINITY);
    }

    #[test]
    fn ninety_nine_of_a_hundred_errors_are_within_the_radius() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        for sigmas in [Vector::new(1.0, 1.0, 3.0), Vector::new(0.2, 1.0, 1.0)] {
            let radius = radius_99(&Matrix::from_diagonal(&sigmas.component_mul(&sigmas)));
            let mut error = || sigmas.map(|sigma| sigma * random.sample::<f64, _>(StandardNormal)).norm();
            let within = (0..20_000).filter(|_| error() <= radius).count() as f64 / 20_000.0;
            // The binomial standard deviation is 0.07 %.
            assert!((within - 0.99).abs() < 0.004, "{within}");
        }
    }
}
