//! Weights and learning rates of CMA-ES: the default parameters of the tutorial, table 1.

/// Weights and learning rates, which depend on dimension and population only.
pub(super) struct Rates {
    /// Weights of the points by rank: the first `parents` sum to 1, the others are negative.
    pub weights: Vec<f64>,
    /// Number of points with positive weights, mu.
    pub parents: usize,
    /// Effective number of parents, mu_eff.
    pub effective: f64,
    /// Learning rate of the path of the step size, c_sigma.
    pub step: f64,
    /// Damping of the step size, d_sigma.
    pub damping: f64,
    /// Learning rate of the path of the mean, c_c.
    pub path: f64,
    /// Learning rates of the covariance from the path and from a generation, c_1 and c_mu.
    pub rank_one: f64,
    pub rank_mu: f64,
    /// Expected length of a vector of standard normal variables.
    pub expected_length: f64,
}

impl Rates {
    pub(super) fn new(dimension: usize, population: usize) -> Self {
        let n = dimension as f64;
        let weight = |rank: usize| ((population as f64 + 1.0) / 2.0).ln() - (rank as f64).ln(); // (49)
        let mut weights: Vec<f64> = (1..=population).map(weight).collect();
        let parents = population / 2;
        let sum = |w: &[f64]| w.iter().sum::<f64>();
        let effective = |w: &[f64]| sum(w).powi(2) / w.iter().map(|w| w * w).sum::<f64>();
        let (mu, mu_negative) = (effective(&weights[..parents]), effective(&weights[parents..]));
        let step = (mu + 2.0) / (n + mu + 5.0); // (55)
        let damping = 1.0 + 2.0 * (((mu - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + step; // (55)
        let path = (4.0 + mu / n) / (n + 4.0 + 2.0 * mu / n); // (56)
        let rank_one = 2.0 / ((n + 1.3).powi(2) + mu); // (57)
        let rank_mu = (1.0 - rank_one).min(2.0 * (0.25 + mu + 1.0 / mu - 2.0) / ((n + 2.0).powi(2) + mu)); // (58)
        let negative = (1.0 + rank_one / rank_mu) // (50)
            .min(1.0 + 2.0 * mu_negative / (mu + 2.0)) // (51)
            .min((1.0 - rank_one - rank_mu) / (n * rank_mu)); // (52)
        let scales = [1.0 / sum(&weights[..parents]), -negative / sum(&weights[parents..])];
        weights.iter_mut().enumerate().for_each(|(k, w)| *w *= scales[usize::from(k >= parents)]); // (53)
        let expected_length = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        Self { weights, parents, effective: mu, step, damping, path, rank_one, rank_mu, expected_length }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn weights_have_the_sums_of_the_tutorial() {
        for (dimension, population) in [(1, 4), (4, 8), (4, 10), (10, 11), (40, 100)] {
            let rates = Rates::new(dimension, population);
            let (positive, negative) = rates.weights.split_at(rates.parents);
            assert!(positive.iter().all(|w| *w > 0.0) && negative.iter().all(|w| *w <= 0.0));
            assert_relative_eq!(positive.iter().sum::<f64>(), 1.0, epsilon = 1e-12);
            // The covariance stays positive definite: what remains of it exceeds what the negative weights can remove (52).
            let removed = -rates.rank_mu * negative.iter().sum::<f64>() * dimension as f64;
            assert!(removed <= 1.0 - rates.rank_one - rates.rank_mu + 1e-12, "{dimension}, {population}: {removed}");
        }
    }
}
