//! Faults that change the values of measurements.

use super::{MemorySink, reference, run, scenario, simulation, since_start_s, usual, with};
use zsim::geometry::{Vector, from_roll_pitch_yaw, gravity_in_world};
use zsim::measurement::ImuSample;
use zsim::simulation::Scenario;

/// Indices of samples whose values differ from the reference run with the same arrivals.
fn changed(faulty: &MemorySink) -> Vec<usize> {
    let pairs = faulty.samples.iter().zip(&reference().samples).enumerate();
    assert_eq!(faulty.samples.len(), reference().samples.len());
    pairs.filter(|(_, (a, b))| a != b).map(|(k, _)| k).collect()
}

#[test]
fn clipping_limits_measurements_and_not_the_published_range() {
    let list = "(sensor: imu, fault: clip(gyro_deg_per_s: 60, accel_m_per_s2: 9.5))";
    let recorded = with(list);
    let limit = 60_f64.to_radians();
    for ((_, sample), (_, was)) in recorded.samples.iter().zip(&reference().samples) {
        assert_eq!(sample.angular_velocity_rad_per_s, was.angular_velocity_rad_per_s.map(|x| x.clamp(-limit, limit)));
        assert_eq!(sample.specific_force_m_per_s2, was.specific_force_m_per_s2.map(|x| x.clamp(-9.5, 9.5)));
    }
    assert!(changed(&recorded).len() > 10, "few samples are clipped");
    let calibration = |list| simulation(&usual(), list).unwrap().calibration();
    assert_eq!(calibration(Some(list)), calibration(None));
}

#[test]
fn a_frozen_sensor_repeats_its_last_measurement_with_new_stamps() {
    let recorded = with("(sensor: both, from_s: 3, to_s: 4, fault: freeze)");
    let whole = reference();
    let last = whole.samples.iter().rev().find(|(at, _)| since_start_s(*at) < 3.0).unwrap().1;
    for ((at, sample), (_, was)) in recorded.samples.iter().zip(&whole.samples) {
        let expected = if (3.0..4.0).contains(&since_start_s(*at)) { last } else { *was };
        assert_eq!(*sample, ImuSample { stamp: was.stamp, ..expected });
    }
    let last = &whole.scans.iter().rev().find(|(at, _)| since_start_s(*at) < 3.0).unwrap().1;
    let frozen: Vec<_> = recorded.scans.iter().filter(|(at, _)| (3.0..4.0).contains(&since_start_s(*at))).collect();
    assert!((38..=41).contains(&frozen.len()));
    assert!(frozen.iter().all(|(_, scan)| scan.returns == last.returns && scan.planar == last.planar));
    assert!(recorded.scans.iter().zip(&whole.scans).all(|((_, a), (_, b))| a.stamp == b.stamp));
}

#[test]
fn a_constant_range_applies_to_every_beam() {
    let recorded = with("(sensor: lidar, from_s: 1, to_s: 2, fault: constant_range(range_m: 2.5))");
    for ((at, scan), (_, was)) in recorded.scans.iter().zip(&reference().scans) {
        if !(1.0..2.0).contains(&since_start_s(*at)) {
            assert!(scan == was);
            continue;
        }
        let planar = scan.planar.as_ref().unwrap();
        assert!(planar.ranges_m.iter().all(|range| *range == 2.5) && scan.returns.len() == planar.ranges_m.len());
        assert!(scan.returns.iter().all(|beam| (beam.point_in_laser.norm() - 2.5).abs() < 1e-5));
        // Direction and time of beams with a return do not change.
        for beam in &was.returns {
            let same = scan.returns.iter().find(|other| other.offset == beam.offset).unwrap();
            assert!((same.point_in_laser.normalize() - beam.point_in_laser.normalize()).norm() < 1e-5);
        }
    }
}

#[test]
fn spikes_change_the_specified_number_of_samples() {
    let random = with("(sensor: imu, from_s: 1, to_s: 6, fault: spike(gyro_rad_per_s: (30, 0, -30), count: 9))");
    let spoiled = changed(&random);
    assert_eq!(spoiled.len(), 9);
    for k in spoiled {
        let ((at, sample), (_, was)) = (random.samples[k], reference().samples[k]);
        assert!((1.0..6.1).contains(&since_start_s(at)));
        assert_eq!(sample.angular_velocity_rad_per_s, Vector::new(30.0, 0.0, -30.0));
        assert_eq!(sample.specific_force_m_per_s2, was.specific_force_m_per_s2);
    }
    let given = with("(sensor: imu, fault: spike(accel_m_per_s2: (0, 0, 100), times_s: [2.0, 3.333]))");
    let first_after = |s: f64| reference().samples.iter().position(|(at, _)| since_start_s(*at) >= s).unwrap();
    assert_eq!(changed(&given), [first_after(2.0), first_after(3.333)]);
}

