//! Contact of the coils of a spring in a simulation.

use super::heads::{BasePulse, ReferenceHead, built, states};
use std::f64::consts::TAU;
use zsim::dynamics::{CoilContact, ContactWatch, HeadModel, HeadSimulation, HeadState, LinkageSpec};
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
        assert!(text.starts_with(&format!("t = {:.2} s: the coils", touched.first_t_s)), "{text}");
        // A tenth of the nod, and gaps three times as large, are without contact.
        assert_eq!(contact(46.0, 0.6, segments), None);
        assert_eq!(contact(66.0, 3.0, segments), None);
    }
}

#[test]
fn a_pressed_spring_touches_at_its_solid_length_and_a_pulled_one_never() {
    // k = 79.3e9 * 0.003^4 / (8 * 0.025^3 * 12) = 4282 N/m: the head of 0.4 kg compresses it by 0.92 mm; the top may go down by
    // 46 - 36 mm from the free length. The clamped ends of the wire bend the spring, so that its coils close on one side first,
    // 0.02 mm earlier.
    let head = ReferenceHead { coil: [25.0, 3.0, 12.0, 46.0], ..ReferenceHead::default() }.model();
    let rest = *head.base_from_head_at_rest();
    let moved = |dz_m: f64| {
        let pose = Pose::translation(0.0, 0.0, dz_m) * rest;
        let mut watch = ContactWatch::new(&head);
        watch.check(0.0, &Kinematics::at_rest(Pose::identity()), &Kinematics::at_rest(pose));
        watch.contact()
    };
    let open_m = 0.010 - 0.4 * 9.80665 / 4282.0;
    assert_eq!(moved(-0.96 * open_m), None);
    assert_eq!(moved(0.02), None);
    let touched = moved(-open_m - 0.0012).expect("beyond the solid length");
    // 1.2 mm too far are 0.1 mm for each of the 12 gaps.
    assert!((touched.least_gap_mm + 0.12).abs() < 0.02, "{touched:?}");
}

/// Mean energy of a head above that at rest, J, in the first and the last second of 10 s after a pulse of the base that made the
/// coils clash; and the largest overlap of neighbouring coils, mm. The spring of 4282 N/m bounces at 16 Hz.
fn energies_of_clashes(pulse: &BasePulse, segments: usize, step_s: f64) -> (f64, f64, f64) {
    let model = ReferenceHead { coil: [25.0, 3.0, 12.0, 46.0], segments, ..ReferenceHead::default() }.model();
    let mut watch = ContactWatch::new(&model);
    let (mut first, mut last, mut at_rest) = (Vec::new(), Vec::new(), None);
    for state in HeadSimulation::new(&model, pulse, step_s).unwrap().take((10.0 / step_s) as usize) {
        let state = state.unwrap();
        watch.check(state.t_s, &state.base, &state.head);
        let energy = model.energy_j(&state.base.world_from_body, &state.head).unwrap();
        let above = energy - *at_rest.get_or_insert(energy);
        match state.t_s - pulse.period_s {
            since_s if since_s > 9.0 - pulse.period_s => last.push(above),
            since_s if since_s > 0.0 && since_s < 1.0 => first.push(above),
            _ => {}
        }
    }
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    (mean(&first), mean(&last), -watch.contact().expect("the coils touch").least_gap_mm)
}

/// A spring without contact would be shorter than its wire.
#[test]
fn closed_coils_return_the_energy_of_the_head_for_any_step() {
    let pulse = BasePulse { axis: 2, amount: 0.02, period_s: 0.08 };
    for (segments, step_s) in [(1, 2.5e-4), (1, 5e-4), (1, 1e-3), (1, 2e-3), (1, 4e-3), (4, 1e-3), (4, 4e-3)] {
        let (first, last, overlap_mm) = energies_of_clashes(&pulse, segments, step_s);
        // The head sways at 25 Hz, so that the energy of 4 ms steps oscillates by some per cent.
        let allowed = if step_s < 4e-3 { 0.01 } else { 0.1 };
        assert!((last / first - 1.0).abs() < allowed, "{segments} segments, {step_s} s: {first} J, then {last} J");
        // The energy in the contact, 24 times as stiff as the spring, is at most that of the head. After some bounces the head also
        // rocks, so that the coils overlap more on one side: up to 2.5 times.
        let largest_mm = 4e3 * (2.0 * first / (24.0 * 4282.0)).sqrt();
        assert!(overlap_mm * 12.0 < largest_mm, "{segments} segments, {step_s} s: {overlap_mm} mm, {largest_mm} mm");
    }
}

#[test]
fn coils_that_touch_on_one_side_return_the_energy_too() {
    let pulse = BasePulse { axis: 4, amount: 0.4, period_s: 0.2 };
    for (segments, step_s) in [(1, 1e-3), (1, 4e-3), (2, 1e-3), (2, 4e-3), (4, 1e-3), (4, 4e-3)] {
        let (first, last, overlap_mm) = energies_of_clashes(&pulse, segments, step_s);
        assert!(overlap_mm > 0.05, "{overlap_mm} mm");
        assert!((last / first - 1.0).abs() < 0.01, "{segments} segments, {step_s} s: {first} J, then {last} J");
    }
}

/// Ratio of the speeds, after and before, at the first clash behind a pulse of the base along the spring.
///
/// From the energies at the highest points before and after it. The spring of 38 mm closes 1.08 mm below its rest.
fn speed_ratio_of_a_clash(restitution: f64, step_s: f64) -> f64 {
    let head = ReferenceHead { coil: [25.0, 3.0, 12.0, 38.0], ..ReferenceHead::default() };
    let key = format!("material: spring_steel, coil_restitution: {restitution:?},");
    let model = built(&head.text().replace("material: spring_steel,", &key)).unwrap();
    let pulse = BasePulse { axis: 2, amount: 0.03, period_s: 0.08 };
    let open_m = 0.002 - 0.4 * 9.80665 / 4282.0;
    let path = states(&model, &pulse, step_s, 0.5);
    let energy = |state: &HeadState| model.energy_j(&state.base.world_from_body, &state.head).unwrap();
    let moving = |state: &HeadState| energy(state) - energy(&path[0]) - 0.5 * 4282.0 * open_m * open_m;
    let free = path.windows(2).filter(|pair| pair[0].t_s > pulse.period_s);
    let highest = free.filter(|pair| pair[0].head.velocity_in_world.z > 0.0 && pair[1].head.velocity_in_world.z <= 0.0);
    let tops: Vec<f64> = highest.map(|pair| moving(&pair[0])).collect();
    (tops[1] / tops[0]).sqrt()
}

/// The force that closes the spring shortens the contact, so that the ratio is a little above the coefficient.
#[test]
fn a_straight_clash_has_the_coefficient_of_restitution() {
    for (restitution, step_s) in [(1.0, 1e-3), (0.9, 1e-3), (0.8, 2.5e-4), (0.8, 1e-3), (0.8, 2e-3), (0.6, 1e-3)] {
        let ratio = speed_ratio_of_a_clash(restitution, step_s);
        assert!((ratio / restitution - 1.0).abs() < 0.05, "{ratio} for {restitution} at {step_s} s");
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
