//! Wind gusts, and the response of a hovering craft.

use super::{GustSpec, UavSpec};
use crate::sines::{FrequencyBin, SineSum, SpectralLine, log_bins};
use nalgebra::Complex;
use std::f64::consts::{PI, TAU};
use zsim_base::geometry::STANDARD_GRAVITY_M_PER_S2;
use zsim_base::random::Stream;

/// Direction of a gust component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    /// Along the airspeed.
    Along,
    /// Horizontal, across the airspeed.
    Across,
    /// Vertical.
    Up,
}

const FOOT_M: f64 = 0.3048;

/// Frequency band of the gusts, Hz.
const BAND_HZ: (f64, f64) = (0.005, 5.0);

/// Sinusoids per gust component.
const LINES: usize = 150;

impl GustSpec {
    /// Standard deviation (m/s) and length scale (m) of the gusts at a height (MIL-F-8785C, section 3.7.3.4).
    ///
    /// `L_w = h`, `L_u = L_v = h / (0.177 + 0.000823 h)^1.2`, `s_w = 0.1 W`,
    /// `s_u = s_v = s_w / (0.177 + 0.000823 h)^0.4` with h in feet, clamped to 10 to 1000 feet.
    fn scales(&self, axis: Axis, height_m: f64) -> (f64, f64) {
        let h = (height_m / FOOT_M).clamp(10.0, 1000.0);
        let base = 0.177 + 0.000_823 * h;
        let up = 0.1 * self.wind_m_per_s;
        match axis {
            Axis::Up => (up, h * FOOT_M),
            Axis::Along | Axis::Across => (up / base.powf(0.4), h / base.powf(1.2) * FOOT_M),
        }
    }

    /// One-sided spectral density of a gust component at `freq_hz`, (m/s)^2/Hz.
    ///
    /// Over the angular frequency w, with `x = L w / V` (MIL-F-8785C, section 3.7.1.2): along
    /// `s^2 2L/(pi V) / (1 + x^2)`, across and up `s^2 L/(pi V) (1 + 3 x^2) / (1 + x^2)^2`.
    pub(super) fn density(&self, axis: Axis, height_m: f64, freq_hz: f64) -> f64 {
        let (deviation, scale_m) = self.scales(axis, height_m);
        let passing_s = scale_m / self.airspeed_m_per_s;
        let x2 = (passing_s * TAU * freq_hz).powi(2);
        let form = match axis {
            Axis::Along => 2.0 / (1.0 + x2),
            Axis::Across | Axis::Up => (1.0 + 3.0 * x2) / (1.0 + x2).powi(2),
        };
        TAU * deviation * deviation * passing_s / PI * form
    }

    fn components(&self, axis: Axis, height_m: f64, stream: &mut Stream) -> Vec<(f64, Complex<f64>)> {
        let bins = log_bins(BAND_HZ, LINES, stream);
        bins.iter().map(|bin: &FrequencyBin| (bin.at, bin.amplitude(self.density(axis, height_m, bin.at)))).collect()
    }
}

/// Displacement per gust of 1 m/s: the air drags the craft, and position control holds it,
/// `x'' = -2 z w0 x' - w0^2 x + d (g - x')`.
fn displacement(spec: &UavSpec, rate: f64) -> Complex<f64> {
    let natural = TAU * spec.hold_hz;
    let damping = 2.0 * spec.hold_damping * natural + spec.drag_per_s;
    Complex::from(spec.drag_per_s) / Complex::new(natural * natural - rate * rate, damping * rate)
}

/// Displacement (m) and tilt (rad, towards the displacement) due to horizontal gusts. The tilt is the commanded
/// acceleration over gravity.
pub(super) fn horizontal(spec: &UavSpec, axis: Axis, stream: &mut Stream) -> SineSum<2> {
    let natural = TAU * spec.hold_hz;
    let line = |(freq_hz, gust): (f64, Complex<f64>)| {
        let rate = TAU * freq_hz;
        let moved = gust * displacement(spec, rate);
        let command = -moved * Complex::new(natural * natural, 2.0 * spec.hold_damping * natural * rate);
        SpectralLine { cycles: freq_hz, amplitudes: [moved, command / STANDARD_GRAVITY_M_PER_S2] }
    };
    SineSum::new(spec.gust.components(axis, spec.height_m, stream).into_iter().map(line))
}

/// Vertical displacement (m) due to gusts.
pub(super) fn vertical(spec: &UavSpec, stream: &mut Stream) -> SineSum<1> {
    let line = |(freq_hz, gust): (f64, Complex<f64>)| SpectralLine {
        cycles: freq_hz,
        amplitudes: [gust * displacement(spec, TAU * freq_hz)],
    };
    SineSum::new(spec.gust.components(Axis::Up, spec.height_m, stream).into_iter().map(line))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::random::Seed;
    use zsim_base::signal::{Segments, power_density};

    const WIND: GustSpec = GustSpec { wind_m_per_s: 7.7, airspeed_m_per_s: 8.0 };

    #[test]
    fn the_variance_is_that_of_the_model() {
        // The total power is s^2; at 100 feet s_w = 0.77 m/s and s_u = 0.77 / 0.2593^0.4 = 1.321 m/s.
        for (axis, deviation) in [(Axis::Along, 1.3213), (Axis::Across, 1.3213), (Axis::Up, 0.77)] {
            let steps = 400_000;
            let h = 200.0 / f64::from(steps);
            let power: f64 = (0..steps).map(|k| WIND.density(axis, 30.48, h * (f64::from(k) + 0.5)) * h).sum();
            assert_relative_eq!(power.sqrt(), deviation, max_relative = 2e-3);
        }
    }

    #[test]
    fn synthesised_gusts_have_drydens_spectrum() {
        for axis in [Axis::Along, Axis::Across, Axis::Up] {
            let mut stream = Seed(4).stream("gust");
            let line = |(freq_hz, gust)| SpectralLine { cycles: freq_hz, amplitudes: [gust] };
            let gusts = SineSum::new(WIND.components(axis, 30.48, &mut stream).into_iter().map(line));
            let samples: Vec<f64> = (0..60_000).map(|k| gusts.at(0.05 * f64::from(k))[0].x).collect();
            let spectrum = power_density(&samples, 20.0, Segments::hann(4096)).unwrap();
            // Compares octaves of about 15 sinusoids with the integral of the formula.
            for octave in 0..6 {
                let low = 0.05 * f64::from(1 << octave);
                let h = low / 1000.0;
                let expected: f64 =
                    (0..1000).map(|k| WIND.density(axis, 30.48, low + h * (f64::from(k) + 0.5)) * h).sum();
                assert_relative_eq!(spectrum.power_between(low, 2.0 * low), expected, max_relative = 0.12);
            }
        }
    }
}
