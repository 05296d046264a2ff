//! IMU measurements compared with closed forms, and IMU noise compared with the spec.

use crate::strapdown::integrate;
use approx::assert_relative_eq;
use std::f64::consts::PI;
use zsim::geometry::{Kinematics, Pose, Rotation, STANDARD_GRAVITY_M_PER_S2 as G, Vector, from_roll_pitch_yaw};
use zsim::measurement::ImuAveraging;
use zsim::random::Seed;
use zsim::sensors::{GaussMarkovSpec, Imu, ImuErrors, ImuSpec, InertialReading, coning_corrected, ideal_reading};
use zsim::signal::allan_deviation;
use zsim::spec::{self, Kind, Source};

fn spec_of(name: &str) -> ImuSpec {
    spec::load(name).unwrap()
}

fn imu(spec: &ImuSpec) -> Imu {
    Imu::new(spec, &Source::in_memory("test.ron", "")).unwrap()
}

fn at_rest() -> InertialReading {
    InertialReading { angular_velocity_rad_per_s: Vector::zeros(), specific_force_m_per_s2: Vector::z() * G }
}

#[test]
fn every_shipped_imu_loads() {
    let names = spec::names(Kind::Imu);
    assert!(names.len() >= 5, "{names:?}");
    for name in names {
        imu(&spec_of(&name));
    }
}

#[test]
fn the_noise_of_the_3dm_gx2_agrees_with_its_data_sheet() {
    let noise = imu(&spec_of("3dm_gx2")).noise();
    assert_relative_eq!(noise.gyro_density_rad_per_s_per_sqrt_hz, 5.236e-4, max_relative = 1e-4);
    assert_relative_eq!(noise.accel_density_m_per_s2_per_sqrt_hz, 7.845e-4, max_relative = 1e-4);
    assert_relative_eq!(noise.gyro_limit_rad_per_s, 10.472, max_relative = 1e-4);
    assert_relative_eq!(noise.accel_turn_on_bias_m_per_s2, 0.049_033, max_relative = 1e-4);
}

/// A closed-form motion about and along all axes; derivatives by differences of the exact pose.
fn tumbling(t: f64) -> Kinematics {
    // Rz(a) Ry(b) with a = 0.7 sin(2 pi 0.9 t), b = 0.8 sin(2 pi 1.3 t); omega = a' z + Rz(a) b' y.
    let (wa, wb) = (2.0 * PI * 0.9, 2.0 * PI * 1.3);
    let (a, b) = (0.7 * (wa * t).sin(), 0.8 * (wb * t).sin());
    let (a1, b1) = (0.7 * wa * (wa * t).cos(), 0.8 * wb * (wb * t).cos());
    let (a2, b2) = (-wa * wa * a, -wb * wb * b);
    let node = Rotation::from_scaled_axis(Vector::z() * a) * Vector::y();
    let omega = Vector::z() * a1 + node * b1;
    let alpha = Vector::z() * a2 + node * b2 + Vector::z().cross(&node) * (a1 * b1);
    let w = 2.0 * PI * 1.1;
    let sway = |amplitude: f64, phase: f64| {
        let (sin, cos) = (w * t + phase).sin_cos();
        (amplitude * sin, amplitude * w * cos, -amplitude * w * w * sin)
    };
    let (x, y, z) = (sway(0.2, 0.3), sway(0.1, 1.0), sway(0.05, 2.0));
    Kinematics {
        world_from_body: Pose::from_parts(Vector::new(x.0 + 0.5 * t, y.0, z.0).into(), from_roll_pitch_yaw(0.0, b, a)),
        velocity_in_world: Vector::new(x.1 + 0.5, y.1, z.1),
        angular_velocity_in_world: omega,
        acceleration_in_world: Vector::new(x.2, y.2, z.2),
        angular_acceleration_in_world: alpha,
    }
}

#[test]
fn an_ideal_imu_at_1_khz_integrates_to_the_motion() {
    let mut errors = ImuErrors::new(&imu(&spec_of("ideal_1khz")), Seed(1));
    let dt = 1e-3;
    let readings = (0..10_000).map(|k| {
        let t = f64::from(k) * dt;
        let reading = errors.measure(&coning_corrected(&tumbling(t), &tumbling(t + dt), dt));
        (reading.angular_velocity_rad_per_s, reading.specific_force_m_per_s2)
    });
    let integrated = integrate(&tumbling(0.0), readings, dt);
    let end = tumbling(10.0).world_from_body;
    let error = integrated.translation.vector - end.translation.vector;
    assert!(error.norm() < 1e-4, "{error}");
    assert!(integrated.rotation.angle_to(&end.rotation).to_degrees() < 1e-6);
}

