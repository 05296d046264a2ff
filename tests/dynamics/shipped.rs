//! The shipped heads: plausible modes, swing in a hand, and small-swing gains of the linear model.

use crate::dynamics::heads::shipped;
use zsim::dynamics::{DampingSpec, HeadModel, HeadSimulation, LinkageSpec, MotorSpec, TurnSpec, load};
use zsim::head::gains::{GainPlan, GainWatch, gain_curve};
use zsim::motion::Axis;
use zsim::random::Seed;
use zsim::spec::{Kind, names};

/// Names of the heads with a flexible linkage.
fn sprung() -> Vec<String> {
    names(Kind::Head).into_iter().filter(|name| !shipped(name).linear_modes().is_empty()).collect()
}

#[test]
fn there_is_a_shipped_head_for_every_linkage() {
    let all = names(Kind::Head);
    for name in [
        "handheld",
        "handheld_2",
        "vehicle_three_springs",
        "vehicle_stiff_spring",
        "backpack",
        "hanging",
        "rope_pendulum",
        "elastic_cables",
        "float",
        "universal_joint",
        "rigid",
        "spinning",
        "nodding",
        "trawling",
    ] {
        assert!(all.iter().any(|known| known == name), "{name} is not among {all:?}");
    }
}

#[test]
fn shipped_heads_are_light_with_plausible_modes() {
    for name in sprung() {
        let model = shipped(&name);
        assert!(model.body().mass_kg < 0.5, "{name} has {} kg", model.body().mass_kg);
        for mode in model.linear_modes() {
            assert!((0.2..60.0).contains(&mode.frequency_hz), "{name}: {} Hz", mode.frequency_hz);
            assert!((0.0005..1.0).contains(&mode.damping_ratio), "{name}: a ratio of {}", mode.damping_ratio);
        }
    }
}

#[test]
fn flexible_and_actuated_heads_move_in_a_hand_and_rigid_ones_do_not() {
    let (spec, source) = zsim::motion::load("wave").unwrap();
    let motion = spec.build(&source, None, 12.0, Seed(1)).unwrap();
    for name in names(Kind::Head) {
        let model = shipped(&name);
        let mut lean = 0.0_f64;
        for state in HeadSimulation::new(&model, motion.as_ref(), 1e-3).unwrap().take(10_000) {
            let state = state.unwrap_or_else(|error| panic!("{name}: {error}"));
            let seen = state.base.world_from_body.inv_mul(&state.head.world_from_body);
            lean = lean.max(seen.rotation.angle_to(&model.base_from_head_at_rest().rotation).to_degrees());
        }
        let expected = match load(&name).unwrap().0.linkage {
            LinkageSpec::Rigid { .. } => 0.0..1e-4,
            // A nod of up to 45 degrees, and a continuous rotation.
            LinkageSpec::Actuated { motor: MotorSpec { turn: TurnSpec::Nod { .. }, .. }, .. } => 44.9..45.01,
            LinkageSpec::Actuated { .. } => 179.0..180.1,
            LinkageSpec::Spring { .. } | LinkageSpec::Suspension { .. } => 0.1..120.0,
        };
        assert!(expected.contains(&lean), "{name} turns by {lean} degrees");
    }
}

/// A shipped head with enough damping for its modes to decay within a simulation.
fn damped(name: &str) -> HeadModel {
    let (mut spec, source) = load(name).unwrap();
    if let Some(ratio) = spec.linkage.damping_ratio_mut() {
        *ratio = DampingSpec { rocking: 0.04, sway: 0.04, bounce: 0.04, yaw: 0.04 };
    }
    HeadModel::new(&spec, &source).unwrap()
}

#[test]
fn small_swing_gains_of_shipped_heads_agree_with_the_closed_form() {
    let plan = GainPlan { up_to_hz: 12.0, realisations: 2, period_s: Some(20.0), ..GainPlan::default() };
    for name in sprung().iter().filter(|name| *name != "handheld") {
        let head = damped(name);
        for axis in [Axis::Pitch, Axis::Z] {
            let curve = gain_curve(&head, axis, &plan, GainWatch::silent()).unwrap();
            let coherent = curve.points.iter().filter(|p| p.coherence > 0.95);
            for p in coherent.clone() {
                let allowed = f64::max(0.03 * p.gain_model, 3.0 * p.gain_sigma).max(1e-3);
                assert!((p.gain - p.gain_model).abs() < allowed, "{name} {axis:?}: {p:?}");
            }
            assert!(coherent.count() * 10 > curve.points.len() * 9, "{name} {axis:?}");
        }
    }
}
