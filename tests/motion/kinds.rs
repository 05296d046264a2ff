//! Test signals and machine motions: spectra compared with the spec, replay with its poses, and error messages.

use approx::assert_relative_eq;
use zsim::geometry::{Pose, Route, Trajectory, Vector, from_roll_pitch_yaw, roll_pitch_yaw};
use zsim::motion::{BaseMotion, MotionError, MotionSpec};
use zsim::random::Seed;
use zsim::signal::{Segments, power_density};
use zsim::spec::{Kind, Source, find, parse};
use zsim::time::Stamp;

fn straight() -> Route {
    Route { points_in_world: vec![Vector::zeros(), Vector::x() * 2000.0], closed: false }
}

fn build(name: &str, text: String, duration_s: f64) -> Result<Box<dyn BaseMotion>, MotionError> {
    let source = Source::in_memory(name, text);
    parse::<MotionSpec>(&source)?.build(&source, Some(&straight()), duration_s, Seed(6))
}

/// The shipped spec with `from` replaced by `to`.
fn edited(name: &str, from: &str, to: &str, duration_s: f64) -> Result<Box<dyn BaseMotion>, MotionError> {
    let text = find(Kind::Motion, name).unwrap().text;
    assert!(text.contains(from), "no {from} in {name}");
    build(name, text.replacen(from, to, 1), duration_s)
}

fn pitch_rates(motion: &dyn BaseMotion, from_s: f64, rate_hz: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| motion.at(from_s + k as f64 / rate_hz).angular_velocity_in_world.y).collect()
}

#[test]
fn a_multisine_is_periodic_and_has_only_its_lines() {
    // 199 lines at the multiples 2..=200 of 0.05 Hz with a total RMS of 1 degree/s: each has the power (pi/180)^2 / 199.
    let motion = edited("multisine", "", "", 120.0).unwrap();
    let rates = pitch_rates(motion.as_ref(), 10.0, 100.0, 4000);
    let spectrum = power_density(&rates, 100.0, Segments::periods(2000)).unwrap();
    for (freq_hz, density) in spectrum.freq_hz.iter().zip(&spectrum.density) {
        let is_line = (0.099..10.001).contains(freq_hz);
        let expected = if is_line { 1_f64.to_radians().powi(2) / 199.0 / 0.05 } else { 0.0 };
        assert_relative_eq!(*density, expected, max_relative = 1e-6, epsilon = 1e-18);
    }
    // Schroeder phases give a crest factor close to that of a sweep, sqrt(2) to 2; equal phases would give 20.
    let crest = rates.iter().fold(0.0, |most: f64, r| most.max(r.abs())) / 1_f64.to_radians();
    assert!(crest < 2.2, "crest factor {crest}");
}

#[test]
fn band_noise_is_flat_within_its_band_on_every_axis() {
    let motion = edited("band_noise", "", "", 700.0).unwrap();
    let samples: Vec<_> = (0..30_000).map(|k| motion.at(5.0 + 0.02 * f64::from(k))).collect();
    for axis in 0..3 {
        // 0.1 m/s^2 RMS from 0.2 to 10 Hz, and 1 degree/s. The angles are small, so that angular rates are nearly their
        // derivatives.
        let accelerations: Vec<f64> = samples.iter().map(|now| now.acceleration_in_world[axis]).collect();
        let rates: Vec<f64> = samples.iter().map(|now| now.angular_velocity_in_world[axis]).collect();
        for (signal, rms) in [(accelerations, 0.1_f64), (rates, 1_f64.to_radians())] {
            let spectrum = power_density(&signal, 50.0, Segments::hann(2000)).unwrap();
            assert_relative_eq!(spectrum.power_between(0.15, 10.1), rms * rms, max_relative = 0.03);
            for band in 0..4 {
                let low = 1.0 + 2.0 * f64::from(band);
                let expected = rms * rms * 2.0 / 9.8;
                assert_relative_eq!(spectrum.power_between(low, low + 2.0), expected, max_relative = 0.06);
            }
            assert!(spectrum.power_between(10.5, 25.0) < 1e-3 * rms * rms);
        }
    }
}