#[test]
fn an_instantaneous_reading_is_the_motion_in_the_middle_and_a_body_mean_its_average() {
    let (from_s, to_s) = (0.3, 0.31);
    let point = |t_s: f64| {
        let at = tumbling(t_s);
        (at.angular_velocity_in_body(), at.specific_force_in_body())
    };
    let instant = ideal_reading(ImuAveraging::None, tumbling, (from_s, to_s));
    let (rate, force) = point(0.305);
    assert_relative_eq!(instant.angular_velocity_rad_per_s, rate, epsilon = 1e-8);
    assert_relative_eq!(instant.specific_force_m_per_s2, force, epsilon = 1e-8);

    // The midpoint rule with 1000 points errs by (h / 1000)^2 / 24 times the second derivative: 1e-9.
    let (mut rate, mut force) = (Vector::zeros(), Vector::zeros());
    for k in 0..1000 {
        let (w, f) = point(from_s + (to_s - from_s) * (f64::from(k) + 0.5) / 1000.0);
        (rate, force) = (rate + w / 1000.0, force + f / 1000.0);
    }
    let mean = ideal_reading(ImuAveraging::BodyMean, tumbling, (from_s, to_s));
    assert_relative_eq!(mean.angular_velocity_rad_per_s, rate, epsilon = 1e-7);
    assert_relative_eq!(mean.specific_force_m_per_s2, force, epsilon = 1e-7);
    // The kinds differ by much more than that.
    let corrected = ideal_reading(ImuAveraging::ConingCorrected, tumbling, (from_s, to_s));
    assert!((corrected.specific_force_m_per_s2 - force).norm() > 1e-4);
    assert!((instant.specific_force_m_per_s2 - force).norm() > 1e-4);
}

#[test]
fn on_a_rate_table_the_lever_arm_adds_centripetal_acceleration() {
    // Rate w about z, lever arm r along the head's x, sample interval T. In the frame at mid-interval the velocity of a
    // point on a circle changes by -2 w r sin(w T / 2) along the arm: a mean force of -w^2 r sinc(w T / 2), plus gravity.
    let (rate, arm, period) = (6.0, 0.1, 0.01);
    let table = |t: f64| {
        let pose = Pose::from_parts(Vector::zeros().into(), from_roll_pitch_yaw(0.0, 0.0, rate * t));
        let spinning = Kinematics { angular_velocity_in_world: Vector::z() * rate, ..Kinematics::at_rest(pose) };
        spinning.of_frame(&Pose::translation(arm, 0.0, 0.0))
    };
    let sample = coning_corrected(&table(0.3), &table(0.3 + period), period);
    let half = 0.5 * rate * period;
    let expected = Vector::new(-rate * rate * arm * half.sin() / half, 0.0, G);
    assert_relative_eq!(sample.specific_force_m_per_s2, expected, epsilon = 1e-10);
    assert_relative_eq!(sample.angular_velocity_rad_per_s, Vector::z() * rate, epsilon = 1e-10);
}

#[test]
fn an_accelerometer_on_a_pendulum_measures_only_the_rod_tension() {
    // Point pendulum of length L: the specific force along the rod is g cos(a) + L a'^2, and zero across it. The state
    // is integrated by RK4 at 0.05 ms; energy gives a'^2 = 2 g / L (cos a - cos a0).
    let (length, a0) = (0.8, 1.2_f64);
    let (mut a, mut rate) = (a0, 0.0);
    let swing = |a: f64| -G / length * a.sin();
    let state = |a: f64, rate: f64| Kinematics {
        world_from_body: Pose::from_parts(
            Vector::new(length * a.sin(), 0.0, -length * a.cos()).into(),
            from_roll_pitch_yaw(0.0, -a, 0.0),
        ),
        velocity_in_world: Vector::new(a.cos(), 0.0, a.sin()) * (length * rate),
        ..Kinematics::at_rest(Pose::identity())
    };
    let h = 5e-5;
    for k in 1..=12_000 {
        let before = (a, rate);
        for half in [0.5 * h, 0.5 * h] {
            let (k1, l1) = (rate, swing(a));
            let (k2, l2) = (rate + 0.5 * half * l1, swing(a + 0.5 * half * k1));
            let (k3, l3) = (rate + 0.5 * half * l2, swing(a + 0.5 * half * k2));
            let (k4, l4) = (rate + half * l3, swing(a + half * k3));
            a += half / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            rate += half / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
        }
        if k % 1000 == 0 {
            let sample = coning_corrected(&state(before.0, before.1), &state(a, rate), h);
            let middle = 0.5 * (a + before.0);
            let pull = G * middle.cos() + 2.0 * G * (middle.cos() - a0.cos());
            assert_relative_eq!(sample.specific_force_m_per_s2, Vector::new(0.0, 0.0, pull), epsilon = 1e-6);
        }
    }
}

