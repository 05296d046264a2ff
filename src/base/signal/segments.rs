//! Overlapping windowed segments of a record and the Fourier transforms (P. D. Welch, 1967).

use super::SignalError;
use nalgebra::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::f64::consts::TAU;
use std::sync::Arc;

/// The weights over a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Window {
    /// Constant weights, for signals that are periodic in the segment and therefore do not leak.
    Rectangular,
    /// Hann window (raised cosine, periodic), for all other signals.
    Hann,
}

impl Window {
    /// The weights of a segment of `length` samples.
    pub fn weights(self, length: usize) -> Vec<f64> {
        let weight = |k: usize| match self {
            Window::Rectangular => 1.0,
            Window::Hann => 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos(),
        };
        (0..length).map(weight).collect()
    }
}

/// Segmentation of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Segments {
    /// Number of samples in a segment.
    pub length: usize,
    /// Number of samples shared with the next segment.
    pub overlap: usize,
    /// The weights over a segment.
    pub window: Window,
}

impl Segments {
    /// Hann windows with 50 % overlap.
    pub fn hann(length: usize) -> Self {
        Self { length, overlap: length / 2, window: Window::Hann }
    }

    /// Rectangular windows without overlap, for complete periods of a periodic signal.
    pub fn periods(length: usize) -> Self {
        Self { length, overlap: 0, window: Window::Rectangular }
    }

    /// Number of segments in a record of `samples` samples.
    ///
    /// # Errors
    /// When the record is shorter than a segment, or length or overlap is invalid.
    pub fn count(&self, samples: usize) -> Result<usize, SignalError> {
        let Self { length, overlap, .. } = *self;
        if length < 2 || overlap >= length {
            return Err(SignalError::Segments { length, overlap });
        }
        if samples < length {
            return Err(SignalError::TooShort { samples, segment: length });
        }
        Ok((samples - length) / (length - overlap) + 1)
    }

    /// The equivalent number of independent averages of `count` overlapping segments of white noise.
    ///
    /// `count / (1 + 2 sum_j (1 - j / count) rho_j)`, where `rho_j` is the squared correlation of the window with
    /// itself shifted by `j` hops (Welch 1967, eq. 12).
    pub fn equivalent_averages(&self, count: usize) -> f64 {
        let weights = self.window.weights(self.length);
        let hop = self.length - self.overlap;
        let power: f64 = weights.iter().map(|w| w * w).sum();
        let correlation = |j: usize| {
            let shared = weights.iter().zip(weights.iter().skip(j * hop)).map(|(a, b)| a * b).sum::<f64>();
            (shared / power).powi(2)
        };
        let reach = (self.length - 1) / hop;
        let repeated: f64 = (1..=reach.min(count - 1)).map(|j| (1.0 - j as f64 / count as f64) * correlation(j)).sum();
        count as f64 / (1.0 + 2.0 * repeated)
    }

    /// The frequencies of the transform of a segment, Hz.
    pub(super) fn frequencies(&self, rate_hz: f64) -> impl Iterator<Item = f64> {
        let step_hz = rate_hz / self.length as f64;
        (0..=self.length / 2).map(move |k| k as f64 * step_hz)
    }
}

/// Transforms segments one by one with preallocated buffers.
pub(super) struct Transformer {
    segments: Segments,
    weights: Vec<f64>,
    /// Sum of the squared weights.
    power: f64,
    fft: Arc<dyn RealToComplex<f64>>,
    windowed: Vec<f64>,
    scratch: Vec<Complex<f64>>,
}

impl Transformer {
    pub fn new(segments: Segments) -> Self {
        let fft = RealFftPlanner::new().plan_fft_forward(segments.length);
        let (windowed, scratch) = (fft.make_input_vec(), fft.make_scratch_vec());
        let weights = segments.window.weights(segments.length);
        let power = weights.iter().map(|w| w * w).sum();
        Self { segments, weights, power, fft, windowed, scratch }
    }

    /// Allocates the output buffer of one transform.
    pub fn output_buffer(&self) -> Vec<Complex<f64>> {
        self.fft.make_output_vec()
    }

    /// Writes the transform of segment `index` of `samples`, mean removed, to `output`.
    pub fn transform(&mut self, samples: &[f64], index: usize, output: &mut [Complex<f64>]) {
        let start = index * (self.segments.length - self.segments.overlap);
        let segment = &samples[start..start + self.segments.length];
        let mean = segment.iter().sum::<f64>() / segment.len() as f64;
        for ((windowed, sample), weight) in self.windowed.iter_mut().zip(segment).zip(&self.weights) {
            *windowed = (sample - mean) * weight;
        }
        self.fft
            .process_with_scratch(&mut self.windowed, output, &mut self.scratch)
            .expect("all buffers have the lengths of the plan, and a wrong length is the only error");
    }

    /// The factor from the squared modulus of bin `bin` to one-sided power spectral density, unit^2/Hz.
    pub fn density_scale(&self, bin: usize, rate_hz: f64) -> f64 {
        let has_no_mirror = bin == 0 || 2 * bin == self.segments.length;
        if has_no_mirror { 1.0 / (self.power * rate_hz) } else { 2.0 / (self.power * rate_hz) }
    }
}

/// Returns an error if a sample is NaN or infinite.
pub(super) fn check_finite(samples: &[f64]) -> Result<(), SignalError> {
    match samples.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(SignalError::NotFinite { index }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn half_overlapping_hann_windows_are_nearly_independent() {
        // Welch 1967: Hann windows at 50 % overlap correlate by 1/6, squared 1/36, so each is worth 1 / (1 + 2/36) =
        // 0.947 averages.
        let averages = Segments::hann(1024).equivalent_averages(10_000);
        assert_relative_eq!(averages / 10_000.0, 36.0 / 38.0, epsilon = 1e-5);
        assert_relative_eq!(Segments::periods(100).equivalent_averages(7), 7.0);
    }

    #[test]
    fn invalid_segments_are_rejected() {
        assert_eq!(Segments::hann(64).count(64), Ok(1));
        assert_eq!(Segments::hann(64).count(128), Ok(3));
        assert_eq!(Segments::hann(64).count(63), Err(SignalError::TooShort { samples: 63, segment: 64 }));
        let full_overlap = Segments { length: 8, overlap: 8, window: Window::Hann };
        assert_eq!(full_overlap.count(100), Err(SignalError::Segments { length: 8, overlap: 8 }));
        assert_eq!(Segments::periods(0).count(100), Err(SignalError::Segments { length: 0, overlap: 0 }));
    }
}
