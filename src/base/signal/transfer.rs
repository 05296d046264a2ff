//! Estimation of the transfer function from a measured input to a measured output.

use super::SignalError;
use super::segments::{Segments, Transformer, check_finite};
use nalgebra::Complex;

/// The transfer function at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferPoint {
    /// Frequency, Hz.
    pub freq_hz: f64,
    /// Output over input: modulus is gain, argument is phase. NaN if the input has no power.
    pub response: Complex<f64>,
    /// Coherence, 0..1: fraction of the output's power that the input explains. The gain is unreliable where it is low.
    /// Zero if input or output has no power.
    pub coherence: f64,
    /// Standard error of the gain, in the gain's unit.
    pub gain_sigma: f64,
    /// Power spectral density of the input, unit^2/Hz.
    pub input_density: f64,
}

impl TransferPoint {
    /// The gain: the modulus of the response.
    pub fn gain(&self) -> f64 {
        self.response.norm()
    }
}

/// Estimates the transfer function from `input` to `output`, both sampled at `rate_hz`, by H1.
///
/// The estimate `S_xy / S_xx` is unbiased by noise on the output; the coherence is `|S_xy|^2 / (S_xx S_yy)`.
///
/// The relative standard error of the gain is `sqrt((1 - c) / (2 n c))` with coherence `c` and `n` averages (Bendat &
/// Piersol, Random Data, section 9.2). With a single segment the coherence is always 1, so average several.
///
/// # Errors
/// When lengths differ, the record is shorter than a segment, the segmentation is invalid, or a sample is not finite.
pub fn transfer_function(
    input: &[f64],
    output: &[f64],
    rate_hz: f64,
    segments: Segments,
) -> Result<Vec<TransferPoint>, SignalError> {
    if input.len() != output.len() {
        return Err(SignalError::Mismatch { input: input.len(), output: output.len() });
    }
    let count = segments.count(input.len())?;
    check_finite(input)?;
    check_finite(output)?;
    let mut transformer = Transformer::new(segments);
    let (mut x, mut y) = (transformer.output_buffer(), transformer.output_buffer());
    let mut sums = vec![Sums::default(); x.len()];
    for index in 0..count {
        transformer.transform(input, index, &mut x);
        transformer.transform(output, index, &mut y);
        for (sums, (x, y)) in sums.iter_mut().zip(x.iter().zip(&y)) {
            sums.input += x.norm_sqr();
            sums.output += y.norm_sqr();
            sums.cross += x.conj() * y;
        }
    }
    let averages = segments.equivalent_averages(count);
    let scaled = segments.frequencies(rate_hz).zip(&sums).enumerate();
    let point = |(bin, (freq_hz, sums)): (usize, (f64, &Sums))| {
        let input_density = sums.input * transformer.density_scale(bin, rate_hz) / count as f64;
        sums.point(freq_hz, averages, input_density)
    };
    Ok(scaled.map(point).collect())
}

/// Sums of the input, output and cross spectra at one frequency.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    input: f64,
    output: f64,
    cross: Complex<f64>,
}

impl Sums {
    fn point(&self, freq_hz: f64, averages: f64, input_density: f64) -> TransferPoint {
        let response = self.cross / self.input;
        let both = self.input * self.output;
        let coherence = if both > 0.0 { (self.cross.norm_sqr() / both).min(1.0) } else { 0.0 };
        let gain_sigma = response.norm() * ((1.0 - coherence) / (2.0 * averages * coherence)).sqrt();
        TransferPoint { freq_hz, response, coherence, gain_sigma, input_density }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;
    use approx::assert_relative_eq;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    fn white(name: &str, count: usize) -> Vec<f64> {
        StandardNormal.sample_iter(Seed(2).stream(name)).take(count).collect()
    }

    #[test]
    fn a_filter_with_output_noise_is_recovered_within_the_standard_error() {
        // y[k] = x[k] + 0.5 x[k-1] + 0.3 e: H = 1 + 0.5 exp(-i w), and the coherence is |H|^2 / (|H|^2 + 0.09).
        let (x, e) = (white("x", 100_000), white("e", 100_000));
        let y: Vec<f64> = (0..x.len()).map(|k| x[k] + 0.5 * if k > 0 { x[k - 1] } else { 0.0 } + 0.3 * e[k]).collect();
        let points = transfer_function(&x, &y, 10.0, Segments::hann(256)).unwrap();
        let inner = &points[2..points.len() - 2];
        let mut squares = 0.0;
        for point in inner {
            let exact = Complex::new(1.0, 0.0) + Complex::from_polar(0.5, -TAU * point.freq_hz / 10.0);
            let error = (point.gain() - exact.norm()) / point.gain_sigma;
            assert!(error.abs() < 4.5, "{error} sigma at {} Hz", point.freq_hz);
            squares += error * error / inner.len() as f64;
            let coherence = exact.norm_sqr() / (exact.norm_sqr() + 0.09);
            assert_relative_eq!(point.coherence, coherence, epsilon = 0.03);
            assert_relative_eq!(point.response.arg(), exact.arg(), epsilon = 0.1);
            assert_relative_eq!(point.input_density, 0.2, max_relative = 0.25);
        }
        // The normalised errors have a mean square of 1, determined here to some 15 %.
        assert!((0.6..1.5).contains(&squares), "mean square error of {squares} sigma^2");
    }

    #[test]
    fn whole_periods_of_a_multisine_do_not_leak() {
        // A gain of 2 and a delay of 3 samples, over periods of 100 samples with lines at bins 3, 7 and 20.
        let line = |k: i32, bin: f64| (TAU * bin * f64::from(k) / 100.0 + bin).sin();
        let x: Vec<f64> = (0..500).map(|k| line(k, 3.0) + line(k, 7.0) + line(k, 20.0)).collect();
        let y: Vec<f64> = (0..500).map(|k| 2.0 * (line(k - 3, 3.0) + line(k - 3, 7.0) + line(k - 3, 20.0))).collect();
        let points = transfer_function(&x, &y, 100.0, Segments::periods(100)).unwrap();
        for bin in [3, 7, 20] {
            let exact = Complex::from_polar(2.0, -TAU * 0.03 * bin as f64);
            assert_relative_eq!((points[bin].response - exact).norm(), 0.0, epsilon = 1e-10);
            assert_relative_eq!(points[bin].coherence, 1.0, epsilon = 1e-12);
        }
        assert!(points[5].input_density < 1e-20);
    }

    #[test]
    fn zero_input_has_no_gain_and_no_coherence() {
        let points = transfer_function(&[0.0; 64], &[0.0; 64], 1.0, Segments::hann(16)).unwrap();
        assert!(points.iter().all(|point| point.gain().is_nan() && point.coherence == 0.0));
        let error = transfer_function(&[0.0; 64], &[0.0; 63], 1.0, Segments::hann(16)).unwrap_err();
        assert_eq!(error, SignalError::Mismatch { input: 64, output: 63 });
    }
}