/// Samples of the x axes of an IMU at rest.
fn still(spec: &ImuSpec, seed: u64, count: usize) -> (Vec<f64>, Vec<f64>) {
    let mut errors = ImuErrors::new(&imu(spec), Seed(seed));
    (0..count)
        .map(|_| {
            let sample = errors.measure(&at_rest());
            (sample.angular_velocity_rad_per_s.x, sample.specific_force_m_per_s2.x)
        })
        .unzip()
}

/// One degree per hour, rad/s.
const RAD_PER_S_PER_DEG_PER_H: f64 = PI / 180.0 / 3600.0;
/// Allan deviation of flicker noise in units of the bias instability, sqrt(2 ln 2 / pi) (IEEE Std 952).
const FLOOR: f64 = 0.664;

/// Parameters of the Allan variance of a sensor from its spec, in SI units.
struct AllanOfSpec {
    density: f64,
    walk: f64,
    /// Bias instability.
    instability: f64,
    /// Resolution of readings.
    resolution: f64,
    period_s: f64,
}

impl AllanOfSpec {
    /// Parameters of gyroscope and accelerometer.
    fn of(spec: &ImuSpec) -> [Self; 2] {
        let (noise, period_s) = (imu(spec).noise(), 1.0 / spec.rate_hz);
        let gyro = Self {
            density: noise.gyro_density_rad_per_s_per_sqrt_hz,
            walk: spec.gyro.bias_walk_rad_per_s_per_sqrt_s,
            instability: spec.gyro.bias_instability_deg_per_h * RAD_PER_S_PER_DEG_PER_H,
            resolution: spec.gyro.resolution_deg_per_s.to_radians(),
            period_s,
        };
        let accel = Self {
            density: noise.accel_density_m_per_s2_per_sqrt_hz,
            walk: spec.accel.bias_walk_m_per_s2_per_sqrt_s,
            instability: spec.accel.bias_instability_mg * 1e-3 * G,
            resolution: spec.accel.resolution_mg * 1e-3 * G,
            period_s,
        };
        [gyro, accel]
    }

    /// Allan variance at `tau_s`, in squares of the SI unit: the sum over all noise sources.
    ///
    /// White noise gives N^2 / tau, a random walk K^2 tau / 3, and bias instability 2 ln(2) / pi B^2 (IEEE Std 952).
    /// Rounding to q adds q^2 / 12 per sample, which is white if the noise per sample is at least q.
    fn variance(&self, tau_s: f64) -> f64 {
        let rounding = self.resolution.powi(2) / 12.0 * self.period_s;
        let instability = FLOOR.powi(2) * self.instability.powi(2);
        (self.density.powi(2) + rounding) / tau_s + self.walk.powi(2) * tau_s / 3.0 + instability
    }
}

/// Compares the Allan deviation of a record of `hours` at rest with the spec.
///
/// The tolerance is 10 % up to a thousandth of the record's length, and the 99.9 % confidence band for longer times.
fn assert_allan_deviation_of_spec(name: &str, hours: f64) {
    let spec = spec_of(name);
    let duration_s = hours * 3600.0;
    let (gyro, accel) = still(&spec, 1, (duration_s * spec.rate_hz) as usize);
    let times = [0.01, 0.1, 1.0, 5.0, 10.0, 20.0, 100.0, 500.0, 2000.0];
    let averaging: Vec<usize> =
        times.iter().filter(|tau| **tau <= 0.1 * duration_s).map(|tau| (tau * spec.rate_hz).round() as usize).collect();
    for (samples, expected) in [gyro, accel].iter().zip(AllanOfSpec::of(&spec)) {
        for point in allan_deviation(samples, spec.rate_hz, &averaging) {
            let deviation = expected.variance(point.tau_s).sqrt();
            if deviation == 0.0 {
                assert!(point.deviation < 1e-9, "{name}: {point:?}, expected none");
                continue;
            }
            let (low, high) = point.confidence_interval(0.999);
            let near = (point.deviation / deviation - 1.0).abs() < 0.10;
            let right = if point.tau_s <= 1e-3 * duration_s { near } else { low < deviation && deviation < high };
            assert!(right, "{name}: {point:?}, expected {deviation}");
        }
    }
}

