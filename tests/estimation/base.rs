//! Base trajectory from an IMU on the base, compared with known motions.

use crate::command::run;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use zsim::estimation::{BaseEstimate, BaseFix, BaseImu, EstimationError, FixSigmas, load, smooth_base};
use zsim::geometry::{Kinematics, Pose, Rotation, Trajectory, Vector, from_roll_pitch_yaw};
use zsim::measurement::{ImuAveraging, ImuSample};
use zsim::random::Seed;
use zsim::recording::{Reader, TopicPreference};
use zsim::sensors::coning_corrected;
use zsim::time::{Span, Stamp};

/// Pose of the IMU in the base, and its biases: rad/s and m/s^2.
fn base_from_imu() -> Pose {
    Pose::from_parts([0.03, -0.02, 0.05].into(), from_roll_pitch_yaw(0.1, -0.2, 1.2))
}

const GYRO_BIAS: Vector = Vector::new(2e-3, -1e-3, 3e-3);
const ACCEL_BIAS: Vector = Vector::new(0.02, 0.03, -0.01);
/// Delay of the IMU's stamps at the start, s, and its rate of change, s/s.
const OFFSET: (f64, f64) = (0.0237, 20e-6);
const DURATION_S: f64 = 30.0;

/// A base that moves on a circle of 1 m and nods: `Rz(c t) Ry(b sin w t)`, with analytic derivatives.
fn walk(t: f64) -> Kinematics {
    let (w, c, b) = (5.0, 0.5, 0.25);
    let (nod, nod1, nod2) = (b * (w * t).sin(), b * w * (w * t).cos(), -b * w * w * (w * t).sin());
    let axis = Rotation::from_scaled_axis(Vector::z() * (c * t)) * Vector::y();
    let (sin, cos) = (c * t).sin_cos();
    Kinematics {
        world_from_body: Pose::from_parts(
            Vector::new(cos, sin, 0.02 * (2.0 * w * t).sin()).into(),
            from_roll_pitch_yaw(0.0, nod, c * t),
        ),
        velocity_in_world: Vector::new(-c * sin, c * cos, 0.04 * w * (2.0 * w * t).cos()),
        angular_velocity_in_world: Vector::z() * c + axis * nod1,
        acceleration_in_world: Vector::new(-c * c * cos, -c * c * sin, -0.08 * w * w * (2.0 * w * t).sin()),
        angular_acceleration_in_world: axis * nod2 + Vector::z().cross(&axis) * (c * nod1),
    }
}

fn at(seconds: f64) -> Stamp {
    Stamp::from_nanos(1_000_000_000_000) + Span::from_seconds(seconds)
}

/// Samples of a 100 Hz IMU on that motion, with constant biases and clock offset and no other error.
fn samples() -> Vec<ImuSample> {
    let moved = |t: f64| walk(t).of_frame(&base_from_imu());
    let sample = |k: i32| {
        let middle_s = (f64::from(k) + 0.5) * 0.01;
        let ideal = coning_corrected(&moved(middle_s - 0.005), &moved(middle_s + 0.005), 0.01);
        ImuSample {
            stamp: at(middle_s * (1.0 + OFFSET.1) + OFFSET.0),
            angular_velocity_rad_per_s: ideal.angular_velocity_rad_per_s + GYRO_BIAS,
            specific_force_m_per_s2: ideal.specific_force_m_per_s2 + ACCEL_BIAS,
        }
    };
    (0..(DURATION_S * 100.0) as i32).map(sample).collect()
}

/// Fixes at 100 Hz with noise of `position_m` and `rotation_rad` on each axis.
fn fixes(position_m: f64, rotation_rad: f64) -> Vec<BaseFix> {
    let mut stream = Seed(7).stream("fixes");
    let mut normal = || Vector::from_fn(|_, _| StandardNormal.sample(&mut stream));
    let fix = |k: i32| {
        let t = f64::from(k) * 0.01;
        let pose = walk(t).world_from_body;
        let turn = Rotation::from_scaled_axis(normal() * rotation_rad);
        let place = pose.translation.vector + normal() * position_m;
        let world_from_base = Pose::from_parts(place.into(), turn * pose.rotation);
        BaseFix { stamp: at(t), world_from_base, sigmas: FixSigmas::SPRING }
    };
    (0..(DURATION_S * 100.0) as i32).map(fix).collect()
}

fn imu() -> BaseImu {
    let noise = crate::recordings::calibration().imu;
    BaseImu { base_from_imu: base_from_imu(), noise, averaging: ImuAveraging::ConingCorrected, clock_offset_s: None }
}

fn smoothed(fixes: &[BaseFix], samples: &[ImuSample]) -> Result<BaseEstimate, EstimationError> {
    smooth_base(fixes, samples, &imu(), &load("default").unwrap())
}

/// RMS distance, m, and angle, rad, from the true motion.
fn rms_error(base: &Trajectory) -> (f64, f64) {
    let squares = base.iter().map(|(stamp, pose)| {
        let truth = walk((stamp - at(0.0)).seconds()).world_from_body;
        let way = pose.translation.vector - truth.translation.vector;
        (way.norm_squared(), pose.rotation.angle_to(&truth.rotation).powi(2))
    });
    let (way, turn) = squares.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    ((way / base.len() as f64).sqrt(), (turn / base.len() as f64).sqrt())
}

