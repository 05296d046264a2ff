//! Contact of the coils of a spring in a simulation.

use super::heads::{BasePulse, ReferenceHead};
use std::f64::consts::TAU;
use zsim::dynamics::{CoilContact, ContactWatch, HeadModel, HeadSimulation, LinkageSpec};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim::motion::BaseMotion;
use zsim::spec::{Source, parse};

/// A base that pitches about the foot of the spring, at its origin.
struct Pitching {
    amplitude_rad: f64,
    frequency_hz: f64,
}

impl BaseMotion for Pitching {
    fn at(&self, t_s: f64) -> Kinematics {
        let omega = TAU * self.frequency_hz;
        let (sin, cos) = (omega * t_s).sin_cos();
        let y = Vector::y() * self.amplitude_rad;
        Kinematics {
            world_from_body: Pose::from_parts(Vector::zeros().into(), Rotation::from_scaled_axis(y * sin)),
            velocity_in_world: Vector::zeros(),
            angular_velocity_in_world: y * (omega * cos),
            acceleration_in_world: Vector::zeros(),
            angular_acceleration_in_world: y * (-omega * omega * sin),
        }
    }
}

/// The contact of a spring of 12 coils of 3 mm and this free length, under a nod of its base at the rocking frequency.
fn contact(free_mm: f64, nod_deg: f64, segments: usize) -> Option<CoilContact> {
    let coil = [25.0, 3.0, 12.0, free_mm];
    let model = ReferenceHead { coil, segments, damping: [0.06; 4], ..ReferenceHead::default() }.model();
    let frequency_hz = model.linear_modes()[0].frequency_hz;
    let motion = Pitching { amplitude_rad: nod_deg.to_radians(), frequency_hz };
    let mut watch = ContactWatch::new(&model);
    for state in HeadSimulation::new(&model, &motion, 1e-3).unwrap().take(8000) {
        let state = state.unwrap();
        watch.check(state.t_s, &state.base, &state.head);
    }
    watch.contact()
}

#[test]
fn coils_touch_at_the_bend_that_closes_their_gaps() {
    // The gaps of 46 - 36 - 0.9 mm close on the inner side of an arc of 9.1 mm / 12.5 mm = 41.6 degrees. Under a tilted head the
    // moment grows towards the foot, so that the lowest gap closes at a smaller bend; it is at most twice the mean moment.
    for segments in [2, 4] {
        let touched = contact(46.0, 6.0, segments).expect("the coils touch");
        let uniform_deg = (9.1_f64 / 12.5).to_degrees();
        assert!(touched.first_bend_deg > 0.5 * uniform_deg && touched.first_bend_deg < uniform_deg, "{touched:?}");
        assert!(touched.contact_s > 0.0 && touched.least_gap_mm < 0.0, "{touched:?}");
        let text = touched.warning();
        assert!(text.starts_with(&format!("warning: t = {:.2} s: ", touched.first_t_s)), "{text}");
        // A tenth of the nod, and gaps three times as large, are without contact.
        assert_eq!(contact(46.0, 0.6, segments), None);
        assert_eq!(contact(66.0, 3.0, segments), None);
    }
}

#[test]
fn a_pressed_spring_touches_at_its_solid_length_and_a_pulled_one_never() {
    // k = 79.3e9 * 0.003^4 / (8 * 0.025^3 * 12) = 4282 N/m: the head of 0.4 kg compresses it by 0.92 mm; the top may go down by
    // 46 - 36 mm from the free length.
    let head = ReferenceHead { coil: [25.0, 3.0, 12.0, 46.0], ..ReferenceHead::default() }.model();
    let rest = *head.base_from_head_at_rest();
    let moved = |dz_m: f64| {
        let pose = Pose::translation(0.0, 0.0, dz_m) * rest;
        let mut watch = ContactWatch::new(&head);
        watch.check(0.0, &Kinematics::at_rest(Pose::identity()), &Kinematics::at_rest(pose));
        watch.contact()
    };
    let open_m = 0.010 - 0.4 * 9.80665 / 4282.0;
    assert_eq!(moved(-0.99 * open_m), None);
    assert_eq!(moved(0.02), None);
    let touched = moved(-open_m - 0.0012).expect("beyond the solid length");
    // 1.2 mm too far are 0.1 mm for each of the 12 gaps.
    assert!((touched.least_gap_mm + 0.1).abs() < 2e-3, "{touched:?}");
}

/// A base that rises and sinks by 20 mm makes the coils clash; a spring without contact would be shorter than its wire.
#[test]
fn closed_coils_return_the_energy_of_the_head() {
    for segments in [1, 4] {
        let model = ReferenceHead { coil: [25.0, 3.0, 12.0, 46.0], segments, ..ReferenceHead::default() }.model();
        let pulse = BasePulse { axis: 2, amount: 0.02, period_s: 0.08 };
        let mut watch = ContactWatch::new(&model);
        let (mut energies, mut at_rest) = (Vec::new(), None);
        for state in HeadSimulation::new(&model, &pulse, 2.5e-4).unwrap().take(40_000) {
            let state = state.unwrap();
            watch.check(state.t_s, &state.base, &state.head);
            let energy = model.energy_j(&state.base.world_from_body, &state.head).unwrap();
            let at_rest = *at_rest.get_or_insert(energy);
            if state.t_s > pulse.period_s {
                energies.push(energy - at_rest);
            }
        }
        let touched = watch.contact().expect("the coils touch");
        // The energy in the contact, 24 times as stiff as the spring of 4282 N/m, is at most that of the head.
        let overlap_m = (2.0 * energies[0] / (24.0 * 4282.0)).sqrt();
        assert!(-touched.least_gap_mm * 12.0 < 1e3 * overlap_m, "{touched:?} {overlap_m}");
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let tenth = energies.len() / 10;
        let (first, last) = (mean(&energies[..tenth]), mean(&energies[energies.len() - tenth..]));
        assert!((last / first - 1.0).abs() < 3e-3, "{segments} segments: {first} J, then {last} J");
    }
}

#[test]
fn rigid_ends_are_a_shorter_spring_between_blocks() {
    // Closed and ground ends of 3 mm wire take 3 mm at each end: 126 mm with them are 120 mm of active coils between blocks.
    let coil = |length_mm: f64, ends: &str| {
        format!(
            "coil(coil_diameter_mm: 25.0, wire_diameter_mm: 3.0, active_coils: 12.0, free_length_mm: {length_mm:.1}, ends: \
             {ends}, material: spring_steel)"
        )
    };
    let head = |spring: String, block_m: f64| {
        let (mut spec, source) = zsim::dynamics::load("handheld").unwrap();
        if let LinkageSpec::Spring { spring: of_spec, base_from_spring, head_from_spring, .. } = &mut spec.linkage {
            *of_spec = parse(&Source::in_memory("the spring", spring)).unwrap();
            base_from_spring.position_m[2] += block_m;
            head_from_spring.position_m[2] -= block_m;
        }
        HeadModel::new(&spec, &source).unwrap()
    };
    let (whole, parts) = (head(coil(126.0, "closed_ground"), 0.0), head(coil(120.0, "active_only"), 0.003));
    let frequencies = |model: &HeadModel| model.linear_modes().iter().map(|mode| mode.frequency_hz).collect::<Vec<_>>();
    for (a, b) in frequencies(&whole).iter().zip(frequencies(&parts)) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    let rise = whole.base_from_head_at_rest().inv_mul(parts.base_from_head_at_rest());
    assert!(rise.translation.vector.norm() < 1e-9, "{rise}");
}