#[test]
fn the_allan_deviation_of_six_hours_at_rest_agrees_with_the_spec() {
    assert_allan_deviation_of_spec("3dm_gx2", 6.0);
}

#[test]
fn the_allan_deviation_of_every_shipped_imu_agrees_with_its_spec() {
    for name in spec::names(Kind::Imu) {
        assert_allan_deviation_of_spec(&name, if spec_of(&name).rate_hz > 500.0 { 0.1 } else { 1.0 });
    }
}

#[test]
fn the_noise_of_consumer_and_tactical_imus_agrees_with_their_data_sheets() {
    // 0.007 deg/s/sqrt(Hz) and 180 ug/sqrt(Hz); 0.15 deg/sqrt(h) and 0.07 m/s/sqrt(h), by sqrt(3600).
    let noise = imu(&spec_of("consumer")).noise();
    assert_relative_eq!(noise.gyro_density_rad_per_s_per_sqrt_hz, 1.2217e-4, max_relative = 1e-4);
    assert_relative_eq!(noise.accel_density_m_per_s2_per_sqrt_hz, 1.7652e-3, max_relative = 1e-4);
    let noise = imu(&spec_of("tactical")).noise();
    assert_relative_eq!(noise.gyro_density_rad_per_s_per_sqrt_hz, (0.15_f64 / 60.0).to_radians(), max_relative = 1e-9);
    assert_relative_eq!(noise.accel_density_m_per_s2_per_sqrt_hz, 0.07 / 60.0, max_relative = 1e-3);
    assert_relative_eq!(noise.gyro_limit_rad_per_s, 400_f64.to_radians(), max_relative = 1e-12);
}

#[test]
fn the_allan_deviation_of_a_bias_instability_is_flat_at_two_thirds_of_it() {
    let mut spec = spec_of("ideal_1khz");
    (spec.rate_hz, spec.gyro.bias_instability_deg_per_h, spec.accel.bias_instability_mg) = (2.0, 18.0, 0.04);
    // Six hours; mean variance over 12 seeds, so that the relative standard error at 216 s is about 3 %.
    let seeds = 12;
    let (mut gyro, mut accel) = ([0.0; 4], [0.0; 4]);
    for seed in 0..seeds {
        let samples = still(&spec, seed, 6 * 3600 * 2);
        for (sums, samples) in [(&mut gyro, samples.0), (&mut accel, samples.1)] {
            let points = allan_deviation(&samples, spec.rate_hz, &[20, 60, 200, 432]);
            sums.iter_mut().zip(points).for_each(|(sum, point)| *sum += point.deviation.powi(2) / seeds as f64);
        }
    }
    for (gyro, accel) in gyro.iter().zip(accel) {
        assert_relative_eq!(gyro.sqrt(), FLOOR * 18.0 * RAD_PER_S_PER_DEG_PER_H, max_relative = 0.10);
        assert_relative_eq!(accel.sqrt(), FLOOR * 0.04e-3 * G, max_relative = 0.10);
    }
    // An estimator that expects a random walk gets the one with the same deviation after 100 s.
    let walk = imu(&spec).noise().gyro_bias_walk_rad_per_s_per_sqrt_s;
    assert_relative_eq!(walk * (100.0_f64 / 3.0).sqrt(), FLOOR * 18.0 * RAD_PER_S_PER_DEG_PER_H, max_relative = 1e-3);
}

#[test]
fn a_gauss_markov_bias_has_its_standard_deviation_and_correlation_time() {
    let mut spec = spec_of("ideal_1khz");
    spec.rate_hz = 10.0;
    spec.accel.wander_mg = Some(GaussMarkovSpec { sigma: 0.04, time_s: 2.0 });
    let (_, samples) = still(&spec, 3, 200_000);
    let covariance = |lag: usize| {
        let products = samples.iter().zip(&samples[lag..]).map(|(a, b)| a * b);
        products.sum::<f64>() / (samples.len() - lag) as f64
    };
    // 20,000 s are 10,000 correlation times: relative standard error of a variance sqrt(2 / 10,000) = 1.4 %.
    let sigma = 0.04e-3 * G;
    assert_relative_eq!(covariance(0), sigma * sigma, max_relative = 0.06);
    assert_relative_eq!(covariance(20) / covariance(0), (-1.0_f64).exp(), epsilon = 0.05);
}

