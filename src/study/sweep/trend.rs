//! Spearman's rank correlation of a figure with a setting.
//!
//! C. Spearman, The proof and measurement of association between two things, American Journal of Psychology 15(1),
//! 1904.

/// Minimum number of pairs for which the normal approximation of the p-value is accurate.
const MIN_PAIRS: usize = 10;

/// Rank correlation of `pairs`, from -1 to 1, and its two-sided p-value.
///
/// The p-value is that of a normal distribution with variance 1 / (n - 1), accurate from ten pairs on. `None` for
/// fewer pairs, or if one of the two variables is constant.
pub(super) fn rank_correlation(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    if pairs.len() < MIN_PAIRS {
        return None;
    }
    let x = ranks(&pairs.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let y = ranks(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let mean = 0.5 * (pairs.len() as f64 + 1.0);
    let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum() };
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    if scale == 0.0 {
        return None;
    }
    let correlation = product(&x, &y) / scale;
    let z = correlation.abs() * (pairs.len() as f64 - 1.0).sqrt();
    Some((correlation, libm::erfc(z / std::f64::consts::SQRT_2)))
}

/// Ranks from 1; ties get their mean rank.
fn ranks(numbers: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    let mut ranks = vec![0.0; numbers.len()];
    let mut first = 1;
    for equal in order.chunk_by(|a, b| numbers[*a] == numbers[*b]) {
        let rank = first as f64 + 0.5 * (equal.len() as f64 - 1.0);
        equal.iter().for_each(|index| ranks[*index] = rank);
        first += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_correlation_is_one_for_rising_and_minus_one_for_falling_pairs() {
        let rising: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k), f64::from(k).exp())).collect();
        assert_relative_eq!(rank_correlation(&rising).unwrap().0, 1.0, epsilon = 1e-12);
        let falling: Vec<(f64, f64)> = rising.iter().map(|(x, y)| (*x, -y)).collect();
        let (correlation, p) = rank_correlation(&falling).unwrap();
        assert_relative_eq!(correlation, -1.0, epsilon = 1e-12);
        assert!(p < 1e-4);
        assert!(rank_correlation(&rising[..9]).is_none());
        assert!(rank_correlation(&[(1.0, 2.0); 12]).is_none());
    }

    #[test]
    fn without_ties_the_correlation_follows_from_squared_rank_differences() {
        // 1 - 6 sum d^2 / (n (n^2 - 1)) with rank differences d; the ranks are k and 7 k mod 11.
        let pairs: Vec<(f64, f64)> = (1..=10).map(|k| (f64::from(k), f64::from(7 * k % 11))).collect();
        let squares: f64 = pairs.iter().map(|(x, y)| (x - y).powi(2)).sum();
        assert_relative_eq!(rank_correlation(&pairs).unwrap().0, 1.0 - 6.0 * squares / 990.0, epsilon = 1e-12);
    }

    #[test]
    fn uncorrelated_pairs_are_significant_at_the_nominal_rate() {
        // 5 % of uncorrelated samples have p < 0.05.
        use rand::RngExt;
        let mut stream = zsim_base::random::Seed(1).stream("test");
        let mut draw = || -> Vec<(f64, f64)> { (0..30).map(|_| (stream.random(), stream.random())).collect() };
        let significant = (0..4000).filter(|_| rank_correlation(&draw()).unwrap().1 < 0.05).count();
        assert!((140..260).contains(&significant), "{significant} of 4000");
    }
}
