use crate::dynamics::heads::{FixedBase, ReferenceHead, built, shipped, states};
use approx::assert_relative_eq;
use nalgebra::{Matrix2, Vector2};
use zsim::dynamics::{HeadSpec, LinkageSpec, ModeKind};
use zsim::elasticity::{Coil, Moduli, SpringSpec, loaded_stiffness};
use zsim::geometry::{Kinematics, Pose, STANDARD_GRAVITY_M_PER_S2 as G, Vector, from_roll_pitch_yaw};
use zsim::motion::BaseMotion;
use zsim::spec::{Kind, load, names};

#[test]
fn rocking_frequencies_agree_with_reference_values_for_any_number_of_segments() {
    // Reference frequencies of a 0.40 kg head with 9e-4 kg m^2 and its centre of mass 70 mm above the spring, upright
    // and hanging, Hz.
    let table = [
        ([25.0, 2.5, 10.0, 100.0], true, 1.73),
        ([25.0, 3.0, 12.0, 120.0], false, 0.98),
        ([25.0, 3.0, 12.0, 120.0], true, 1.90),
        ([25.0, 3.0, 8.0, 80.0], false, 1.78),
        ([25.0, 3.0, 8.0, 80.0], true, 2.52),
    ];
    for (coil, hanging, expected_hz) in table {
        for segments in [1, 2, 4, 8] {
            let model = ReferenceHead { coil, hanging, segments, ..ReferenceHead::default() }.model();
            let rocking = &model.linear_modes()[0];
            assert_eq!(rocking.kind, ModeKind::Rocking);
            assert_relative_eq!(rocking.frequency_hz, expected_hz, max_relative = 0.02);
        }
    }
}

#[test]
fn the_static_deflection_is_weight_over_axial_stiffness() {
    // G d^4 / (8 D^3 n) = 79.3e9 0.003^4 / (8 0.025^3 12) = 4282.2 N/m under 0.40 kg: 0.916 mm, to 2 % as the formula neglects
    // the pitch of the coils and the shear of the wire.
    let sag = 0.40 * G / 4282.2;
    for (hanging, length_m) in [(false, 0.12 - sag), (true, 0.12 + sag)] {
        let model = ReferenceHead { hanging, ..ReferenceHead::default() }.model();
        let rest = model.base_from_head_at_rest().translation.vector;
        assert_relative_eq!(rest.z.abs(), length_m, epsilon = 0.02 * sag);
        // The couplings shift it by tenths of a millimetre.
        assert!(rest.xy().norm() < 5e-4, "{rest}");
    }
}

#[test]
fn a_head_on_a_tilted_base_rests_at_the_inclination_of_the_loaded_column() {
    let model = ReferenceHead::default().model();
    let tilt = 0.002;
    let base = Pose::from_parts(Vector::new(3.0, -2.0, 1.0).into(), from_roll_pitch_yaw(0.0, tilt, 0.4));
    let path = states(&model, &FixedBase(base), 1e-3, 1.0);
    // In base axes gravity acts with m g tilt along x at 70 mm above the top. The top's (x, theta) solve
    // [K_xx, K_xt; K_xt, K_tt - m g h] (x, theta) = m g tilt (1, h), with the stiffness K of the loaded column.
    let moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };
    let column = Coil::new(0.025, 0.003, 12.0, 0.12, moduli).unwrap().under_load(0.40 * G).unwrap();
    let k = loaded_stiffness(&column).unwrap();
    let (weight, h) = (0.40 * G, 0.07);
    let stiffness = Matrix2::new(k[(0, 0)], k[(0, 4)], k[(0, 4)], k[(4, 4)] - weight * h);
    let expected = stiffness.try_inverse().unwrap() * Vector2::new(1.0, h) * weight * tilt;
    let first = base.inv_mul(&path[0].head.world_from_body);
    // Relative to the rest on an upright base. A percent of stiffness is two of the deflection, because gravity takes half of it.
    let upright = model.base_from_head_at_rest();
    let (shifted, turned) = (first.translation.x - upright.translation.x, first.rotation * upright.rotation.inverse());
    assert_relative_eq!(shifted, expected.x, max_relative = 0.04);
    assert_relative_eq!(turned.scaled_axis().y, expected.y, max_relative = 0.04);
    for state in &path {
        let moved = base.inv_mul(&state.head.world_from_body).inv_mul(&first);
        assert!(moved.translation.vector.norm() < 1e-10 && moved.rotation.angle() < 1e-9, "{} s: {moved}", state.t_s);
    }
}

