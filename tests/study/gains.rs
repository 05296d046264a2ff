//! Gain curves of the simulated head compared with the closed form of the linearised head.

use zsim::dynamics::{AccelerationKind, DampingSpec, HeadModel, LinkageSpec, load};
use zsim::head::gains::{GainCurve, GainPlan, GainPoint, GainWatch, csv, gain_curve, gain_curves, swing_study};
use zsim::motion::Axis;
use zsim::spec::{Source, parse};

/// The handheld head with one damping ratio for all modes.
fn handheld(ratio: f64) -> HeadModel {
    let (mut spec, source) = load("handheld").unwrap();
    if let LinkageSpec::Spring { damping_ratio, .. } = &mut spec.linkage {
        *damping_ratio = DampingSpec { rocking: ratio, sway: ratio, bounce: ratio, yaw: ratio };
    }
    HeadModel::new(&spec, &source).unwrap()
}

/// Two realisations up to 25 Hz, so that the peaks of all axes are included (bounce is at 17 Hz).
fn plan() -> GainPlan {
    GainPlan { up_to_hz: 25.0, realisations: 2, ..GainPlan::default() }
}

/// The largest deviation from the closed form, relative to the tolerance of 3 % or three sigma.
///
/// Only points with a coherence above 0.95 count.
fn worst(curve: &GainCurve) -> (f64, &GainPoint) {
    let allowed = |p: &GainPoint| f64::max(0.03 * p.gain_model, 3.0 * p.gain_sigma);
    let deviation = |p: &GainPoint| (p.gain - p.gain_model).abs() / allowed(p);
    let coherent = curve.points.iter().filter(|p| p.coherence > 0.95);
    let worst = coherent.max_by(|a, b| deviation(a).total_cmp(&deviation(b))).unwrap();
    (deviation(worst), worst)
}

#[test]
fn small_swing_gains_of_all_six_axes_agree_with_the_closed_form() {
    let curves = gain_curves(&handheld(0.02), &plan(), GainWatch::silent()).unwrap();
    assert_eq!(curves.len(), 6);
    for curve in &curves {
        let (peak, model) = (curve.peak.unwrap(), curve.peak_model.unwrap());
        let axis = curve.axis;
        assert!((peak.freq_hz / model.freq_hz - 1.0).abs() < 0.005, "{axis:?}: {peak:?} for {model:?}");
        assert!((peak.gain / model.gain - 1.0).abs() < 0.03, "{axis:?}: {peak:?} for {model:?}");
        let (deviation, point) = worst(curve);
        assert!(deviation < 1.0, "{axis:?}: {point:?}");
        let coherent = curve.points.iter().filter(|p| p.coherence > 0.95).count();
        assert!(coherent * 10 > curve.points.len() * 9, "{axis:?}: {coherent} of {} lines", curve.points.len());
    }
}

#[test]
fn a_lightly_damped_head_agrees_with_the_closed_form_within_1_percent() {
    // At a damping ratio of 1 % the head rocks far at its resonance. The second harmonic of that swing, at twice the
    // frequency, must not count as response of the base's motion there.
    let head = handheld(0.01);
    let rocking_hz = head.linear_modes()[0].frequency_hz;
    let plan = GainPlan { up_to_hz: 3.0, period_s: Some(20.0), ..plan() };
    for axis in [Axis::Pitch, Axis::X] {
        let curve = gain_curve(&head, axis, &plan, GainWatch::silent()).unwrap();
        for point in curve.points.iter().filter(|p| (p.freq_hz / (2.0 * rocking_hz) - 1.0).abs() < 0.1) {
            assert!((point.gain / point.gain_model - 1.0).abs() < 0.01, "{axis:?}: {point:?}");
        }
    }
}

#[test]
fn halving_the_time_step_changes_the_peak_by_less_than_1_percent() {
    let head = handheld(0.06);
    let plan = GainPlan { up_to_hz: 5.0, ..plan() };
    let peak = |step_s: f64| {
        gain_curve(&head, Axis::Pitch, &GainPlan { step_s, ..plan.clone() }, GainWatch::silent()).unwrap().peak.unwrap()
    };
    let (whole, half) = (peak(1e-3), peak(0.5e-3));
    assert!((whole.gain / half.gain - 1.0).abs() < 0.01, "{whole:?} {half:?}");
}

#[test]
fn specific_force_agrees_with_the_closed_form() {
    let head = handheld(0.06);
    let plan = GainPlan { acceleration: AccelerationKind::SpecificForce, up_to_hz: 5.0, ..plan() };
    for axis in [Axis::X, Axis::Y] {
        let curve = gain_curve(&head, axis, &plan, GainWatch::silent()).unwrap();
        let (deviation, point) = worst(&curve);
        assert!(deviation < 1.0, "{axis:?}: {point:?}");
    }
}

