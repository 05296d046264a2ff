//! Sine and cosine by the turn, for sums of many sinusoids.
//!
//! Polynomials instead of the system's library: a loop over them is vectorised, and the bits are the same on every machine.

/// Sine and cosine of `turns` whole turns, to 2e-16 for a fraction of a turn; an argument of `n` turns has the rounding of
/// `n`.
#[inline]
pub(super) fn sin_cos_turns(turns: f64) -> (f64, f64) {
    // Adding and taking off 1.5 * 2^52 rounds to the nearest integer, without a branch.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let quarters = (turns * 4.0 + ROUND) - ROUND;
    let angle = (turns - quarters * 0.25) * std::f64::consts::TAU;
    let (sin, cos) = eighth(angle);
    // The quarter that the angle lies in, 0..4, from the integer's own arithmetic.
    let quarter = quarters - 4.0 * ((quarters * 0.25 - 0.375 + ROUND) - ROUND);
    let swapped = quarter == 1.0 || quarter == 3.0;
    let (a, b) = if swapped { (cos, sin) } else { (sin, cos) };
    (if quarter >= 2.0 { -a } else { a }, if quarter == 1.0 || quarter == 2.0 { -b } else { b })
}

/// Sine and cosine within an eighth of a turn, by Taylor's polynomials: the first term left out is below 1e-17.
#[inline]
fn eighth(y: f64) -> (f64, f64) {
    let y2 = y * y;
    let mut sin = 1.0;
    let mut cos = 1.0;
    for k in (1..=8).rev() {
        let n = f64::from(2 * k);
        sin = 1.0 - sin * y2 * (1.0 / (n * (n + 1.0)));
        cos = 1.0 - cos * y2 * (1.0 / (n * (n - 1.0)));
    }
    (sin * y, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_library_agrees() {
        for k in -100_000..100_000 {
            let turns = f64::from(k) * 5e-6;
            let (sin, cos) = sin_cos_turns(turns);
            let (expected_sin, expected_cos) = (turns * TAU).sin_cos();
            let error = (sin - expected_sin).abs() + (cos - expected_cos).abs();
            assert!(error < 1e-15, "differs by {error} at {turns} turns");
        }
    }

    #[test]
    fn quarters_and_thousands_of_turns_are_exact() {
        for (turns, expected) in
            [(0.0, (0.0, 1.0)), (0.25, (1.0, 0.0)), (0.5, (0.0, -1.0)), (-0.25, (-1.0, 0.0)), (12_345.75, (-1.0, 0.0))]
        {
            let (sin, cos) = sin_cos_turns(turns);
            assert_eq!((sin + 0.0, cos + 0.0), expected, "{turns} turns");
        }
    }
}
