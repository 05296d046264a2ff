//! Sine and cosine of an angle in turns, for sums of many sinusoids.
//!
//! Polynomials replace the system's library: the compiler vectorises a loop over them, and the result has the same bits
//! on every machine.

/// Sine and cosine of `turns` turns.
///
/// The error is 1e-15 within one turn; for a larger argument the rounding of `turns` adds to it. Valid below 2^49
/// turns.
#[inline]
pub(super) fn sin_cos_turns(turns: f64) -> (f64, f64) {
    // Adding 1.5 * 2^52 rounds to the nearest integer and leaves it in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let rounded = turns * 4.0 + ROUND;
    let quarter = rounded.to_bits();
    let (sin, cos) = eighth((turns - (rounded - ROUND) * 0.25) * std::f64::consts::TAU);

    // Odd quarters swap sine and cosine; sine is negative in quarters 2 and 3, cosine in 1 and 2. No branches.
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swapped = (sin ^ cos) & 0_u64.wrapping_sub(quarter & 1);
    let sin_sign = (quarter & 2) << 62;
    let cos_sign = (quarter.wrapping_add(1) & 2) << 62;
    (f64::from_bits(sin ^ swapped ^ sin_sign), f64::from_bits(cos ^ swapped ^ cos_sign))
}

/// Sine and cosine within an eighth of a turn by Taylor polynomials; the first omitted term is below 1e-16.
#[inline]
fn eighth(y: f64) -> (f64, f64) {
    const SIN: [f64; 8] = [
        1.0,
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5_040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
    ];
    const COS: [f64; 9] = [
        1.0,
        -1.0 / 2.0,
        1.0 / 24.0,
        -1.0 / 720.0,
        1.0 / 40_320.0,
        -1.0 / 3_628_800.0,
        1.0 / 479_001_600.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 20_922_789_888_000.0,
    ];
    let y2 = y * y;
    let s = SIN[0]
        + y2 * (SIN[1] + y2 * (SIN[2] + y2 * (SIN[3] + y2 * (SIN[4] + y2 * (SIN[5] + y2 * (SIN[6] + y2 * SIN[7]))))));
    let c = COS[4] + y2 * (COS[5] + y2 * (COS[6] + y2 * (COS[7] + y2 * COS[8])));
    let c = COS[0] + y2 * (COS[1] + y2 * (COS[2] + y2 * (COS[3] + y2 * c)));
    (s * y, c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sine_and_cosine_agree_with_the_standard_library() {
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
