//! Power spectral density.

use super::segments::{Segments, Transformer, check_finite};
use super::{SignalError, chi_squared_quantile};

/// A one-sided power spectral density.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Frequencies, Hz, from 0 to half the sampling rate.
    pub freq_hz: Vec<f64>,
    /// One-sided power spectral density, unit^2/Hz; the sum times the frequency step is the variance.
    pub density: Vec<f64>,
    /// Equivalent number of independent averages; each density is chi-squared with twice as many degrees of freedom.
    pub averages: f64,
}

impl Spectrum {
    /// The power between two frequencies: sum of the densities times the frequency step, unit^2.
    pub fn power_between(&self, low_hz: f64, high_hz: f64) -> f64 {
        let step_hz = self.freq_hz.get(1).copied().unwrap_or_default();
        let within = self.freq_hz.iter().zip(&self.density).filter(|(f, _)| (low_hz..high_hz).contains(f));
        within.map(|(_, density)| density * step_hz).sum()
    }

    /// The factors from a density to the limits of the true one at the given `confidence`.
    pub fn confidence_interval(&self, confidence: f64) -> (f64, f64) {
        let degrees = 2.0 * self.averages;
        let tail = (1.0 - confidence) / 2.0;
        (degrees / chi_squared_quantile(1.0 - tail, degrees), degrees / chi_squared_quantile(tail, degrees))
    }
}

/// Estimates the power spectral density of `samples` at `rate_hz` by Welch's method.
///
/// The mean of each segment is removed.
///
/// # Errors
/// When the record is shorter than a segment, the segmentation is invalid, or a sample is not finite.
pub fn power_density(samples: &[f64], rate_hz: f64, segments: Segments) -> Result<Spectrum, SignalError> {
    let count = segments.count(samples.len())?;
    check_finite(samples)?;
    let mut transformer = Transformer::new(segments);
    let mut bins = transformer.output_buffer();
    let mut density = vec![0.0; bins.len()];
    for index in 0..count {
        transformer.transform(samples, index, &mut bins);
        for (sum, bin) in density.iter_mut().zip(&bins) {
            *sum += bin.norm_sqr() / count as f64;
        }
    }
    for (bin, density) in density.iter_mut().enumerate() {
        *density *= transformer.density_scale(bin, rate_hz);
    }
    let freq_hz = segments.frequencies(rate_hz).collect();
    Ok(Spectrum { freq_hz, density, averages: segments.equivalent_averages(count) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;
    use approx::assert_relative_eq;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    fn white(count: usize) -> Vec<f64> {
        StandardNormal.sample_iter(Seed(1).stream("white")).take(count).collect()
    }

    /// Mean ratio of density to expectation, and fraction of bins in the 95 % interval, without the ends.
    fn agreement(spectrum: &Spectrum, expected: impl Fn(f64) -> f64) -> (f64, f64) {
        let inner = 2..spectrum.density.len() - 2;
        let ratios: Vec<f64> = inner.map(|k| spectrum.density[k] / expected(spectrum.freq_hz[k])).collect();
        let (low, high) = spectrum.confidence_interval(0.95);
        let within = ratios.iter().filter(|r| (low..high).contains(&(1.0 / **r))).count();
        (ratios.iter().sum::<f64>() / ratios.len() as f64, within as f64 / ratios.len() as f64)
    }

    #[test]
    fn the_power_of_a_sine_is_half_the_squared_amplitude() {
        // Between two bins: a Hann window spreads the line over four bins; the sum is the power.
        let sine: Vec<f64> = (0..40_000).map(|k| 3.0 * (TAU * 12.345 * f64::from(k) / 200.0).sin()).collect();
        let spectrum = power_density(&sine, 200.0, Segments::hann(1000)).unwrap();
        assert_relative_eq!(spectrum.power_between(11.0, 14.0), 4.5, max_relative = 1e-3);
        assert_relative_eq!(spectrum.power_between(0.0, 101.0), 4.5, max_relative = 1e-3);
    }

    #[test]
    fn the_spectrum_of_white_noise_is_flat() {
        // Unit variance over a bandwidth of rate / 2: density 2 / rate.
        let spectrum = power_density(&white(200_000), 50.0, Segments::hann(512)).unwrap();
        let (mean, within) = agreement(&spectrum, |_| 2.0 / 50.0);
        assert_relative_eq!(mean, 1.0, epsilon = 0.01);
        assert!((0.90..0.99).contains(&within), "{within} of the bins in the 95 % interval");
    }

    #[test]
    fn the_spectrum_of_an_autoregression_agrees_with_the_closed_form() {
        // x[k] = a x[k-1] + e[k]: density 2 / rate / |1 - a exp(-i w)|^2 = 2 / rate / (1 - 2 a cos w + a^2).
        let (a, rate) = (0.7, 100.0);
        let mut last = 0.0;
        let step = |e: f64| {
            last = a * last + e;
            last
        };
        let samples: Vec<f64> = white(400_000).into_iter().map(step).collect();
        let spectrum = power_density(&samples, rate, Segments::hann(512)).unwrap();
        let expected = |f: f64| 2.0 / rate / (1.0 - 2.0 * a * (TAU * f / rate).cos() + a * a);
        let (mean, within) = agreement(&spectrum, expected);
        assert_relative_eq!(mean, 1.0, epsilon = 0.01);
        assert!((0.90..0.99).contains(&within), "{within} of the bins in the 95 % interval");
    }

    #[test]
    fn invalid_signals_are_rejected() {
        let error = power_density(&[0.0, f64::NAN, 0.0, 1.0], 1.0, Segments::hann(4)).unwrap_err();
        assert_eq!(error, SignalError::NotFinite { index: 1 });
        assert!(power_density(&[], 1.0, Segments::hann(4)).is_err());
    }
}
