//! Linkages of several elements compared with closed forms.

use crate::dynamics::heads::{built, cord, floating, jointed, moored, states, suspended, upright_spring};
use approx::assert_relative_eq;
use nalgebra::Matrix2;
use std::f64::consts::{PI, TAU};
use zsim::dynamics::{HeadModel, ModeKind};
use zsim::elasticity::{Coil, Matrix6, Moduli};
use zsim::geometry::{Kinematics, Pose, STANDARD_GRAVITY_M_PER_S2 as G, Vector};
use zsim::motion::BaseMotion;

/// Mass and inertias of `suspended`'s head.
const M: f64 = 0.40;
const I: f64 = 9e-4;
const I_ZZ: f64 = 4e-4;

fn model(place: [f64; 3], elements: &str) -> HeadModel {
    built(&suspended(place, elements)).unwrap()
}

fn frequency(model: &HeadModel, kind: ModeKind) -> f64 {
    model.linear_modes().iter().find(|mode| mode.kind == kind).unwrap().frequency_hz
}

/// Two parallel ropes along x, `half` from the middle, attached `above` the centre of mass.
fn ropes(half: f64, above: f64, length_m: f64) -> HeadModel {
    let rope = |x: f64| cord([x, 0.0, 0.0], [x, 0.0, above], length_m, 2e6);
    model([0.0, 0.0, -length_m - above], &(rope(half) + &rope(-half)))
}

#[test]
fn a_head_on_ropes_swings_as_a_compound_pendulum() {
    let (l, d) = (0.5, 0.06);
    let model = ropes(0.03, d, l);
    // Across the ropes' plane, a double pendulum: rope l at angle a, head at angle b about the attachment d above its
    // centre: M = (m l^2, m l d; m l d, I + m d^2), K = m g diag(l, d).
    let mass = Matrix2::new(M * l * l, M * l * d, M * l * d, I + M * d * d);
    let squares = (mass.try_inverse().unwrap() * Matrix2::new(M * G * l, 0.0, 0.0, M * G * d)).complex_eigenvalues();
    for square in squares.iter() {
        let expected = square.re.sqrt() / TAU;
        let nearest = model.linear_modes().iter().map(|mode| mode.frequency_hz / expected - 1.0);
        let nearest = nearest.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
        assert!(nearest.abs() < 1e-4, "no mode at {expected} Hz: nearest has a relative difference of {nearest}");
    }
    // In the ropes' plane the head stays level, a point mass on length l: sqrt(g/l). About the vertical the square of
    // the angular frequency is m g a^2 / (l I_zz).
    assert_eq!(model.linear_modes()[0].kind, ModeKind::Rocking);
    let all: Vec<f64> = model.linear_modes().iter().map(|mode| mode.frequency_hz).collect();
    let level = (G / l).sqrt() / TAU;
    assert!(all.iter().any(|hz| (hz / level - 1.0).abs() < 1e-3), "{level} Hz is not among {all:?}");
    let yaw = (M * G * 0.03 * 0.03 / (l * I_ZZ)).sqrt() / TAU;
    assert_relative_eq!(frequency(&model, ModeKind::Yaw), yaw, max_relative = 1e-3);
}

#[test]
fn parallel_springs_add_up_and_have_rotational_stiffness_from_their_levers() {
    let at = |places: &[[f64; 2]]| {
        let springs: String = places.iter().map(|[x, y]| upright_spring([*x, *y, 0.0], [*x, *y, -0.04])).collect();
        model([0.0, 0.0, 0.12], &springs)
    };
    let stiffness = |places: &[[f64; 2]]| -> Matrix6 { at(places).linear().unwrap().stiffness };
    let moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };
    let wahl = Coil::new(0.020, 0.0025, 8.0, 0.080, moduli).unwrap().axial_n_per_m();
    let along = stiffness(&[[0.0; 2]; 3])[(2, 2)] / 3.0;
    // The pitch of the coils and the shear of the wire make the spring softer than Wahl's.
    assert_relative_eq!(along, wahl, max_relative = 0.02);
    let (a, r) = (0.03, 0.05);
    let (s, c) = (120.0_f64.to_radians()).sin_cos();
    for (apart, together, sum_of_squares) in [
        (stiffness(&[[a, 0.0], [-a, 0.0]]), stiffness(&[[0.0; 2]; 2]), 2.0 * a * a),
        (stiffness(&[[r, 0.0], [r * c, r * s], [r * c, -r * s]]), stiffness(&[[0.0; 2]; 3]), 1.5 * r * r),
    ] {
        // Axial stiffnesses add up. For a rotation about y each top moves by its lever x along its spring, which adds the sum
        // of k x^2. (The axial rate does not depend on the load, and the moments of the loads do not depend on the positions
        // of the springs.)
        assert_relative_eq!(apart[(2, 2)], together[(2, 2)], max_relative = 5e-4);
        assert_relative_eq!(apart[(0, 0)], together[(0, 0)], max_relative = 5e-4);
        assert_relative_eq!(apart[(4, 4)] - together[(4, 4)], along * sum_of_squares, max_relative = 5e-4);
    }
    // Each carries its part of the weight, but for the couplings.
    for bearing in at(&[[r, 0.0], [r * c, r * s], [r * c, -r * s]]).element_loads() {
        assert_relative_eq!(bearing.load_n.unwrap(), M * G / 3.0, max_relative = 0.01);
    }
}

