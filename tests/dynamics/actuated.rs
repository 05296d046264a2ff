use crate::dynamics::heads::{FixedBase, Nodding, built, shipped, states};
use std::f64::consts::{FRAC_PI_2, TAU};
use zsim::dynamics::{HeadModel, HeadState};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim::sensors::Lidar;
use zsim::spec::{Kind, find, parse};

/// A head off the axis of its motor, with an oblique axis.
fn text(turn: &str) -> String {
    format!(
        "(
    parts: [block(name: \"head\", mass_kg: 1.0, size_m: (0.1, 0.1, 0.1), centre_m: (0.0, 0.0, 0.0))],
    head_from_laser: (position_m: (0.0, 0.0, 0.0)),
    head_from_imu: (position_m: (0.0, 0.0, 0.0)),
    linkage: actuated(
        base_from_head: (position_m: (0.1, 0.05, 0.3), roll_pitch_yaw_deg: (10.0, -20.0, 30.0)),
        motor: (
            axis_in_head: (1.0, 2.0, -0.5),
            pivot_in_head_m: (-0.2, 0.1, 0.05),
            turn: {turn},
            still_s: 0.5,
            start_s: 0.8,
        ),
    ),
)"
    )
}

/// Whether central differences at `t_s` do not include a step of the motor's third derivative.
///
/// The steps are at the start and when the motor reaches full rate.
fn is_smooth(t_s: f64, step_s: f64) -> bool {
    [0.5, 1.3].iter().all(|step_at_s| (t_s - step_at_s).abs() > 1.5 * step_s)
}

/// Largest differences of a path's velocities and accelerations from central differences of its poses and velocities.
fn derivative_errors(path: &[HeadState], step_s: f64) -> [f64; 4] {
    let mut worst = [0.0_f64; 4];
    for three in path.windows(3).filter(|three| is_smooth(three[1].t_s, step_s)) {
        let [before, now, after] = [&three[0].head, &three[1].head, &three[2].head];
        let between = |a: &Vector, b: &Vector| (b - a) / (2.0 * step_s);
        let (a, b) = (&before.world_from_body, &after.world_from_body);
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis() / (2.0 * step_s);
        let differences = [
            between(&a.translation.vector, &b.translation.vector) - now.velocity_in_world,
            turn - now.angular_velocity_in_world,
            between(&before.velocity_in_world, &after.velocity_in_world) - now.acceleration_in_world,
            between(&before.angular_velocity_in_world, &after.angular_velocity_in_world)
                - now.angular_acceleration_in_world,
        ];
        worst = std::array::from_fn(|k| worst[k].max(differences[k].norm()));
    }
    worst
}

#[test]
fn an_actuated_heads_velocities_are_the_derivatives_of_its_poses() {
    for turn in ["spin(rate_hz: 1.3)", "nod(amplitude_deg: 50.0, frequency_hz: 0.9)"] {
        let model = built(&text(turn)).unwrap();
        let base = Nodding { amount_rad: 0.2 };
        let worst = |step_s: f64| derivative_errors(&states(&model, &base, step_s, 3.0), step_s);
        let (coarse, fine) = (worst(2e-3), worst(1e-3));
        // The error of central differences is h^2 x''' / 6: a quarter at half the step, if there is no other error.
        for (quantity, (coarse, fine)) in coarse.iter().zip(&fine).enumerate() {
            assert!((3.8..4.2).contains(&(coarse / fine)), "{turn}, quantity {quantity}: {coarse} {fine}");
            assert!(*fine < 0.01, "{turn}, quantity {quantity}: {fine}");
        }
    }
}

#[test]
fn an_actuated_head_starts_at_rest_with_continuous_acceleration() {
    for turn in ["spin(rate_hz: 1.3)", "nod(amplitude_deg: 50.0, frequency_hz: 0.9)"] {
        let model = built(&text(turn)).unwrap();
        let path = states(&model, &FixedBase(Pose::identity()), 1e-3, 3.0);
        for state in &path[..=500] {
            assert_eq!(state.head, Kinematics::at_rest(*model.base_from_head_at_rest()), "{turn}");
        }
        // The largest third derivative, at the start: 60 / 0.8^2 times the rate of 8.2 rad/s; smaller for the nod.
        let most = 60.0 / 0.64 * 1.3 * TAU * 1e-3;
        for pair in path.windows(2) {
            let [a, b] = [&pair[0].head, &pair[1].head];
            let step = b.angular_acceleration_in_world - a.angular_acceleration_in_world;
            assert!(step.norm() < 1.05 * most, "{turn} at {} s: {}", pair[1].t_s, step.norm());
        }
    }
}

#[test]
fn the_rotation_is_as_specified_and_points_on_the_axis_do_not_move() {
    let model = built(&text("spin(rate_hz: 1.3)")).unwrap();
    let path = states(&model, &FixedBase(Pose::identity()), 1e-3, 3.0);
    let pivot = |state: &HeadState| state.head.world_from_body * nalgebra::Point3::new(-0.2, 0.1, 0.05);
    assert!(path.iter().all(|state| (pivot(state) - pivot(&path[0])).norm() < 1e-12));
    // At full rate from 1.3 s on, after half of the rotation at full rate since 0.5 s.
    for t_ms in [1_300_usize, 1_777, 2_950] {
        let turned = TAU * 1.3 * (0.4 + t_ms as f64 * 1e-3 - 1.3);
        let axis = nalgebra::Unit::new_normalize(Vector::new(1.0, 2.0, -0.5));
        let expected = model.base_from_head_at_rest().rotation * Rotation::from_axis_angle(&axis, turned);
        assert!(path[t_ms].head.world_from_body.rotation.angle_to(&expected) < 1e-9, "{t_ms} ms");
    }
    // A nod of 50 degrees at 0.9 Hz, at its amplitude at three quarters of its second period.
    let model = built(&text("nod(amplitude_deg: 50.0, frequency_hz: 0.9)")).unwrap();
    let path = states(&model, &FixedBase(Pose::identity()), 1e-3, 3.0);
    let angle = |state: &HeadState| {
        model.base_from_head_at_rest().rotation.angle_to(&state.head.world_from_body.rotation).to_degrees()
    };
    let most = path.iter().map(angle).fold(0.0, f64::max);
    assert!((most - 50.0).abs() < 1e-3, "{most}");
}

#[test]
fn half_a_revolution_of_the_spinning_lms291_covers_the_front_hemisphere() {
    let head = shipped("spinning");
    let source = find(Kind::Lidar, "lms291").unwrap();
    let lidar = Lidar::new(&parse(&source).unwrap(), &source).unwrap();
    let stand = Pose::translation(0.0, 0.0, 0.9);
    let path = states(&head, &FixedBase(stand), 1e-3, 6.0);
    // The middle ray does not move, 0.75 m above the ground.
    let mut seen = Vec::new();
    for scan in 0..38 {
        let start_s = 5.0 + f64::from(scan) * lidar.period_s();
        for beam in lidar.beams() {
            let instant = ((start_s + beam.offset_s) * 1e3).round() as usize;
            let laser = path[instant].head.world_from_body * head.head_from_laser();
            assert!((laser.translation.vector - Vector::new(0.0, 0.0, 0.75)).norm() < 1e-12);
            seen.push(laser.rotation * beam.direction_in_laser);
        }
    }
    assert!(seen.iter().all(|beam| beam.x > -1e-6), "there are returns from the rear");
    // A revolution has 75 scans: planes are at most 360 / 75 = 4.8 degrees apart, so a beam is within 2.4 + 0.5 degrees
    // of any direction. At the rim the head rotates by another 2.4 degrees in half a mirror revolution between the two
    // ends of the scan plane.
    let farthest = directions_before(2_000)
        .map(|to| seen.iter().map(|beam| beam.angle(&to)).fold(f64::INFINITY, f64::min).to_degrees())
        .fold(0.0, f64::max);
    assert!(farthest < 2.9 + 2.4, "{farthest} degrees from every beam");
}

/// Uniform directions over the hemisphere about x (golden spiral).
fn directions_before(count: u32) -> impl Iterator<Item = Vector> {
    (0..count).map(move |k| {
        let x = (f64::from(k) + 0.5) / f64::from(count);
        let (sin, cos) = (f64::from(k) * FRAC_PI_2 * 2.0 * (3.0 - 5_f64.sqrt())).sin_cos();
        let rim = (1.0 - x * x).sqrt();
        Vector::new(x, rim * cos, rim * sin)
    })
}

#[test]
fn invalid_motors_are_refused_with_their_line() {
    let fault = |from: &str, to: &str| {
        let right = text("spin(rate_hz: 1.0)");
        assert!(right.contains(from), "{from}");
        built(&right.replacen(from, to, 1)).unwrap_err().to_string()
    };
    for (from, to, line, part) in [
        ("rate_hz: 1.0", "rate_hz: 0.0", 10, "above 0, found 0"),
        ("rate_hz: 1.0", "rate_hz: NaN", 10, "found NaN"),
        ("rate_hz: 1.0", "rate_hz: 40.0", 10, "40.0 revolutions per second; the maximum is 15"),
        ("rate_hz: 1.0", "rate: 1.0", 10, "rate"),
        ("spin(rate_hz: 1.0)", "nod(amplitude_deg: 200.0, frequency_hz: 0.1)", 10, "the maximum is 180"),
        ("spin(rate_hz: 1.0)", "nod(amplitude_deg: 170.0, frequency_hz: 6.0)", 10, "17.8 revolutions per second"),
        ("(1.0, 2.0, -0.5)", "(0.0, 0.0, 0.0)", 8, "length zero"),
        ("(1.0, 2.0, -0.5)", "(0.0, inf, 0.0)", 8, "finite"),
        ("still_s: 0.5", "still_s: -0.5", 11, "at least 0, found -0.5"),
        ("start_s: 0.8", "start_s: 0.0", 12, "above 0, found 0"),
    ] {
        let error = fault(from, to);
        assert!(error.starts_with(&format!("head.ron:{line}:")) && error.contains(part), "{to}: {error}");
    }
}

#[test]
fn rigid_mounts_have_no_gains_and_no_spring() {
    use zsim::head::gains::{GainPlan, GainWatch, gain_curves};
    for (name, because) in
        [("spinning", "a motor turns the head"), ("nodding", "a motor turns the head"), ("trawling", "screwed")]
    {
        let head: HeadModel = shipped(name);
        assert!(head.linear_modes().is_empty() && head.linear().is_none());
        let error = gain_curves(&head, &GainPlan::default(), GainWatch::silent()).unwrap_err();
        let message = error.to_string();
        assert!(
            error.is_invalid_input() && message.contains(because) && message.contains("nothing to characterise"),
            "{message}"
        );
    }
}
