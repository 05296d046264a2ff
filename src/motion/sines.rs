//! Sums of sinusoids: random processes of a given spectrum, and periodic signals.

use super::jet::Jet;
use super::phasor::sin_cos_turns;
use nalgebra::Complex;
use rand::RngExt;
use std::f64::consts::TAU;
use zsim_base::random::Stream;

/// One frequency of a sum with `N` outputs.
#[derive(Debug, Clone)]
pub(super) struct SpectralLine<const N: usize> {
    /// Cycles per unit of the argument: Hz, or cycles per metre.
    pub cycles: f64,
    /// Complex amplitude of each output, which is the real part of `amplitude exp(i 2 pi cycles u)`.
    pub amplitudes: [Complex<f64>; N],
}

/// Spectral lines evaluated together, so that the compiler vectorises over them.
const LANES: usize = 8;

/// `N` sums of sinusoids that share their frequencies.
#[derive(Debug, Clone)]
pub(super) struct SineSum<const N: usize> {
    groups: Vec<Group<N>>,
}

/// A group of lines that are evaluated together; the last group is padded with zero amplitudes.
#[derive(Debug, Clone)]
struct Group<const N: usize> {
    cycles: [f64; LANES],
    re: [[f64; LANES]; N],
    im: [[f64; LANES]; N],
}

impl<const N: usize> Group<N> {
    fn new(lines: &[SpectralLine<N>]) -> Self {
        let lane =
            |value: &dyn Fn(&SpectralLine<N>) -> f64| std::array::from_fn(|lane| lines.get(lane).map_or(0.0, value));
        Self {
            cycles: lane(&|line| line.cycles),
            re: std::array::from_fn(|output| lane(&|line| line.amplitudes[output].re)),
            im: std::array::from_fn(|output| lane(&|line| line.amplitudes[output].im)),
        }
    }
}

impl<const N: usize> SineSum<N> {
    /// The sum of `lines`.
    pub fn new(lines: impl IntoIterator<Item = SpectralLine<N>>) -> Self {
        let lines: Vec<SpectralLine<N>> = lines.into_iter().collect();
        Self { groups: lines.chunks(LANES).map(Group::new).collect() }
    }

    /// The outputs at the argument `u`, with their derivatives with respect to it.
    pub fn at(&self, u: f64) -> [Jet; N] {
        // Value, first and second derivative of each output, one sum per lane; the lanes are added in order at the end.
        let mut sums = [[[0.0; LANES]; 3]; N];
        for Group { cycles, re, im } in &self.groups {
            let phasors = cycles.map(|cycles| sin_cos_turns(cycles * u));
            for (output, [x, d, dd]) in sums.iter_mut().enumerate() {
                for lane in 0..LANES {
                    let (sin, cos) = phasors[lane];
                    let rate = TAU * cycles[lane];
                    let value = re[output][lane] * cos - im[output][lane] * sin;
                    let slope = rate * (re[output][lane] * sin + im[output][lane] * cos);
                    x[lane] += value;
                    d[lane] -= slope;
                    dd[lane] -= rate * rate * value;
                }
            }
        }
        sums.map(|[x, d, dd]| Jet { x: x.iter().sum(), d: d.iter().sum(), dd: dd.iter().sum() })
    }
}

/// A bin of a spectrum, represented by one sinusoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FrequencyBin {
    /// Frequency of the sinusoid: random within the bin, so that the sum does not repeat.
    pub at: f64,
    /// Width of the bin.
    pub width: f64,
    /// Random phase, as a complex number of modulus 1.
    pub phase: Complex<f64>,
}

impl FrequencyBin {
    /// Complex amplitude of a sinusoid with the power of the one-sided `density` in this bin: `sqrt(2 density width)`.
    pub fn amplitude(&self, density: f64) -> Complex<f64> {
        self.phase * (2.0 * density * self.width).sqrt()
    }
}

/// `count` bins of equal width between `low` and `high`.
pub(super) fn linear_bins((low, high): (f64, f64), count: usize, stream: &mut Stream) -> Vec<FrequencyBin> {
    let width = (high - low) / count as f64;
    let bin = |k| {
        let at = low + width * (k as f64 + stream.random::<f64>());
        FrequencyBin { at, width, phase: random_phase(stream) }
    };
    (0..count).map(bin).collect()
}

/// `count` bins between `low` (above zero) and `high` whose widths grow by a constant factor.
pub(super) fn log_bins((low, high): (f64, f64), count: usize, stream: &mut Stream) -> Vec<FrequencyBin> {
    let ratio = (high / low).powf(1.0 / count as f64);
    let bin = |k| {
        let start = low * ratio.powf(f64::from(k));
        let at = start * ratio.powf(stream.random::<f64>());
        // The width at the random frequency makes the expected power of the bin equal to the integral of the density:
        // with a uniform logarithm, density * f * ln(ratio) has that mean.
        FrequencyBin { at, width: at * ratio.ln(), phase: random_phase(stream) }
    };
    (0..count as u32).map(bin).collect()
}

fn random_phase(stream: &mut Stream) -> Complex<f64> {
    let (sin, cos) = sin_cos_turns(stream.random::<f64>());
    Complex::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::random::Seed;

    #[test]
    fn a_line_is_its_cosine() {
        // Amplitude 2 exp(i 0.3) at 1.5 cycles: 2 cos(2 pi 1.5 u + 0.3).
        let sines = SineSum::new([SpectralLine { cycles: 1.5, amplitudes: [Complex::from_polar(2.0, 0.3)] }]);
        let (u, rate) = (0.77, TAU * 1.5);
        let [jet] = sines.at(u);
        let (sin, cos) = (rate * u + 0.3).sin_cos();
        assert_relative_eq!(jet.x, 2.0 * cos, epsilon = 1e-13);
        assert_relative_eq!(jet.d, -2.0 * rate * sin, epsilon = 1e-12);
        assert_relative_eq!(jet.dd, -2.0 * rate * rate * cos, epsilon = 1e-11);
    }

    #[test]
    fn bins_have_the_power_of_the_spectrum() {
        // The density 1 / f^2 from 0.1 to 10 has the power 9.9. The power of a bin is |amplitude|^2 / 2.
        let mut stream = Seed(1).stream("parts");
        let power =
            |bins: &[FrequencyBin]| bins.iter().map(|p| p.amplitude(p.at.powi(-2)).norm_sqr() / 2.0).sum::<f64>();
        let geometric = log_bins((0.1, 10.0), 400, &mut stream);
        assert_relative_eq!(power(&geometric), 9.9, max_relative = 2e-3);
        let even = linear_bins((1.0, 2.0), 400, &mut stream);
        assert_relative_eq!(power(&even), 0.5, max_relative = 1e-3);
        assert!(
            even.iter().all(|p| (1.0..2.0).contains(&p.at)) && geometric.iter().all(|p| (0.1..10.0).contains(&p.at))
        );
    }
}