struct ConstantVelocity;

impl BaseMotion for ConstantVelocity {
    fn at(&self, t_s: f64) -> Kinematics {
        let velocity = Vector::new(1.4, -0.3, 0.1);
        let mut now =
            Kinematics::at_rest(Pose::from_parts((velocity * t_s).into(), from_roll_pitch_yaw(0.0, 0.0, 1.0)));
        now.velocity_in_world = velocity;
        now
    }
}

#[test]
fn a_head_on_a_base_at_constant_velocity_stays_at_rest() {
    let model = shipped("handheld");
    for state in states(&model, &ConstantVelocity, 1e-3, 2.0) {
        let relative = state.base.world_from_body.inv_mul(&state.head.world_from_body);
        let moved = relative.inv_mul(model.base_from_head_at_rest());
        assert!(moved.translation.vector.norm() < 1e-10 && moved.rotation.angle() < 1e-9, "{} s: {moved}", state.t_s);
        assert_relative_eq!(state.head.velocity_in_world, Vector::new(1.4, -0.3, 0.1), epsilon = 1e-9);
        assert_relative_eq!(state.head.acceleration_in_world, Vector::zeros(), epsilon = 1e-6);
    }
}

#[test]
fn the_handheld_head_is_light_and_rocks_between_1_and_1_5_hz() {
    let model = shipped("handheld");
    assert!(model.body().mass_kg < 0.5);
    let modes = model.linear_modes();
    for rocking in &modes[..2] {
        assert_eq!(rocking.kind, ModeKind::Rocking);
        assert!((1.0..1.5).contains(&rocking.frequency_hz), "{} Hz", rocking.frequency_hz);
    }
    let kinds: Vec<_> = modes.iter().map(|mode| mode.kind).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == ModeKind::Sway).count(), 2);
    assert!(kinds.contains(&ModeKind::Bounce) && kinds.contains(&ModeKind::Yaw));
}

#[test]
fn gravity_amplifies_a_slow_tilt_of_the_base() {
    // Rotation of an upright head relative to that of its base at zero frequency: 1.58 and 2.64; 1 about z.
    for (coil, gain) in [([25.0, 3.0, 8.0, 80.0], 1.58), ([25.0, 3.0, 12.0, 120.0], 2.64)] {
        let model = ReferenceHead { coil, ..ReferenceHead::default() }.model();
        let linear = model.linear().unwrap();
        let followed = linear.stiffness.try_inverse().unwrap() * linear.base_stiffness;
        assert_relative_eq!(followed[(3, 3)], gain, max_relative = 0.02);
        assert_relative_eq!(followed[(4, 4)], gain, max_relative = 0.02);
        // Shifts and yaw of the base are followed one to one.
        for k in [0, 1, 2, 5] {
            assert_relative_eq!(followed[(k, k)], 1.0, epsilon = 1e-6);
        }
        // Joint rigid motion of base and head is undamped: Cb is C times the rigid motion of the head with its base.
        assert_relative_eq!(linear.base_damping.column(2), linear.damping.column(2), epsilon = 1e-12);
    }
}

#[test]
fn every_shipped_head_is_valid_and_stays_at_rest() {
    for name in names(Kind::Head) {
        let model = shipped(&name);
        let rests_s = match load::<HeadSpec>(&name).unwrap().linkage {
            LinkageSpec::Actuated { motor, .. } => motor.still_s,
            _ => 10.0,
        };
        let path = states(&model, &FixedBase(Pose::identity()), 1e-3, rests_s);
        let moved = path[path.len() - 1].head.world_from_body.inv_mul(model.base_from_head_at_rest());
        assert!(moved.translation.vector.norm() < 1e-9, "{name} moves by {moved}");
    }
    for name in names(Kind::Spring) {
        load::<SpringSpec>(&name).unwrap().design().unwrap();
    }
}

#[test]
fn a_head_can_refer_to_a_spring_spec_by_name() {
    let text = ReferenceHead::default().text();
    let (from, to) = (text.find("coil(").unwrap(), text.find("segments").unwrap());
    let named = built(&format!("{}named(\"25x3x12x120\"), {}", &text[..from], &text[to..])).unwrap();
    assert_eq!(named.linear_modes(), ReferenceHead::default().model().linear_modes());
}
