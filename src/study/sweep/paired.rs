//! Whether paired figures differ: Wilcoxon's signed-rank test, and Holm's correction for many of them.
//!
//! F. Wilcoxon, Individual comparisons by ranking methods, Biometrics Bulletin 1(6), 1945. S. Holm, A simple
//! sequentially rejective multiple test procedure, Scandinavian Journal of Statistics 6(2), 1979.

/// Most pairs whose sums of ranks are counted; of more they are normal to three digits.
const COUNTED: usize = 200;

/// The probability that `differences`, were they as likely positive as negative, lie at least as far to one side: exact
/// up to 200 of them, two-sided.
///
/// Differences of zero say nothing and are left out; equal ones share their mean rank. Infinite ones are the largest. 1
/// when nothing is left.
pub fn signed_rank_p(differences: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = differences.iter().copied().filter(|x| *x != 0.0 && !x.is_nan()).collect();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    // Twice the rank, so that shared ranks are whole.
    let mut ranks = Vec::with_capacity(sorted.len());
    for equal in sorted.chunk_by(|a, b| a.abs() == b.abs()) {
        let first = ranks.len() + 1;
        ranks.extend(std::iter::repeat_n(2 * first + equal.len() - 1, equal.len()));
    }
    let whole: usize = ranks.iter().sum();
    let positive: usize = sorted.iter().zip(&ranks).filter(|(x, _)| **x > 0.0).map(|(_, rank)| rank).sum();
    let lesser = positive.min(whole - positive);
    if ranks.len() > COUNTED {
        // Each sign is tossed: the sum's mean is half of the whole, its variance a quarter of the squares' sum.
        let squares: f64 = ranks.iter().map(|rank| (*rank as f64).powi(2)).sum();
        let beyond = (0.5 * whole as f64 - lesser as f64) / (0.25 * squares).sqrt();
        return libm::erfc(beyond / std::f64::consts::SQRT_2);
    }
    // How likely each sum of ranks is when every sign is tossed.
    let mut likely = vec![0.0; whole + 1];
    likely[0] = 1.0;
    for rank in &ranks {
        for sum in (0..=whole).rev() {
            let with = if sum >= *rank { likely[sum - rank] } else { 0.0 };
            likely[sum] = 0.5 * (likely[sum] + with);
        }
    }
    let below: f64 = likely[..=lesser].iter().sum();
    (2.0 * below).min(1.0)
}

/// `levels` of several tests together: the level at which each would still stand if all were to hold at once.
pub fn holm(levels: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_by(|a, b| levels[*a].total_cmp(&levels[*b]));
    let mut corrected = vec![1.0; levels.len()];
    let mut least = 0.0_f64;
    for (before, index) in order.into_iter().enumerate() {
        least = least.max(((levels.len() - before) as f64 * levels[index]).min(1.0));
        corrected[index] = least;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// By the definition: all signs, each as likely.
    fn by_counting(ranks: &[f64], positive: f64) -> f64 {
        let whole: f64 = ranks.iter().sum();
        let lesser = positive.min(whole - positive);
        let sum = |signs: u32| -> f64 {
            let taken = ranks.iter().enumerate().filter(|(k, _)| signs & (1 << k) != 0);
            taken.map(|(_, rank)| rank).sum()
        };
        let all = 1_u32 << ranks.len();
        let at_most = (0..all).filter(|signs| sum(*signs) <= lesser + 1e-9).count();
        (2.0 * at_most as f64 / f64::from(all)).min(1.0)
    }

    #[test]
    fn the_level_is_that_of_counting_all_signs() {
        // Ranks 1 to 10, of which 1, 3 and 4 are negative: their sum is 8.
        let differences = [-0.1, 0.2, -0.3, -0.4, 0.5, 0.6, 0.7, 0.8, 0.9, f64::INFINITY];
        let ranks: Vec<f64> = (1..=10).map(f64::from).collect();
        assert_relative_eq!(signed_rank_p(&differences), by_counting(&ranks, 8.0), epsilon = 1e-12);
        // 8 is the critical value of 10 pairs at the two-sided level of 0.05 in Wilcoxon's tables; 9 is beyond it.
        assert!(signed_rank_p(&differences) < 0.05);
        let beyond = [-0.1, 0.2, -0.3, 0.4, -0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
        assert!(signed_rank_p(&beyond) > 0.05);
        // Two equal ones share the rank 1.5, and a zero says nothing.
        let tied = [0.1, -0.1, 0.3, 0.4, 0.0];
        assert_relative_eq!(signed_rank_p(&tied), by_counting(&[1.5, 1.5, 3.0, 4.0], 1.5), epsilon = 1e-12);
    }

    #[test]
    fn many_pairs_go_on_where_counting_ends() {
        // So many tenths of the signs negative, evenly among the ranks.
        let pairs = |count: i32, tenths: i32| -> Vec<f64> {
            (1..=count).map(|k| if k % 10 < tenths { -f64::from(k) } else { f64::from(k) }).collect()
        };
        // The normal law of Wilcoxon's sum: mean n (n + 1) / 4, variance n (n + 1) (2 n + 1) / 24.
        let by_normal_law = |differences: &[f64]| {
            let n = differences.len() as f64;
            let negative: f64 = differences.iter().filter(|x| **x < 0.0).map(|x| -x).sum();
            let sigma = (n * (n + 1.0) * (2.0 * n + 1.0) / 24.0).sqrt();
            libm::erfc((n * (n + 1.0) / 4.0 - negative) / sigma / std::f64::consts::SQRT_2)
        };
        let (counted, beyond) = (pairs(200, 4), pairs(201, 4));
        assert_relative_eq!(signed_rank_p(&counted).ln(), by_normal_law(&counted).ln(), max_relative = 0.01);
        assert_relative_eq!(signed_rank_p(&beyond), by_normal_law(&beyond), max_relative = 1e-9);
        assert!(signed_rank_p(&pairs(2000, 3)) < 1e-20);
    }

    #[test]
    fn few_pairs_prove_nothing_and_none_is_one() {
        assert_relative_eq!(signed_rank_p(&[0.3, 0.2, 0.5, 0.1, 0.9]), 2.0 / 32.0, epsilon = 1e-15);
        assert_eq!(signed_rank_p(&[0.0, 0.0]), 1.0);
    }

    #[test]
    fn holm_multiplies_the_least_by_all_and_never_falls() {
        // 3 x 0.01; 2 x 0.02 = 0.04; 1 x 0.03 would fall below it.
        let corrected = holm(&[0.02, 0.01, 0.03]);
        for (found, expected) in corrected.iter().zip([0.04, 0.03, 0.04]) {
            assert_relative_eq!(*found, expected, epsilon = 1e-15);
        }
    }
}
