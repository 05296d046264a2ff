//! Modes with their amplitudes in a response, along the axes where the coils leave their directions open; their names.

use nalgebra::Complex;
use zsim_base::geometry::Vector;
use zsim_dynamics::{Mode, ModeKind};
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

/// A direction within this angle of an axis, or of the horizontal plane, counts as along it, degrees.
const TOLERANCE_DEG: f64 = 10.0;
/// Rotation by 1 rad counts as much as this displacement, m.
const ROTATION_LENGTH_M: f64 = 0.1;
/// A rocking mode rotates by at least this fraction of its displacement; else it only shifts.
const LEAST_ROTATION: f64 = 0.05;
/// A sway is mainly horizontal if this fraction of its displacement is.
const MAINLY: f64 = 0.5;

/// The name of a mode with its direction, such as "rocking about y" or "bounce along z".
///
/// Axes are those of the base. Rocking and yaw rotate about the direction, sway and bounce move the centre of mass along it. Of a sway
/// that is mainly horizontal, the direction is the horizontal one: a coil couples it to bounce.
pub fn mode_name(mode: &Mode) -> String {
    let (shift, turn) = split(&mode.shape);
    let turns = match mode.kind {
        ModeKind::Rocking => ROTATION_LENGTH_M * turn.norm() > LEAST_ROTATION * shift.norm(),
        ModeKind::Yaw => true,
        ModeKind::Sway | ModeKind::Bounce => false,
    };
    let horizontal = Vector::new(shift.x, shift.y, 0.0);
    let moved = match mode.kind {
        ModeKind::Sway if horizontal.norm() > MAINLY * shift.norm() => horizontal,
        _ => shift,
    };
    let (word, along) = if turns { ("about", turn) } else { ("along", moved) };
    format!("{} {word} {}", mode.kind.name(), direction(&along))
}

/// A direction in words; its sign does not matter.
fn direction(along: &Vector) -> String {
    let Some(unit) = along.try_normalize(f64::MIN_POSITIVE) else { return "no axis".to_owned() };
    let tolerance = TOLERANCE_DEG.to_radians();
    let nearest = unit.iamax();
    if unit[nearest].abs() > tolerance.cos() {
        return ["x", "y", "z"][nearest].to_owned();
    }
    if unit.z.abs() > tolerance.sin() {
        return format!("({:.2}, {:.2}, {:.2})", unit.x, unit.y, unit.z);
    }
    let unit = if unit.x < 0.0 { -unit } else { unit };
    let towards = if unit.y < 0.0 { "-y" } else { "y" };
    format!("an axis {:.0}\u{b0} from x towards {towards}", unit.y.abs().atan2(unit.x).to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_dynamics::{HeadModel, load};
    use zsim_elasticity::Vector6;
    use zsim_elasticity::stack;

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

    fn name(kind: ModeKind, shift: [f64; 3], turn: [f64; 3]) -> String {
        let shape = stack(&Vector::from(shift), &Vector::from(turn));
        mode_name(&Mode { kind, frequency_hz: 1.0, damping_ratio: 0.1, shape })
    }

    #[test]
    fn a_mode_is_named_by_the_axis_of_its_dominant_motion() {
        // A head that tips forward about y moves its centre, above the foot, along x.
        assert_eq!(name(ModeKind::Rocking, [0.14, 0.0, 0.0], [0.0, 1.0, 0.02]), "rocking about y");
        assert_eq!(name(ModeKind::Sway, [-0.1, 0.001, 0.0], [0.0, 3.0, 0.0]), "sway along x");
        assert_eq!(name(ModeKind::Bounce, [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]), "bounce along z");
        assert_eq!(name(ModeKind::Yaw, [0.0, 0.0, 0.0], [0.0, 0.1, -2.0]), "yaw about z");
    }

    #[test]
    fn a_direction_between_the_axes_is_an_angle_whatever_its_sign() {
        // tan 60 deg = 1.732.
        let expected = "sway along an axis 60\u{b0} from x towards y";
        assert_eq!(name(ModeKind::Sway, [1.0, 1.732, 0.0], [0.0; 3]), expected);
        assert_eq!(name(ModeKind::Sway, [-1.0, -1.732, 0.0], [0.0; 3]), expected);
        let expected = "rocking about an axis 45\u{b0} from x towards -y";
        assert_eq!(name(ModeKind::Rocking, [0.0; 3], [-1.0, 1.0, 0.0]), expected);
        assert_eq!(name(ModeKind::Bounce, [0.6, 0.0, 0.8], [0.0; 3]), "bounce along (0.60, 0.00, 0.80)");
        assert_eq!(name(ModeKind::Sway, [0.9, 0.0, -0.6], [0.0; 3]), "sway along x");
        assert_eq!(name(ModeKind::Sway, [0.3, 0.0, 0.8], [0.0; 3]), "sway along (0.35, 0.00, 0.94)");
    }

    #[test]
    fn a_slow_mode_without_rotation_is_named_by_its_displacement() {
        assert_eq!(name(ModeKind::Rocking, [1.0, 0.0, 0.0], [0.0, 1e-9, 0.0]), "rocking along x");
    }
}
