//! The spring's own mass compared with continuous springs and beams.

use crate::dynamics::heads::built;
use approx::assert_relative_eq;
use std::f64::consts::TAU;
use zsim::dynamics::{HeadModel, ModeKind};

/// Mass of the wire of a steel spring of 10/2/12/90 mm: a quarter of pi^2 D n d^2 rho, kg.
fn wire_kg() -> f64 {
    0.25 * std::f64::consts::PI.powi(2) * 0.010 * 12.0 * 0.002_f64.powi(2) * 7850.0
}

/// A point mass on a slender spring, upright or hanging.
fn on_slender(mass_kg: f64, hung: bool, wire: &str) -> HeadModel {
    let roll = if hung { 180.0 } else { 0.0 };
    let text = format!(
        "(parts: [body(name: \"point\", mass_kg: {mass_kg:?}, centre_of_mass_m: (0.0, 0.0, 0.0),
            inertia_kg_m2: (xx: 1e-9, yy: 1e-9, zz: 1e-9))],
          head_from_laser: (position_m: (0.0, 0.0, 0.0)), head_from_imu: (position_m: (0.0, 0.0, 0.0)),
          linkage: spring(spring: coil(coil_diameter_mm: 10.0, wire_diameter_mm: 2.0, active_coils: 12.0,
            free_length_mm: 90.0, material: spring_steel), segments: 1,
            base_from_spring: (position_m: (0.0, 0.0, 0.0), roll_pitch_yaw_deg: ({roll:?}, 0.0, 0.0)),
            head_from_spring: (position_m: (0.0, 0.0, 0.0)), spring_mass: {wire},
            damping_ratio: (rocking: 0.0, sway: 0.0, bounce: 0.0, yaw: 0.0)))"
    );
    built(&text).unwrap()
}

fn square_of(model: &HeadModel, kind: ModeKind) -> f64 {
    (model.linear_modes().iter().find(|mode| mode.kind == kind).unwrap().frequency_hz * TAU).powi(2)
}

/// The root of `f` between two ends of different sign.
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == (f(low) > 0.0) { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_heavy_spring_bounces_as_a_continuous_one() {
    // Longitudinal waves in a spring of mass m with a point mass M: x tan x = m / M, omega^2 = x^2 k / m; without m it is
    // k / M.
    let mass_kg = 0.05;
    let ratio = wire_kg() / mass_kg;
    let x = root(|x| x * x.tan() - ratio, 1e-3, 1.5);
    let slower = square_of(&on_slender(mass_kg, false, "included"), ModeKind::Bounce)
        / square_of(&on_slender(mass_kg, false, "neglected"), ModeKind::Bounce);
    assert_relative_eq!(slower, x * x / ratio, max_relative = 1e-3);
    assert!(slower < 0.96, "{slower}");
}

#[test]
fn a_heavy_spring_sways_as_a_beam_with_a_tip() {
    // Euler-Bernoulli cantilever with a point mass M at its tip: 1 + cos x cosh x + (M/m) x (cos x sinh x - sin x cosh x)
    // = 0, omega^2 = x^4 E I / (m L^3); without m it is 3 E I / (M L^3). In the mean of upright and hanging the effect of
    // the weight cancels.
    let mass_kg = 0.05;
    let ratio = mass_kg / wire_kg();
    let x = root(|x| 1.0 + x.cos() * x.cosh() + ratio * x * (x.cos() * x.sinh() - x.sin() * x.cosh()), 0.1, 1.87);
    let mean = |wire: &str| {
        let square = |hung| square_of(&on_slender(mass_kg, hung, wire), ModeKind::Rocking);
        square(true) + square(false)
    };
    let slower = mean("included") / mean("neglected");
    assert_relative_eq!(slower, x.powi(4) * ratio / 3.0, max_relative = 4e-3);
    assert!(slower < 0.97, "{slower}");
}

#[test]
fn half_of_the_wire_mass_moves_with_the_head() {
    let mass_kg = 0.05;
    let model = on_slender(mass_kg, false, "included");
    let weight_n = 9.80665 * (mass_kg + 0.5 * wire_kg());
    assert_relative_eq!(model.element_loads()[0].load_n.unwrap(), weight_n, max_relative = 1e-6);
    // Base and head that speed up as one are pushed by all of the head's mass and half of the wire's.
    let linear = model.linear().unwrap();
    let pushed = linear.mass * linear.rigid_motion - linear.base_mass;
    for k in 0..3 {
        assert_relative_eq!(pushed[(k, k)], mass_kg + 0.5 * wire_kg(), max_relative = 1e-6);
    }
}