#[test]
fn a_sweep_covers_its_band_at_constant_amplitude() {
    // Exponential from 0.2 to 10 Hz over 98 s (a rate of ln(50)/98 = 4 % per second): about 9.8 Hz between 97 and 99 s.
    let motion = edited("swept_sine", "still_s: 1.0", "still_s: 2.0", 100.0).unwrap();
    for (from_s, hz) in [(51.0, 0.2 * 50_f64.powf(50.0 / 98.0)), (97.0, 0.2 * 50_f64.powf(96.0 / 98.0))] {
        let rates = pitch_rates(motion.as_ref(), from_s, 1000.0, 2000);
        let crossings = rates.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count() as f64;
        assert!((crossings / 4.0 - hz).abs() < 0.3, "{} Hz instead of {hz}", crossings / 4.0);
        let most = rates.iter().fold(0.0, |most: f64, r| most.max(r.abs())).to_degrees();
        assert_relative_eq!(most, 2.0, max_relative = 0.01);
    }
}

#[test]
fn invalid_test_signals_are_errors() {
    let error_of = |name: &str, from: &str, to: &str| edited(name, from, to, 60.0).err().unwrap().to_string();
    assert!(error_of("multisine", "DegreesPerS(1.0)", "Metres(1.0)").contains("does not fit the axis Pitch"));
    assert!(error_of("multisine", "DegreesPerS(1.0)", "DegreesPerS(-1.0)").contains("above 0"));
    assert!(error_of("multisine", "high_hz: 10.0", "high_hz: 0.05").contains("not above its begin"));
    assert!(error_of("multisine", "period_s: 20.0", "period_s: 1e9").contains("lines from"));
    assert!(error_of("swept_sine", "still_s: 1.0", "still_s: 61.0").contains("before the sweep begins"));
    assert!(error_of("swept_sine", "axis: Pitch", "axis: Nod").contains("Nod"));
}

