//! Modes with their amplitudes in a response, along the axes where the coils leave their directions open.

use nalgebra::Complex;
use zsim_dynamics::Mode;
use zsim_elasticity::split;

/// Two modes of the same kind whose frequencies differ by less than this fraction are shown along the axes.
///
/// The difference is small against the width of a resonance, so that any mixture of them is nearly a mode.
const CLOSE: f64 = 0.01;

/// A mode and its complex amplitude in a response, which is the sum of the shapes times the amplitudes.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExcitedMode {
    pub mode: Mode,
    pub amplitude: Complex<f64>,
}

/// The modes with each close pair turned so that the first rotates about x as little as possible, or moves along y if neither rotates;
/// their response is the same.
pub(super) fn along_axes(modes: &[Mode], amplitudes: &[Complex<f64>]) -> Vec<ExcitedMode> {
    let mut excited: Vec<ExcitedMode> = modes
        .iter()
        .zip(amplitudes)
        .map(|(mode, amplitude)| ExcitedMode { mode: *mode, amplitude: *amplitude })
        .collect();
    let mut first = 0;
    while first + 1 < excited.len() {
        let (a, b) = (excited[first], excited[first + 1]);
        let is_pair = a.mode.kind == b.mode.kind && b.mode.frequency_hz < (1.0 + CLOSE) * a.mode.frequency_hz;
        if is_pair {
            [excited[first], excited[first + 1]] = turned(&a, &b);
        }
        first += if is_pair { 2 } else { 1 };
    }
    excited
}

/// The pair, mixed with equal kinetic energy; frequencies are Rayleigh quotients.
fn turned(a: &ExcitedMode, b: &ExcitedMode) -> [ExcitedMode; 2] {
    let [(shift_a, turn_a), (shift_b, turn_b)] = [a, b].map(|one| split(&one.mode.shape));
    let turns = turn_a.norm().max(turn_b.norm()) > f64::MIN_POSITIVE;
    let (in_a, in_b) = if turns { (turn_a.x, turn_b.x) } else { (shift_a.y, shift_b.y) };
    let angle = (-in_a).atan2(in_b);
    let mix = |cos: f64, sin: f64| ExcitedMode {
        mode: Mode {
            frequency_hz: (cos * a.mode.frequency_hz).hypot(sin * b.mode.frequency_hz),
            damping_ratio: cos * cos * a.mode.damping_ratio + sin * sin * b.mode.damping_ratio,
            shape: a.mode.shape * cos + b.mode.shape * sin,
            ..a.mode
        },
        amplitude: a.amplitude * cos + b.amplitude * sin,
    };
    [mix(angle.cos(), angle.sin()), mix(-angle.sin(), angle.cos())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_dynamics::{HeadModel, load};
    use zsim_elasticity::Vector6;

    #[test]
    fn close_modes_are_turned_to_the_axes_without_a_change_of_the_response() {
        let (spec, source) = load("handheld").unwrap();
        let head = HeadModel::new(&spec, &source).unwrap();
        let modes = head.linear_modes();
        let amplitudes: Vec<Complex<f64>> = (0..6).map(|k| Complex::new(1.0 + f64::from(k), -0.5)).collect();
        let shown = along_axes(modes, &amplitudes);
        let response = |each: &mut dyn Iterator<Item = (Vector6, Complex<f64>)>| {
            each.fold(Vector6::zeros(), |sum, (shape, amplitude)| sum + shape * amplitude.re)
        };
        let before = response(&mut modes.iter().zip(&amplitudes).map(|(mode, amplitude)| (mode.shape, *amplitude)));
        let after = response(&mut shown.iter().map(|one| (one.mode.shape, one.amplitude)));
        assert_relative_eq!(before, after, epsilon = 1e-9);
        // The coil turns the rocking modes away from the axes.
        let turned_deg = |mode: &Mode| mode.shape[3].abs().atan2(mode.shape[4].abs()).to_degrees();
        assert!((20.0..70.0).contains(&turned_deg(&modes[0])));
        assert!(turned_deg(&shown[0].mode) < 1e-6 && turned_deg(&shown[1].mode) > 89.0);
        for (mode, shown) in modes.iter().zip(&shown) {
            assert_relative_eq!(mode.frequency_hz, shown.mode.frequency_hz, max_relative = CLOSE);
        }
    }
}
