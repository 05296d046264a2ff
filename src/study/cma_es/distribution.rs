//! The distribution of CMA-ES, and its adaptation to a generation.

use super::rates::Rates;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand_distr::{Distribution as _, StandardNormal};
use zsim_base::random::Stream;

/// Stops if the distribution and its path are narrower than this fraction of the first step.
const STEP_TOLERANCE: f64 = 1e-12;
/// Stops if the distribution is wider than this multiple of the first step: the function has no minimum nearby.
const MAX_GROWTH: f64 = 1e8;
/// Stops if the condition number of the covariance matrix is larger.
const MAX_CONDITION: f64 = 1e14;
/// Maximum number of iterations of the eigendecomposition; some ten are usual.
const MAX_EIGEN_ITERATIONS: usize = 10_000;

/// The distribution that generations are drawn from, and the paths of its mean.
pub(super) struct Distribution {
    pub mean: DVector<f64>,
    /// Step size, sigma.
    pub step: f64,
    covariance: DMatrix<f64>,
    /// Principal axes of the covariance, and standard deviations along them.
    axes: DMatrix<f64>,
    deviations: DVector<f64>,
    step_path: DVector<f64>,
    path: DVector<f64>,
    generations: usize,
}

impl Distribution {
    pub(super) fn new(start: &[f64], step: f64) -> Self {
        let n = start.len();
        let (identity, zero) = (DMatrix::identity(n, n), DVector::zeros(n));
        Self {
            mean: DVector::from_column_slice(start),
            step,
            covariance: identity.clone(),
            axes: identity,
            deviations: DVector::from_element(n, 1.0),
            step_path: zero.clone(),
            path: zero,
            generations: 0,
        }
    }

    /// Draws a step in units of the step size.
    pub(super) fn sample(&self, stream: &mut Stream) -> DVector<f64> {
        let z = DVector::from_fn(self.mean.len(), |_, _| StandardNormal.sample(stream)); // (38)
        &self.axes * self.deviations.component_mul(&z) // (39)
    }

    /// The step in the coordinates in which the distribution is the standard normal one.
    fn whitened(&self, y: &DVector<f64>) -> DVector<f64> {
        &self.axes * self.axes.tr_mul(y).component_div(&self.deviations)
    }

    /// Adapts to a generation's steps, from the best to the worst; false if the covariance is not positive definite.
    pub(super) fn update(&mut self, rates: &Rates, steps: &[DVector<f64>]) -> bool {
        let n = self.mean.len() as f64;
        self.generations += 1;
        let weighted = steps.iter().zip(&rates.weights).take(rates.parents).map(|(y, w)| y * *w);
        let y_w = weighted.fold(DVector::zeros(self.mean.len()), |sum, y| sum + y); // (41)
        self.mean += self.step * &y_w; // (42)
        let gain = |rate: f64| (rate * (2.0 - rate) * rates.effective).sqrt();
        self.step_path = (1.0 - rates.step) * &self.step_path + gain(rates.step) * self.whitened(&y_w); // (43)
        let length = self.step_path.norm() / rates.expected_length;
        // The path is not updated while the step size still grows fast.
        let settled = (1.0 - (1.0 - rates.step).powf(2.0 * self.generations as f64)).sqrt();
        let is_short = length / settled < 1.4 + 2.0 / (n + 1.0);
        let (moving, lost) = if is_short { (1.0, 0.0) } else { (0.0, rates.path * (2.0 - rates.path)) };
        self.path = (1.0 - rates.path) * &self.path + moving * gain(rates.path) * &y_w; // (45)
        let sum: f64 = rates.weights.iter().sum();
        let kept = 1.0 + rates.rank_one * lost - rates.rank_one - rates.rank_mu * sum;
        let mut covariance = kept * &self.covariance + rates.rank_one * (&self.path * self.path.transpose());
        for (y, weight) in steps.iter().zip(&rates.weights) {
            let scale = if *weight < 0.0 { n / self.whitened(y).norm_squared() } else { 1.0 }; // (46)
            covariance += rates.rank_mu * weight * scale * (y * y.transpose()); // (47)
        }
        self.step *= (rates.step / rates.damping * (length - 1.0)).exp(); // (44)
        self.covariance = covariance;
        self.decompose()
    }

    fn decompose(&mut self) -> bool {
        let eigen = SymmetricEigen::try_new(self.covariance.clone(), f64::EPSILON, MAX_EIGEN_ITERATIONS);
        let Some(eigen) = eigen.filter(|eigen| eigen.eigenvalues.iter().all(|value| *value > 0.0)) else {
            return false;
        };
        self.deviations = eigen.eigenvalues.map(f64::sqrt);
        self.axes = eigen.eigenvectors;
        true
    }

    /// Whether further generations are useless: numerically, or because the distribution has converged or diverged.
    pub(super) fn has_ended(&self, first_step: f64) -> bool {
        let deviation = |k: usize| self.step * self.covariance[(k, k)].sqrt();
        let coordinates = 0..self.mean.len();
        let tolerance = STEP_TOLERANCE * first_step;
        let has_converged =
            coordinates.clone().all(|k| deviation(k) < tolerance && (self.step * self.path[k]).abs() < tolerance);
        let (low, high) = (self.deviations.min(), self.deviations.max());
        let has_diverged = self.step * high > MAX_GROWTH * first_step || (high / low).powi(2) > MAX_CONDITION;
        let axis = self.generations % self.mean.len();
        let along_axis = 0.1 * self.step * self.deviations[axis] * self.axes.column(axis);
        let has_no_effect = &self.mean + along_axis == self.mean
            || coordinates.clone().any(|k| self.mean[k] + 0.2 * deviation(k) == self.mean[k]);
        has_converged || has_diverged || has_no_effect
    }
}