#[test]
fn a_gyroscope_saturates_at_its_limit() {
    let spec = spec_of("3dm_gx2");
    let mut errors = ImuErrors::new(&imu(&spec), Seed(1));
    let fast = InertialReading {
        angular_velocity_rad_per_s: Vector::new(20.0, -20.0, 1.0),
        specific_force_m_per_s2: Vector::new(0.0, 60.0, -60.0),
    };
    let reading = errors.measure(&fast);
    let (rate, force) = (reading.angular_velocity_rad_per_s, reading.specific_force_m_per_s2);
    assert_relative_eq!(rate.xy(), nalgebra::Vector2::new(1.0, -1.0) * 600_f64.to_radians(), epsilon = 1e-12);
    assert!((rate.z - 1.0).abs() < 0.1);
    assert_relative_eq!(force.yz(), nalgebra::Vector2::new(1.0, -1.0) * 5.0 * G, epsilon = 1e-12);
}

#[test]
fn readings_are_rounded_to_the_resolution() {
    let mut spec = spec_of("ideal_1khz");
    spec.gyro.resolution_deg_per_s = 0.5;
    let mut errors = ImuErrors::new(&imu(&spec), Seed(1));
    let turning = InertialReading { angular_velocity_rad_per_s: Vector::repeat(0.7_f64.to_radians()), ..at_rest() };
    assert_relative_eq!(
        errors.measure(&turning).angular_velocity_rad_per_s,
        Vector::repeat(0.5_f64.to_radians()),
        epsilon = 1e-12
    );
}

#[test]
fn scale_misalignment_and_turn_on_bias_have_the_specified_spread_over_runs() {
    let mut spec = spec_of("ideal_1khz");
    (spec.gyro.scale_percent, spec.gyro.misalignment_deg, spec.gyro.turn_on_bias_deg_per_s) = (0.1, 0.05, 0.2);
    let imu = imu(&spec);
    let runs = 4000;
    let mut squares = Vector::zeros();
    for seed in 0..runs {
        let mut errors = ImuErrors::new(&imu, Seed(seed));
        let mut reading = |rate: Vector| {
            errors
                .measure(&InertialReading { angular_velocity_rad_per_s: rate, ..at_rest() })
                .angular_velocity_rad_per_s
        };
        let bias = reading(Vector::zeros());
        let turned = reading(Vector::x()) - bias;
        squares += Vector::new(turned.x - 1.0, turned.y, bias.z).map(|x| x * x);
    }
    // Standard error of a sigma from n runs: 1 / sqrt(2 n) = 1.1 %.
    let sigma = (squares / runs as f64).map(f64::sqrt);
    let expected = Vector::new(1e-3, 0.05_f64.to_radians(), 0.2_f64.to_radians());
    assert_relative_eq!(sigma.component_div(&expected), Vector::repeat(1.0), epsilon = 0.045);
}

#[test]
fn a_random_walk_does_not_change_the_white_noise() {
    let spec = spec_of("3dm_gx2");
    let mut without = spec.clone();
    without.gyro.bias_walk_rad_per_s_per_sqrt_s = 0.0;
    let ((a, accel_a), (b, accel_b)) = (still(&spec, 5, 100), still(&without, 5, 100));
    assert_eq!(accel_a, accel_b);
    assert_eq!(a[0], b[0]);
    // The difference is only the random walk: sigma 5e-5 sqrt(1 s) after 100 samples, without the white noise of
    // 5e-3 per sample.
    assert!((a[99] - b[99]).abs() < 2.5e-4 && a[99] != b[99]);
}

#[test]
fn invalid_values_in_a_spec_are_refused_with_their_line() {
    let text = std::fs::read_to_string("specs/imus/3dm_gx2.ron").unwrap();
    let line_of = |key: &str| text.lines().position(|line| line.contains(key)).unwrap() + 1;
    let negative = text.replace("density_ug_per_sqrt_hz: 80", "density_ug_per_sqrt_hz: -80");
    let error = spec::parse::<ImuSpec>(&Source::in_memory("imu.ron", negative)).unwrap_err();
    assert_eq!(error.line_and_column().unwrap().0, line_of("density_ug_per_sqrt_hz:"));
    let unknown = text.replace("limit_g: 5", "limit_kg: 5");
    assert!(
        spec::parse::<ImuSpec>(&Source::in_memory("imu.ron", unknown)).unwrap_err().to_string().contains("limit_kg")
    );
    let coarse = Source::in_memory("imu.ron", text.replace("resolution_mg: 0", "resolution_mg: 6000"));
    let error = Imu::new(&spec::parse(&coarse).unwrap(), &coarse).unwrap_err();
    assert!(error.to_string().contains("greater than the sensor's limit"), "{error}");
    assert_eq!(error.line_and_column().unwrap().0, line_of("resolution_mg:"));
}