#[test]
fn a_closed_form_motion_and_the_clock_offset_are_estimated() {
    let estimate = smoothed(&fixes(0.0, 0.0), &samples()).unwrap();
    let (way_m, turn_rad) = rms_error(&estimate.trajectory);
    assert!(way_m < 2e-4 && turn_rad < 2e-4, "{way_m} m, {turn_rad} rad");
    assert!(estimate.trajectory.len() > 2900, "{}", estimate.trajectory.len());
    assert!(estimate.up_in_world.angle(&Vector::z()) < 1e-3, "{}", estimate.up_in_world);
    let offset_s = OFFSET.0 + OFFSET.1 * DURATION_S;
    assert!((estimate.clock_offset_s - offset_s).abs() < 1e-4, "{}", estimate.clock_offset_s);
}

#[test]
fn the_imu_smooths_noisy_fixes() {
    // 5 mm and 5 mrad per axis are 8.7 in total. The filter averages over some tenths of a second, dozens of fixes, which
    // leaves at most a sixth of the noise.
    let estimate = smoothed(&fixes(5e-3, 5e-3), &samples()).unwrap();
    let (way_m, turn_rad) = rms_error(&estimate.trajectory);
    assert!(way_m < 1.5e-3 && turn_rad < 1.5e-3, "{way_m} m, {turn_rad} rad");
    assert_eq!(smoothed(&fixes(5e-3, 5e-3), &samples()).unwrap(), estimate, "repeatable to the bit");
}

#[test]
fn during_an_imu_gap_the_fixes_determine_the_trajectory() {
    let mut samples = samples();
    samples.drain(1000..1080);
    samples.drain(2000..2003);
    let estimate = smoothed(&fixes(1e-3, 1e-3), &samples).unwrap();
    let (way_m, turn_rad) = rms_error(&estimate.trajectory);
    assert!(way_m < 5e-3 && turn_rad < 1e-2, "{way_m} m, {turn_rad} rad");
    assert!(estimate.trajectory.len() > 2900);
}

#[test]
fn input_that_cannot_be_smoothed_is_an_error_with_the_reason() {
    let (fixes, samples) = (fixes(1e-3, 1e-3), samples());
    let words = |fixes: &[BaseFix], samples: &[ImuSample]| match smoothed(fixes, samples) {
        Ok(_) => panic!("no error"),
        Err(error) => error.to_string(),
    };
    assert!(words(&fixes, &[]).contains("overlap for 0.000 s"));
    assert!(words(&fixes[..100], &samples[2000..]).contains("overlap for"));
    let mut wrong = samples.clone();
    wrong[700].angular_velocity_rad_per_s.y = f64::NAN;
    assert!(words(&fixes, &wrong).contains("base's IMU measurement stamped"), "{}", words(&fixes, &wrong));
    wrong = samples.clone();
    wrong.swap(300, 900);
    assert!(words(&fixes, &wrong).contains("follows one of"));
    wrong.clone_from(&samples);
    wrong.iter_mut().for_each(|sample| {
        let rate = sample.angular_velocity_rad_per_s;
        sample.angular_velocity_rad_per_s = Vector::new(rate.z, rate.x, rate.y);
    });
    assert!(words(&fixes, &wrong).contains("does not match the rotation"), "{}", words(&fixes, &wrong));
    let coarse: Vec<_> = fixes.iter().map(|fix| BaseFix { sigmas: FixSigmas::RIGID_LINK, ..*fix }).collect();
    assert!(words(&coarse, &samples).contains("--clock-offset-ms"));
}

#[test]
fn an_imu_on_the_base_improves_a_simulated_handle_trajectory() {
    let here = tempfile::tempdir().unwrap();
    let simulate = "simulate --scene mocap_room --duration 14s --seed 5 --lidar lms291 --base-imu 3dm_gx2 --out a.mcap";
    let (code, _, stderr) = run(here.path(), simulate);
    assert_eq!(code, 0, "{stderr}");
    // Subsampled to the rate of an estimate; the ground truth has 1000 poses/s.
    let truth = std::fs::read_to_string(here.path().join("a.tum")).unwrap();
    let head: Vec<_> = truth.lines().filter(|line| !line.starts_with('#')).step_by(10).collect();
    std::fs::write(here.path().join("head.tum"), head.join("\n") + "\n").unwrap();
    let base = "base head.tum --truth a.mcap --base-imu a.mcap --json --out base";
    let (code, out, stderr) = run(here.path(), base);
    assert_eq!(code, 0, "{stderr}");
    let figures: Value = serde_json::from_str(&out).unwrap();
    let figure = |way: &str, key: &str| figures[way][key].as_f64().unwrap();
    assert!(figure("imu", "rotation_rmse_deg") < 0.05 * figure("rigid_link", "rotation_rmse_deg"), "{out}");
    assert!(figure("imu", "position_rmse_m") < 0.2 * figure("rigid_link", "position_rmse_m"), "{out}");
    // From the clock spec: 3 ms at the start, and 1 ms/min.
    assert!((figure("imu", "clock_offset_ms") - 3.23).abs() < 1.5, "{out}");
    assert!(here.path().join("base/base_imu.tum").exists());

    // The estimator still uses the IMU of the head.
    let selection = Reader::open(&here.path().join("a.mcap")).unwrap().select(&TopicPreference::default()).unwrap();
    assert_eq!(selection.imu_topic, "/imu/data_raw");
    for (topic, words) in
        [("/nope", "/base/imu (sensor_msgs/msg/Imu)"), ("/imu/data_raw", "does not match the rotation")]
    {
        let (code, _, stderr) = run(here.path(), &format!("{base} --base-imu-topic {topic}"));
        assert!(code == 1 && stderr.contains(words) && !stderr.contains("panicked"), "{topic}: {stderr}");
    }
}
