//! Quantiles of the chi-squared distribution, for confidence intervals of a variance.
//!
//! `statrs` 0.18 does not serve: its quantiles of 1 degree and less panic or are wrong, and those of 1e5 and more, which Allan
//! deviations of long records need, differ by 5e-4 and more.

/// The quantile of the chi-squared distribution with `degrees` degrees of freedom at `probability`.
///
/// `degrees` need not be an integer. Solves `P(degrees / 2, x / 2) = probability` by bisection to a relative accuracy
/// of 1e-12. Returns NaN if `probability` is outside 0..1 or `degrees` is not positive.
pub fn chi_squared_quantile(probability: f64, degrees: f64) -> f64 {
    if !((0.0..1.0).contains(&probability) && degrees > 0.0 && degrees.is_finite()) {
        return f64::NAN;
    }
    let below = |x: f64| lower_gamma(degrees / 2.0, x / 2.0);
    let (mut low, mut high) = (0.0, degrees.max(1.0));
    while below(high) < probability {
        (low, high) = (high, 2.0 * high);
    }
    // Bisect down to the resolution of f64.
    while high - low > 1e-13 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if below(middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The regularised lower incomplete gamma function `P(a, x)`.
///
/// Series below `a + 1`, otherwise the continued fraction of the complement (Abramowitz & Stegun 6.5.29 and 6.5.31).
fn lower_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 { front * series(a, x) } else { 1.0 - front * fraction(a, x) }
}

fn series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
    while term > sum * 1e-17 {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    sum
}

/// Lentz's method for the continued fraction `1 / (x + 1 - a - 1 (1 - a) / (x + 3 - a - ...))`.
fn fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut value = d;
    let mut n = 1.0;
    loop {
        let numerator = -n * (n - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        let change = c * d;
        value *= change;
        if (change - 1.0).abs() < 1e-15 || n > 1e5 {
            return value;
        }
        n += 1.0;
    }
}

/// Logarithm of the gamma function for `a > 0`.
///
/// Stirling's series at `a + 10`, then recurrence (A&S 6.1.41, 6.1.15).
fn ln_gamma(a: f64) -> f64 {
    let steps: f64 = (0..10).map(|k| (a + f64::from(k)).ln()).sum();
    let z = a + 10.0;
    let z2 = z * z;
    let stirling = (1.0 / 12.0 - (1.0 / 360.0 - (1.0 / 1260.0 - 1.0 / (1680.0 * z2)) / z2) / z2) / z;
    (z - 0.5) * z.ln() - z + 0.5 * std::f64::consts::TAU.ln() + stirling - steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn quantiles_match_the_published_tables() {
        // Abramowitz & Stegun, table 26.8, to the figures printed there.
        assert_relative_eq!(chi_squared_quantile(0.95, 1.0), 3.841_46, epsilon = 1e-5);
        assert_relative_eq!(chi_squared_quantile(0.975, 10.0), 20.4831, epsilon = 1e-4);
        assert_relative_eq!(chi_squared_quantile(0.025, 10.0), 3.246_97, epsilon = 1e-5);
        assert_relative_eq!(chi_squared_quantile(0.99, 100.0), 135.807, epsilon = 1e-3);
        assert_relative_eq!(chi_squared_quantile(0.005, 1.0), 3.927_04e-5, epsilon = 1e-9);
    }

    #[test]
    fn two_degrees_of_freedom_are_an_exponential() {
        // With 2 degrees of freedom the distribution function is 1 - exp(-x / 2).
        for p in [0.01, 0.3, 0.9, 0.999] {
            assert_relative_eq!(chi_squared_quantile(p, 2.0), -2.0 * (1.0_f64 - p).ln(), max_relative = 1e-11);
        }
    }

    #[test]
    fn many_degrees_approach_the_normal_distribution() {
        // Wilson-Hilferty: x ~ k (1 - 2/(9k) + z sqrt(2/(9k)))^3 with z(0.975) = 1.959964, good to 1e-6 at k = 1e5.
        let k = 1e5_f64;
        let expected = k * (1.0 - 2.0 / (9.0 * k) + 1.959_964 * (2.0 / (9.0 * k)).sqrt()).powi(3);
        assert_relative_eq!(chi_squared_quantile(0.975, k), expected, max_relative = 1e-6);
    }

    #[test]
    fn invalid_arguments_give_nan() {
        assert!(chi_squared_quantile(1.0, 3.0).is_nan());
        assert!(chi_squared_quantile(f64::NAN, 3.0).is_nan());
        assert!(chi_squared_quantile(0.5, 0.0).is_nan());
    }
}