#[test]
fn gain_curves_do_not_depend_on_the_number_of_threads() {
    let head = handheld(0.2);
    let plan = GainPlan { up_to_hz: 2.0, period_s: Some(2.0), ..plan() };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        csv(&pool.install(|| gain_curves(&head, &plan, GainWatch::silent()).unwrap()))
    };
    let text = with(1);
    assert_eq!(text, with(2));
    assert!(text.starts_with("axis,freq_hz,gain,coherence,gain_model"));
    // The odd multiples of 0.5 Hz up to 2 Hz.
    assert_eq!(text.lines().count(), 1 + 6 * 2);
}

/// The handheld head on a flexible joint of 1 mm length, stiff in all other directions; upright or hanging.
fn on_a_joint(stiffness_nm_per_rad: f64, is_hanging: bool) -> HeadModel {
    let (mut spec, source) = load("handheld").unwrap();
    let joint = format!(
        "stiffness(length_mm: 1, rows: ((1e5,0,0,0,0,0),(0,1e5,0,0,0,0),(0,0,1e5,0,0,0),(0,0,0,{k},0,0),(0,0,0,0,{k},0),\
         (0,0,0,0,0,50)))",
        k = stiffness_nm_per_rad
    );
    if let LinkageSpec::Spring { spring, segments, base_from_spring, end_stop, hold, damping_ratio, .. } =
        &mut spec.linkage
    {
        *spring = parse(&Source::in_memory("a joint", joint)).unwrap();
        *damping_ratio = DampingSpec { rocking: 0.08, sway: 0.08, bounce: 0.08, yaw: 0.08 };
        base_from_spring.roll_pitch_yaw_deg = [if is_hanging { 180.0 } else { 0.0 }, 0.0, 0.0];
        (*segments, *end_stop, *hold) = (1, None, None);
    }
    // Upside down the head would hang inside its carrier.
    spec.carrier.clear();
    HeadModel::new(&spec, &source).unwrap()
}

#[test]
fn a_large_swing_raises_the_resonance_of_an_upright_head_and_lowers_that_of_a_hanging_one() {
    // A pendulum with gravity torque w = m g l on a joint of stiffness k: upright k a - w sin a = (k - w) a + w a^3 / 6,
    // hanging (k + w) a - w a^3 / 6. With a multisine of random phases the swing is Gaussian, and statistical
    // linearisation replaces a^3 by 3 sigma^2 a: the frequency changes by +- w / (4 (k -+ w)) sigma^2. The base moves
    // along x, because on a rotating base the spring's angle would differ from the angle to gravity.
    let (spec, _) = load("handheld").unwrap();
    let lever_m = on_a_joint(1.0, false).body().centre_of_mass_in_head.z
        - match spec.linkage {
            LinkageSpec::Spring { head_from_spring, .. } => head_from_spring.position_m[2],
            _ => panic!("the handheld head has one spring"),
        };
    let weight_nm = 0.35 * 9.80665 * lever_m;
    let plan = GainPlan { up_to_hz: 4.0, realisations: 6, ..plan() };
    for (is_hanging, sign) in [(false, 1.0), (true, -1.0)] {
        let stiffness = if is_hanging { 0.6 * weight_nm } else { 1.6 * weight_nm };
        let study =
            swing_study(&on_a_joint(stiffness, is_hanging), Axis::X, &[0.2, 12.0], &plan, GainWatch::silent()).unwrap();
        let [small, large] = study.points[..] else { panic!("{study:?}") };
        let sigma = large.swing_rms_deg.to_radians();
        let shift = sign * weight_nm / (4.0 * (stiffness - sign * weight_nm)) * sigma * sigma;
        let measured = large.peak.unwrap().freq_hz / small.peak.unwrap().freq_hz - 1.0;
        assert!((measured / shift - 1.0).abs() < 0.4, "{measured} for {shift}: {study:?}");
    }
}

#[test]
fn a_large_swing_shifts_the_resonance_and_reduces_the_coherence() {
    let plan = GainPlan { up_to_hz: 3.0, realisations: 3, ..plan() };
    let study = swing_study(&handheld(0.06), Axis::Pitch, &[0.1, 15.0], &plan, GainWatch::silent()).unwrap();
    let [small, large] = study.points[..] else { panic!("{study:?}") };
    let (at_small, at_large) = (small.peak.unwrap(), large.peak.unwrap());
    assert!((at_small.freq_hz / study.peak_model.unwrap().freq_hz - 1.0).abs() < 0.005);
    assert!(large.swing_rms_deg > 8.0 && large.swing_most_deg > 20.0, "{large:?}");
    assert!((at_large.freq_hz / at_small.freq_hz - 1.0).abs() > 0.01, "{study:?}");
    assert!(small.coherence.unwrap() > 0.999 && large.coherence.unwrap() < small.coherence.unwrap(), "{study:?}");
}
