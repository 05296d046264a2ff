//! Wilcoxon signed-rank test of paired differences, and Holm's correction for multiple tests.
//!
//! F. Wilcoxon, Individual comparisons by ranking methods, Biometrics Bulletin 1(6), 1945. S. Holm, A simple
//! sequentially rejective multiple test procedure, Scandinavian Journal of Statistics 6(2), 1979.

/// Maximum number of pairs for the exact distribution; above it the normal approximation is accurate to three digits.
const MAX_EXACT_PAIRS: usize = 200;

/// Two-sided p-value of the Wilcoxon signed-rank test that `differences` are symmetric about zero.
///
/// Exact up to 200 differences. Zeros and NaN are omitted; ties get their mean rank; infinite differences rank highest.
/// 1 without any nonzero difference.
pub fn signed_rank_p(differences: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = differences.iter().copied().filter(|x| *x != 0.0 && !x.is_nan()).collect();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    // Doubled ranks, so that mean ranks of ties are integers.
    let mut ranks = Vec::with_capacity(sorted.len());
    for equal in sorted.chunk_by(|a, b| a.abs() == b.abs()) {
        let first = ranks.len() + 1;
        ranks.extend(std::iter::repeat_n(2 * first + equal.len() - 1, equal.len()));
    }
    let total: usize = ranks.iter().sum();
    let positive: usize = sorted.iter().zip(&ranks).filter(|(x, _)| **x > 0.0).map(|(_, rank)| rank).sum();
    let lesser = positive.min(total - positive);
    if ranks.len() > MAX_EXACT_PAIRS {
        // Random signs: the sum has mean total / 2 and variance sum(rank^2) / 4.
        let squares: f64 = ranks.iter().map(|rank| (*rank as f64).powi(2)).sum();
        let z = (0.5 * total as f64 - lesser as f64) / (0.25 * squares).sqrt();
        return libm::erfc(z / std::f64::consts::SQRT_2);
    }
    // Probability of each sum of ranks under random signs.
    let mut probability = vec![0.0; total + 1];
    probability[0] = 1.0;
    for rank in &ranks {
        for sum in (0..=total).rev() {
            let with = if sum >= *rank { probability[sum - rank] } else { 0.0 };
            probability[sum] = 0.5 * (probability[sum] + with);
        }
    }
    let below: f64 = probability[..=lesser].iter().sum();
    (2.0 * below).min(1.0)
}

/// Holm-corrected p-values of several tests: they control the family-wise error rate.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut corrected = vec![1.0; p_values.len()];
    let mut least = 0.0_f64;
    for (before, index) in order.into_iter().enumerate() {
        least = least.max(((p_values.len() - before) as f64 * p_values[index]).min(1.0));
        corrected[index] = least;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// p-value by the definition: enumerates all equally probable signs.
    fn by_enumeration(ranks: &[f64], positive: f64) -> f64 {
        let total: f64 = ranks.iter().sum();
        let lesser = positive.min(total - positive);
        let sum = |signs: u32| -> f64 {
            let positive = ranks.iter().enumerate().filter(|(k, _)| signs & (1 << k) != 0);
            positive.map(|(_, rank)| rank).sum()
        };
        let all = 1_u32 << ranks.len();
        let at_most = (0..all).filter(|signs| sum(*signs) <= lesser + 1e-9).count();
        (2.0 * at_most as f64 / f64::from(all)).min(1.0)
    }

    #[test]
    fn the_p_value_equals_that_of_enumerating_all_signs() {
        // Ranks 1 to 10; ranks 1, 3 and 4 are negative with sum 8.
        let differences = [-0.1, 0.2, -0.3, -0.4, 0.5, 0.6, 0.7, 0.8, 0.9, f64::INFINITY];
        let ranks: Vec<f64> = (1..=10).map(f64::from).collect();
        assert_relative_eq!(signed_rank_p(&differences), by_enumeration(&ranks, 8.0), epsilon = 1e-12);
        // In Wilcoxon's tables 8 is the two-sided critical value of 10 pairs at 0.05; 9 is not significant.
        assert!(signed_rank_p(&differences) < 0.05);
        let not_significant = [-0.1, 0.2, -0.3, 0.4, -0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
        assert!(signed_rank_p(&not_significant) > 0.05);
        // Two ties share the rank 1.5; a zero is omitted.
        let tied = [0.1, -0.1, 0.3, 0.4, 0.0];
        assert_relative_eq!(signed_rank_p(&tied), by_enumeration(&[1.5, 1.5, 3.0, 4.0], 1.5), epsilon = 1e-12);
    }

    #[test]
    fn the_normal_approximation_continues_the_exact_distribution() {
        // A given number of tenths of the signs are negative, spread evenly over the ranks.
        let pairs = |count: i32, tenths: i32| -> Vec<f64> {
            (1..=count).map(|k| if k % 10 < tenths { -f64::from(k) } else { f64::from(k) }).collect()
        };
        // Normal approximation of the rank sum: mean n (n + 1) / 4, variance n (n + 1) (2 n + 1) / 24.
        let by_normal_law = |differences: &[f64]| {
            let n = differences.len() as f64;
            let negative: f64 = differences.iter().filter(|x| **x < 0.0).map(|x| -x).sum();
            let sigma = (n * (n + 1.0) * (2.0 * n + 1.0) / 24.0).sqrt();
            libm::erfc((n * (n + 1.0) / 4.0 - negative) / sigma / std::f64::consts::SQRT_2)
        };
        let (exact, approximated) = (pairs(200, 4), pairs(201, 4));
        assert_relative_eq!(signed_rank_p(&exact).ln(), by_normal_law(&exact).ln(), max_relative = 0.01);
        assert_relative_eq!(signed_rank_p(&approximated), by_normal_law(&approximated), max_relative = 1e-9);
        assert!(signed_rank_p(&pairs(2000, 3)) < 1e-20);
    }

    #[test]
    fn few_pairs_are_not_significant_and_no_pairs_give_one() {
        assert_relative_eq!(signed_rank_p(&[0.3, 0.2, 0.5, 0.1, 0.9]), 2.0 / 32.0, epsilon = 1e-15);
        assert_eq!(signed_rank_p(&[0.0, 0.0]), 1.0);
    }

    #[test]
    fn holm_multiplies_the_smallest_by_the_number_of_tests_and_is_monotonic() {
        // 3 x 0.01; 2 x 0.02 = 0.04; 1 x 0.03 is raised to 0.04.
        let corrected = holm(&[0.02, 0.01, 0.03]);
        for (found, expected) in corrected.iter().zip([0.04, 0.03, 0.04]) {
            assert_relative_eq!(*found, expected, epsilon = 1e-15);
        }
    }
}