#[test]
fn a_suspension_of_one_spring_equals_the_single_spring() {
    let table = crate::dynamics::heads::ReferenceHead { coil: [20.0, 2.5, 8.0, 80.0], ..Default::default() };
    // The reference head has its centre 70 mm above the spring, and the same inertias.
    let alone = table.model();
    let one = model([0.0, 0.0, 0.15], &upright_spring([0.0; 3], [0.0, 0.0, -0.07]));
    for (a, b) in one.linear_modes().iter().zip(alone.linear_modes()) {
        assert_eq!(a.kind, b.kind);
        assert_relative_eq!(a.frequency_hz, b.frequency_hz, max_relative = 1e-6);
    }
}

#[test]
fn taut_cables_have_the_lateral_stiffness_of_tension_over_length() {
    // A cross of four cables in the plane of y and z, 0.2 m long, with 50 N of tension: across the plane 4 T / L.
    let (length_m, tension_n, ea_n, r) = (0.2, 50.0, 1e5, 0.03);
    let unstretched_m = length_m / (1.0 + tension_n / ea_n);
    let cables: String = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
        .map(|e: [f64; 3]| cord(e.map(|x| x * (r + length_m)), e.map(|x| x * r), unstretched_m, ea_n))
        .concat();
    let stiffness = model([0.0; 3], &cables).linear().unwrap().stiffness;
    assert_relative_eq!(stiffness[(0, 0)], 4.0 * tension_n / length_m, max_relative = 1e-3);
    // Along y two of the cables stretch.
    let along = 2.0 * ea_n / unstretched_m + 2.0 * tension_n / length_m;
    assert_relative_eq!(stiffness[(1, 1)], along, max_relative = 1e-3);
}

#[test]
fn a_float_heaves_and_rolls_as_a_ship() {
    let added = 0.15;
    let (radius, bottom) = (0.08, -0.07);
    let area = PI * radius * radius;
    let model = model([0.0, 0.0, 0.05], &(floating([0.0, 0.0, 0.0, added]) + &moored()));
    let draft = M / (1000.0 * area);
    let rest = model.base_from_head_at_rest().translation.z;
    // The soft cords pull horizontally.
    assert_relative_eq!(rest + bottom, -draft, max_relative = 0.01);
    let mooring = {
        let without = 1000.0 * G * area;
        model.linear().unwrap().stiffness[(2, 2)] - without
    };
    assert!(mooring.abs() < 0.05 * 1000.0 * G * area, "{mooring} N/m of mooring");
    let bob = ((1000.0 * G * area + mooring) / (M + added)).sqrt() / TAU;
    assert_relative_eq!(frequency(&model, ModeKind::Bounce), bob, max_relative = 0.01);
    // Righting stiffness: rho g (I_water + V (centre of buoyancy - centre of mass)), with the second moment of the
    // waterline area pi r^4 / 4.
    let without_cords = suspended([0.0, 0.0, 0.05], &floating([0.0; 4]));
    let error = built(&without_cords).unwrap_err().to_string();
    assert!(error.contains("resists a shift along"), "{error}");
    let righting = 1000.0 * G * (PI * radius.powi(4) / 4.0) + M * G * (bottom + 0.5 * draft);
    let of_cords = {
        let stiffness = model.linear().unwrap().stiffness;
        stiffness[(4, 4)] - righting
    };
    // Three cords of 0.4 N/m with 0.03 N of tension at a radius of 80 mm.
    assert!(of_cords.abs() < 0.1 * righting, "{of_cords} of {righting} N m/rad");
}

/// A base that accelerates to a constant yaw rate within 0.1 s.
struct Spinning {
    rate_rad_per_s: f64,
}

impl BaseMotion for Spinning {
    fn at(&self, t_s: f64) -> Kinematics {
        let (rate, onset_s) = (self.rate_rad_per_s, 0.1);
        let u = (t_s / onset_s).clamp(0.0, 1.0);
        // Rate (1 - cos(pi u)) / 2 of the final rate.
        let turned = rate * (onset_s * 0.5 * (u - (PI * u).sin() / PI) + (t_s - onset_s).max(0.0));
        let mut now = Kinematics::at_rest(Pose::rotation(Vector::z() * turned));
        now.angular_velocity_in_world.z = 0.5 * rate * (1.0 - (PI * u).cos());
        now.angular_acceleration_in_world.z = 0.5 * rate * PI / onset_s * (PI * u).sin();
        now
    }
}