#[test]
fn a_bias_steps_at_the_specified_time() {
    let recorded =
        with("(sensor: imu, from_s: 3, fault: bias_step(gyro_deg_per_s: (1, 0, -2), accel_m_per_s2: (0, 0.5, 0)))");
    for ((at, sample), (_, was)) in recorded.samples.iter().zip(&reference().samples) {
        let on = if since_start_s(*at) >= 3.0 { 1.0 } else { 0.0 };
        let rate = Vector::new(1_f64.to_radians(), 0.0, -2_f64.to_radians()) * on;
        assert!((sample.angular_velocity_rad_per_s - was.angular_velocity_rad_per_s - rate).norm() < 1e-12);
        let force = Vector::new(0.0, 0.5, 0.0) * on;
        assert!((sample.specific_force_m_per_s2 - was.specific_force_m_per_s2 - force).norm() < 1e-12);
    }
}

type IsEncoded = fn(f32) -> bool;

#[test]
fn misses_have_the_specified_encoding_and_returns_do_not_change() {
    let outdoors = Scenario { duration_s: 1.0, ..scenario("open_field", "3dm_gx2", 1) };
    let clean = run(&outdoors, None);
    let is_miss = |range: f32| range == f32::INFINITY;
    let misses = |recorded: &MemorySink| {
        recorded.scans.iter().flat_map(|(_, s)| s.planar.clone().unwrap().ranges_m).collect::<Vec<_>>()
    };
    assert!(misses(&clean).into_iter().filter(|range| is_miss(*range)).count() > 1000);
    let checks: [(&str, IsEncoded); 6] = [
        ("range_max", |range| range == 30.0),
        ("above_max", |range| range == 31.0),
        ("zero", |range| range == 0.0),
        ("nan", f32::is_nan),
        ("inf", |range| range == f32::INFINITY),
        ("minus_inf", |range| range == f32::NEG_INFINITY),
    ];
    for (encoding, is_encoded) in checks {
        let recorded = run(&outdoors, Some(&format!("(sensor: lidar, fault: misses(encoding: {encoding}))")));
        let pairs = misses(&recorded).into_iter().zip(misses(&clean));
        assert!(
            pairs.into_iter().all(|(now, was)| if is_miss(was) { is_encoded(now) } else { now == was }),
            "{encoding}"
        );
        assert!(recorded.scans.iter().zip(&clean.scans).all(|((_, a), (_, b))| a.returns == b.returns));
    }
}

#[test]
fn axes_and_units_follow_the_specified_convention() {
    let recorded = with("(sensor: imu, fault: axes(negate_gyro: true, accel_scale: 0.5))");
    for ((_, sample), (_, was)) in recorded.samples.iter().zip(&reference().samples) {
        assert_eq!(sample.angular_velocity_rad_per_s, -was.angular_velocity_rad_per_s);
        assert_eq!(sample.specific_force_m_per_s2, was.specific_force_m_per_s2 * 0.5);
    }
    // With gravity removed an ideal IMU measures its acceleration, f - R^T (-g).
    let ideal = Scenario { duration_s: 3.0, clock: "exact".to_owned(), ..scenario("mocap_room", "ideal_1khz", 1) };
    let list = "(sensor: imu, fault: axes(remove_gravity: true))";
    let (free, clean) = (run(&ideal, Some(list)), run(&ideal, None));
    let imu = simulation(&ideal, None).unwrap().calibration().head_from_imu.rotation;
    for ((at, sample), (_, was)) in free.samples.iter().zip(&clean.samples) {
        let (_, truth) = clean.truth.iter().rev().find(|(t, _)| t <= at).unwrap();
        let world_from_imu = truth.head.world_from_body.rotation * imu;
        let at_rest = world_from_imu.inverse() * -gravity_in_world();
        let removed = was.specific_force_m_per_s2 - sample.specific_force_m_per_s2;
        // The head rotates by at most 10 mrad within the millisecond of a sample.
        assert!((removed - at_rest).norm() < 0.1, "{removed} {at_rest}");
    }
}

#[test]
fn an_incorrect_calibration_is_published_and_the_ground_truth_does_not_change() {
    let list = "(sensor: lidar, fault: extrinsics(position_m: (5, 0, -1))),
        (sensor: imu, fault: extrinsics(roll_pitch_yaw_deg: (0, 10, 90)))";
    let calibration = |list| simulation(&usual(), list).unwrap().calibration();
    let (wrong, right) = (calibration(Some(list)), calibration(None));
    let shift = wrong.head_from_laser.translation.vector - right.head_from_laser.translation.vector;
    assert!((shift - Vector::new(5.0, 0.0, -1.0)).norm() < 1e-12);
    assert_eq!(wrong.head_from_laser.rotation, right.head_from_laser.rotation);
    let turn = right.head_from_imu.rotation.inverse() * wrong.head_from_imu.rotation;
    assert!(turn.angle_to(&from_roll_pitch_yaw(0.0, 10_f64.to_radians(), 90_f64.to_radians())) < 1e-9);
    assert!(with(list) == *reference(), "measurements and ground truth must not change");
}