#[test]
fn a_replay_passes_through_the_recorded_poses() {
    let poses: Vec<(Stamp, Pose)> = (0..200_i64)
        .map(|k| {
            let t = 0.05 * k as f64;
            let position = Vector::new(t.sin() * 2.0, t, 1.0 + 0.1 * (3.0 * t).cos());
            let pose = Pose::from_parts(position.into(), from_roll_pitch_yaw(0.3 * t.sin(), 0.4 * t.cos(), 2.0 * t));
            (Stamp::from_nanos(1_500_000_000_000_000_000 + k * 50_000_000), pose)
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let trajectory = Trajectory::from_poses(poses.iter().copied()).unwrap();
    zsim::recording::write_tum(&folder.path().join("walk.tum"), &trajectory).unwrap();
    let text = "Replay((poses: Tum(\"walk.tum\"), from_route: false, still_s: 1.0, ease_s: 0.5))";
    std::fs::write(folder.path().join("walk.ron"), text).unwrap();
    let source = Source::read(&folder.path().join("walk.ron")).unwrap();
    let motion = parse::<MotionSpec>(&source).unwrap().build(&source, None, 20.0, Seed(1)).unwrap();
    // The replay reaches full speed 2 * 0.5 s after the rest, and is 1.5 s behind the recording.
    for (stamp, pose) in &poses[20..180] {
        let now = motion.at(1.5 + stamp.seconds_since(poses[0].0)).world_from_body;
        assert!((now.translation.vector - pose.translation.vector).norm() < 1e-8);
        assert!(now.rotation.angle_to(&pose.rotation) < 1e-8);
    }
    // Between poses the spline is close to the true motion: the yaw rate of 2 rad/s has an error of about 1e-3.
    let (t, now) = (5.025, motion.at(1.5 + 5.025));
    let (_, _, yaw) = roll_pitch_yaw(&now.world_from_body.rotation);
    assert!((yaw - 2.0 * t).sin().abs() < 1e-4);
    assert_relative_eq!(now.velocity_in_world.x, 2.0 * f64::cos(t), epsilon = 1e-4);
    let end = motion.at(100.0);
    assert_eq!(end.velocity_in_world.norm() + end.angular_velocity_in_world.norm(), 0.0);
}

#[test]
fn a_replay_of_invalid_poses_is_an_error() {
    let error_of = |poses: &str| {
        let text = format!("Replay((poses: {poses}, from_route: false, still_s: 1.0, ease_s: 0.5))");
        build("replay", text, 20.0).err().unwrap().to_string()
    };
    let row = |t: &str, yaw: &str| format!("({t}, (0.0, 0.0, 1.0), (0.0, 0.0, {yaw})),");
    let here = |rows: &[String]| format!("Here([{}])", rows.concat());
    assert!(error_of("Here([])").contains("no poses"));
    assert!(error_of(&here(&[row("0.0", "0.0"), row("1.0", "0.0")])).contains("3 poses"));
    assert!(error_of(&here(&[row("0.0", "0.0"), row("1.0", "0.0"), row("0.5", "0.0")])).contains("not later"));
    assert!(error_of(&here(&[row("0.0", "0.0"), row("NaN", "0.0"), row("2.0", "0.0")])).contains("not finite"));
    assert!(error_of(&here(&[row("0.0", "0.0"), row("1.0", "NaN"), row("2.0", "0.0")])).contains("not finite"));
    assert!(error_of(&here(&[row("0.0", "0.0"), row("1.0", "120.0"), row("2.0", "0.0")])).contains("120 degrees"));
    assert!(error_of("Tum(\"nowhere.tum\")").contains("nowhere.tum"));
}

#[test]
fn each_road_class_doubles_the_acceleration() {
    // Each class of ISO 8608 has four times the power of the previous one: twice the acceleration. The engine is off.
    let text = find(Kind::Motion, "vehicle").unwrap().text;
    let engine = text.find("    // Three-cylinder").unwrap();
    let quiet = format!("{}    engine: None,\n))", &text[..engine]);
    let bounce = |class: &str| {
        let motion = build("vehicle", quiet.replace("Class(D)", class), 60.0).unwrap();
        let squares = (0..5000).map(|k| motion.at(10.0 + 0.01 * f64::from(k)).acceleration_in_world.z.powi(2));
        (squares.sum::<f64>() / 5000.0).sqrt()
    };
    let (smooth, rough) = (bounce("Class(A)"), bounce("Class(C)"));
    assert_relative_eq!(rough / smooth, 4.0, epsilon = 0.02);
    // ISO 2631-1: 0.5 to 2.5 m/s^2 is uncomfortable for passengers; a good road at walking speed is below that.
    assert!((0.02..0.5).contains(&smooth), "rms of {smooth} m/s^2 on a class A road");
}

#[test]
fn invalid_machine_motions_are_errors() {
    let error_of = |name: &str, from: &str, to: &str| edited(name, from, to, 60.0).err().unwrap().to_string();
    assert!(error_of("vehicle", "spring_n_per_m: 20000.0", "spring_n_per_m: 500.0").contains("tips it over"));
    assert!(error_of("vehicle", "Class(D)", "Class(Z)").contains('Z'));
    assert!(error_of("marine", "peakedness: 3.3", "peakedness: 40.0").contains("from 1 to 7"));
    assert!(error_of("marine", "spreading: 4.0", "spreading: 1e9").contains("up to 1000"));
    assert!(error_of("uav", "airspeed_m_per_s: 4.0", "airspeed_m_per_s: 0.0").contains("above 0"));
    assert!(error_of("legged", "stride_hz: 1.6", "stride_hz: inf").contains("finite"));
    for name in ["vehicle", "cart", "uav", "legged"] {
        let source = find(Kind::Motion, name).unwrap();
        let spec: MotionSpec = parse(&source).unwrap();
        let error = spec.build(&source, None, 60.0, Seed(1)).err().unwrap();
        assert!(matches!(error, MotionError::NoRoute { .. }), "{name}: {error}");
    }
}
