use crate::dynamics::heads::{
    BasePulse, Nodding, ReferenceHead, built, cord, floating, jointed, moored, states, suspended,
};
use approx::assert_relative_eq;
use zsim::dynamics::{HeadModel, HeadSimulation};
use zsim::geometry::Vector;

/// Energy above rest over time of a head after a pulse of the base, J, and the largest inclination, degrees.
fn energies(model: &HeadModel, pulse: &BasePulse, step_s: f64, seconds: f64) -> (Vec<f64>, f64) {
    let mut at_rest = None;
    let (mut energies, mut lean) = (Vec::new(), 0.0_f64);
    let count = (seconds / step_s) as usize;
    for state in HeadSimulation::new(model, pulse, step_s).unwrap().take(count) {
        let state = state.unwrap();
        let energy = model.energy_j(&state.base.world_from_body, &state.head).unwrap();
        let at_rest = *at_rest.get_or_insert(energy);
        if state.t_s > pulse.period_s {
            lean = lean.max((state.head.world_from_body.rotation * Vector::z()).angle(&Vector::z()).to_degrees());
            energies.push(energy - at_rest);
        }
    }
    (energies, lean)
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// Trend of the energy from the first tenth to the last, and its largest deviation, both relative to its mean.
fn trend_and_deviation(energy: &[f64]) -> (f64, f64) {
    let tenth = energy.len() / 10;
    let (first, last) = (mean(&energy[..tenth]), mean(&energy[energy.len() - tenth..]));
    let most = energy.iter().fold(0.0_f64, |most, e| most.max((e - first).abs()));
    (last / first - 1.0, most / first)
}

#[test]
fn without_damping_energy_has_no_trend_in_small_and_large_swings() {
    let model = ReferenceHead::default().model();
    // A swing of 1 degree for two minutes, and one of 60 degrees for ten.
    for (amount, degrees, seconds) in [(0.002, 0.5..2.0, 120.0), (0.115, 55.0..70.0, 600.0)] {
        let (energy, lean) = energies(&model, &BasePulse { axis: 0, amount, period_s: 0.6 }, 1e-3, seconds);
        assert!(degrees.contains(&lean), "leans by {lean} degrees");
        let (trend, excursion) = trend_and_deviation(&energy);
        assert!(trend.abs() < 1e-5 && excursion < 1e-3, "a trend of {trend:.1e}, excursions of {excursion:.1e}");
    }
}

#[test]
fn energy_has_no_trend_in_a_segmented_spring_either() {
    let model = ReferenceHead { segments: 4, ..ReferenceHead::default() }.model();
    let (energy, lean) = energies(&model, &BasePulse { axis: 0, amount: 0.115, period_s: 0.6 }, 1e-3, 20.0);
    assert!((55.0..70.0).contains(&lean), "leans by {lean} degrees");
    let (trend, excursion) = trend_and_deviation(&energy);
    assert!(trend.abs() < 1e-5 && excursion < 1e-3, "a trend of {trend:.1e}, excursions of {excursion:.1e}");
}

#[test]
fn energy_has_no_trend_in_any_other_linkage() {
    let ropes = cord([0.03, 0.0, 0.0], [0.03, 0.0, 0.05], 0.4, 800.0)
        + &cord([-0.03, 0.0, 0.0], [-0.03, 0.0, 0.05], 0.4, 800.0);
    let cable = "spring_mass: included, cable: (length_m: 0.12, tension_n: 3.0, stiffness_n_per_m: 500.0, damping_n_s_per_m: 0.0),";
    let heads = [
        ("ropes", built(&suspended([0.0, 0.0, -0.46], &ropes)).unwrap(), 0.08, 1.2),
        ("joint", built(&suspended([0.0, 0.0, 0.07], &jointed(0.7))).unwrap(), 0.08, 0.6),
        (
            "float",
            built(&suspended([0.0, 0.0, 0.05], &(floating([0.0, 0.0, 0.0, 0.1]) + &moored()))).unwrap(),
            0.01,
            0.6,
        ),
        ("wire and cable", ReferenceHead { more: cable, ..ReferenceHead::default() }.model(), 0.06, 0.6),
    ];
    for (name, model, amount, period_s) in heads {
        let (energy, lean) = energies(&model, &BasePulse { axis: 0, amount, period_s }, 1e-3, 60.0);
        let (trend, excursion) = trend_and_deviation(&energy);
        assert!(lean > 0.5, "{name} leans by {lean} degrees");
        assert!(
            trend.abs() < 2e-4 && excursion < 1e-2,
            "{name}: a trend of {trend:.1e}, excursions of {excursion:.1e}, {lean}"
        );
    }
}

#[test]
fn damping_never_adds_energy() {
    let model = ReferenceHead { damping: [0.03; 4], ..ReferenceHead::default() }.model();
    let (energy, _) = energies(&model, &BasePulse { axis: 0, amount: 0.115, period_s: 0.6 }, 1e-3, 10.0);
    // Poses and velocities agree to second order in the step, so that the energy has ripples of at most 1e-3.
    let start = energy[0];
    let mut least = f64::INFINITY;
    for e in energy {
        least = least.min(e);
        assert!(e < least + 2e-3 * start, "rises to {e} J from {least} J");
    }
    assert!(least < 0.05 * start);
}

#[test]
fn halving_the_step_quarters_the_error() {
    let model = ReferenceHead { damping: [0.02; 4], ..ReferenceHead::default() }.model();
    let base = Nodding { amount_rad: 0.05 };
    let end = |step_s: f64| {
        let path = states(&model, &base, step_s, 3.0);
        path[path.len() - 1].head.world_from_body
    };
    let fine = end(1.25e-4);
    let error = |step_s: f64| (end(step_s).translation.vector - fine.translation.vector).norm();
    let (coarse, middle) = (error(2e-3), error(1e-3));
    // Relative to a step of h/8, the difference is (1 - 1/64) of the error for h, and (1 - 1/256) for 2h.
    assert_relative_eq!(coarse / middle, 4.0, max_relative = 0.1);
    assert!(middle < 1e-3, "{middle} m at 1 ms");
}
