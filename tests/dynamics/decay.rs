use crate::dynamics::heads::{
    BasePulse, ReferenceHead, built, displacement, jointed, shipped, states, suspended, upright_spring,
};
use approx::assert_relative_eq;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::TAU;
use zsim::dynamics::{HeadModel, Mode, ModeKind};

/// Frequency (Hz) and damping ratio of a free oscillation sampled every `step_s`.
///
/// A damped oscillation obeys `q[n+1] = a q[n] + b q[n-1]` with `b = -exp(-2 s h)`, `a = 2 exp(-s h) cos(w h)`; a and b
/// by least squares, then `omega^2 = s^2 + w^2`, `zeta = s / omega`.
fn fitted(q: &[f64], step_s: f64) -> (f64, f64) {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for three in q.windows(3) {
        let row = Vector2::new(three[1], three[0]);
        normal += row * row.transpose();
        right += row * three[2];
    }
    let solved = normal.try_inverse().unwrap() * right;
    let (a, b) = (solved.x, solved.y);
    let decay = -0.5 * (-b).ln() / step_s;
    let turning = (a / (2.0 * (-b).sqrt())).acos() / step_s;
    let omega = decay.hypot(turning);
    (omega / TAU, decay / omega)
}

/// Frequency and damping of the free decay of one mode after a small pulse of the base.
fn decay_of(model: &HeadModel, mode: &Mode) -> (f64, f64) {
    // Pulse along or about the axis that excites the mode: sideways for rocking and sway, up for bounce, about z for yaw.
    let axis = match mode.kind {
        ModeKind::Bounce => 2,
        ModeKind::Yaw => 5,
        ModeKind::Rocking | ModeKind::Sway => usize::from(mode.shape[3].abs() > mode.shape[4].abs()),
    };
    let pulse = BasePulse { axis, amount: 2e-4, period_s: 0.5 / mode.frequency_hz };
    let period_s = 1.0 / mode.frequency_hz;
    let path = states(model, &pulse, 1e-3, 8.0 * period_s);
    let mass = model.linear().unwrap().mass;
    // The modal coordinate, which excludes other modes, sampled twelve times per period.
    let stride = (period_s / 12.0 / 1e-3).round() as usize;
    let after = (pulse.period_s / 1e-3).ceil() as usize + 1;
    let own: Vec<f64> = path[after..].iter().map(|s| (mass * mode.shape).dot(&displacement(model, s))).collect();
    let sparse: Vec<f64> = own.iter().step_by(stride).copied().collect();
    fitted(&sparse, stride as f64 * 1e-3)
}

#[test]
fn each_mode_decays_with_the_frequency_and_damping_of_the_linear_model() {
    let table = ReferenceHead { damping: [0.02, 0.03, 0.04, 0.05], ..ReferenceHead::default() };
    for model in [table.model(), shipped("handheld")] {
        for mode in model.linear_modes() {
            let (frequency_hz, damping_ratio) = decay_of(&model, mode);
            assert_relative_eq!(frequency_hz, mode.frequency_hz, max_relative = 0.01);
            assert_relative_eq!(damping_ratio, mode.damping_ratio, max_relative = 0.01);
        }
    }
}

#[test]
fn modes_of_other_linkages_decay_as_in_the_linear_model() {
    let damped = |text: String| {
        let ratios = "rocking: 0.02, sway: 0.03, bounce: 0.04, yaw: 0.05";
        built(&text.replace("rocking: 0.0, sway: 0.0, bounce: 0.0, yaw: 0.0", ratios)).unwrap()
    };
    let springs: String = [[0.04, 0.0], [-0.02, 0.03], [-0.02, -0.03]]
        .map(|[x, y]| upright_spring([x, y, 0.0], [x, y, -0.04]).replace("neglected", "included"))
        .concat();
    let wire =
        ReferenceHead { damping: [0.02, 0.03, 0.04, 0.05], more: "spring_mass: included,", ..ReferenceHead::default() };
    let heads = [
        ("springs", damped(suspended([0.0, 0.0, 0.12], &springs))),
        ("joint", damped(suspended([0.0, 0.0, 0.07], &jointed(0.7)))),
        ("wire", wire.model()),
    ];
    for (name, model) in heads {
        for mode in model.linear_modes().iter().filter(|mode| mode.frequency_hz < 30.0) {
            let (frequency_hz, damping_ratio) = decay_of(&model, mode);
            assert!((frequency_hz / mode.frequency_hz - 1.0).abs() < 0.01, "{name}: {frequency_hz} Hz of {mode:?}");
            assert!((damping_ratio / mode.damping_ratio - 1.0).abs() < 0.01, "{name}: {damping_ratio} of {mode:?}");
        }
    }
}

#[test]
fn a_small_decay_does_not_depend_on_the_number_of_segments() {
    let damping = [0.02, 0.03, 0.04, 0.05];
    let decay = |segments: usize| {
        let model = ReferenceHead { damping, segments, ..ReferenceHead::default() }.model();
        decay_of(&model, &model.linear_modes()[1])
    };
    let one = decay(1);
    for segments in [2, 8] {
        let (frequency_hz, damping_ratio) = decay(segments);
        assert_relative_eq!(frequency_hz, one.0, max_relative = 1e-4);
        assert_relative_eq!(damping_ratio, one.1, max_relative = 1e-3);
    }
}