#[test]
fn a_rotating_vessel_drags_its_float() {
    // I w' = -c (w - base) without mooring: the difference from the base's rate decays as exp(-c t / I).
    let (drag, rate) = (0.002, 0.4);
    let loose: String = [0.0_f64, 120.0, 240.0]
        .map(|degrees| {
            let (s, c) = degrees.to_radians().sin_cos();
            cord([3.0 * c, 3.0 * s, 0.02], [1e-4 * c, 1e-4 * s, -0.03], 2.9, 0.5)
        })
        .concat();
    let model = model([0.0, 0.0, 0.05], &(floating([0.5, 0.0, drag, 0.0]) + &loose));
    let path = states(&model, &Spinning { rate_rad_per_s: rate }, 1e-3, 0.6);
    let missing = |k: usize| rate - path[k].head.angular_velocity_in_world.z;
    assert!(missing(150) > 0.3 * rate, "{}", missing(150));
    assert_relative_eq!(missing(550) / missing(150), (-drag * 0.4 / I_ZZ).exp(), max_relative = 0.01);
}

#[test]
fn a_float_follows_its_vessel() {
    // Accelerating fluid exerts on the float the force that it would exert on the displaced fluid, so that the head
    // follows vertical motion at once.
    let model = model([0.0, 0.0, 0.05], &(floating([0.0; 4]) + &moored()));
    let response = model.frequency_response(&model.default_points());
    for freq_hz in [0.5, 2.0, 5.0, 9.0] {
        let gain = response.gain(zsim::motion::Axis::Z, freq_hz, zsim::dynamics::AccelerationKind::Kinematic);
        assert_relative_eq!(gain, 1.0, max_relative = 1e-4);
    }
}

#[test]
fn drag_damps_a_float_as_in_the_closed_form() {
    // Damping ratio in heave: c / (2 sqrt(k m)).
    let drag = 0.8;
    let model = model([0.0, 0.0, 0.05], &(floating([drag, 0.0, 0.0, 0.0]) + &moored()));
    let bob = model.linear_modes().iter().find(|mode| mode.kind == ModeKind::Bounce).unwrap();
    assert_relative_eq!(bob.damping_ratio, drag / (2.0 * M * bob.frequency_hz * TAU), max_relative = 1e-3);
}

#[test]
fn a_universal_joint_has_two_rocking_modes_with_the_stiffness_of_spring_less_gravity() {
    let (k, h) = (0.7, 0.07);
    let model = model([0.0, 0.0, 0.07], &jointed(k));
    let expected = ((k - M * G * h) / (I + M * h * h)).sqrt() / TAU;
    assert_eq!(model.linear_modes().len(), 2);
    for mode in model.linear_modes() {
        assert_eq!(mode.kind, ModeKind::Rocking);
        assert_relative_eq!(mode.frequency_hz, expected, max_relative = 1e-7);
    }
    // Tilted slowly, the base lifts the head by k / (k - m g h); shifted and turned about the vertical, it takes it
    // along.
    let response = model.frequency_response(&model.default_points());
    let gain = |axis| response.gain(axis, 1e-6, zsim::dynamics::AccelerationKind::Kinematic);
    assert_relative_eq!(gain(zsim::motion::Axis::Pitch), k / (k - M * G * h), max_relative = 1e-6);
    for axis in [zsim::motion::Axis::Z, zsim::motion::Axis::Yaw] {
        assert_relative_eq!(
            response.gain(axis, 3.0, zsim::dynamics::AccelerationKind::Kinematic),
            1.0,
            max_relative = 1e-9
        );
    }
}

#[test]
fn the_axes_of_a_joint_stay_coincident_for_any_base_motion() {
    let model = model([0.0, 0.0, 0.07], &jointed(0.7));
    let mut lean = 0.0_f64;
    for state in states(&model, &crate::dynamics::heads::Nodding { amount_rad: 0.1 }, 1e-3, 5.0) {
        let seen = state.base.world_from_body.inv_mul(&state.head.world_from_body);
        let pivot = seen * nalgebra::Point3::new(0.0, 0.0, -0.07);
        let (x, y) = (Vector::x(), seen.rotation * Vector::y());
        assert!(pivot.coords.norm() < 1e-12 && x.dot(&y).abs() < 1e-12, "{} m apart", pivot.coords.norm());
        lean = lean.max(seen.rotation.angle());
    }
    assert!(lean > 0.2, "leans by {lean} rad only");
}

#[test]
fn a_joint_without_springs_is_a_pendulum() {
    // Centre of mass 70 mm below the joint: sqrt(m g h / (I + m h^2)).
    let joint = "universal_joint((base_from_joint: (position_m: (0.0, 0.0, 0.0)), head_from_joint: (position_m: (0.0, 0.0, 0.07)),
        stiffness_nm_per_rad: (0.0, 0.0))),";
    let model = model([0.0; 3], joint);
    let expected = (M * G * 0.07 / (I + M * 0.07 * 0.07)).sqrt() / TAU;
    assert_relative_eq!(model.linear_modes()[0].frequency_hz, expected, max_relative = 1e-7);
}
