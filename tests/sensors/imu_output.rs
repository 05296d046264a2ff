//! Output filter, saturation within a sample, and warm-up of an IMU, compared with closed forms.

use approx::assert_relative_eq;
use std::f64::consts::{PI, TAU};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim::measurement::ImuAveraging;
use zsim::random::Seed;
use zsim::sensors::{Imu, ImuErrors, ImuSampler, ImuSpec, InertialReading, OutputFilterSpec, WarmUpSpec};
use zsim::spec::{self, Source};

/// An IMU without noise whose samples are not averaged, with 200 samples a second.
fn ideal(filter: Option<OutputFilterSpec>) -> ImuSpec {
    let ideal: ImuSpec = spec::load("ideal_1khz").unwrap();
    ImuSpec { rate_hz: 200.0, averaging: ImuAveraging::None, output_filter: filter, ..ideal }
}

fn imu(spec: &ImuSpec) -> Imu {
    Imu::new(spec, &Source::in_memory("test.ron", "")).unwrap()
}

/// A rotation about x with the rate `amplitude cos(2 pi freq_hz t)`, rad/s.
fn turning(amplitude: f64, freq_hz: f64) -> impl Fn(f64) -> Kinematics {
    let omega = TAU * freq_hz;
    move |t| {
        let turn = Vector::x() * (amplitude / omega * (omega * t).sin());
        Kinematics {
            angular_velocity_in_world: Vector::x() * (amplitude * (omega * t).cos()),
            ..Kinematics::at_rest(Pose::from_parts(Vector::zeros().into(), Rotation::from_scaled_axis(turn)))
        }
    }
}

/// Gain and delay, s, of the samples relative to the rate at the times that they describe, at a whole number of periods.
fn gain_and_delay(spec: &ImuSpec, freq_hz: f64) -> (f64, f64) {
    let (imu, period_s) = (imu(spec), 1.0 / spec.rate_hz);
    let (mut sampler, motion) = (ImuSampler::new(&imu, Seed(1)), turning(1.0, freq_hz));
    let delay_s = imu.delay_s() - imu.stamp_delay_s();
    let (mut cos, mut sin) = (0.0, 0.0);
    let settled = 400;
    for k in 0..2 * settled {
        let from_s = f64::from(k) * period_s;
        let sample = sampler.sample(&motion, (from_s, from_s + period_s)).angular_velocity_rad_per_s.x;
        if k >= settled {
            let phase = TAU * freq_hz * (from_s + 0.5 * period_s - delay_s);
            cos += sample * phase.cos() * 2.0 / f64::from(settled);
            sin += sample * phase.sin() * 2.0 / f64::from(settled);
        }
    }
    (cos.hypot(sin), sin.atan2(cos) / (TAU * freq_hz))
}

#[test]
fn a_butterworth_filter_has_its_gain_and_its_delay() {
    for (order, cutoff_hz) in [(1, 30.0), (2, 25.0), (3, 60.0), (4, 40.0), (8, 50.0)] {
        let spec = ideal(Some(OutputFilterSpec::Butterworth { order, cutoff_hz }));
        for freq_hz in [1.0, 10.0, 20.0, 40.0, 80.0] {
            let expected = 1.0 / (1.0 + (freq_hz / cutoff_hz).powi(2 * order as i32)).sqrt();
            let (gain, _) = gain_and_delay(&spec, freq_hz);
            // Warping at 80 Hz and steps of 0.5 ms: (pi f h)^2 / 3 = 0.5 % of the frequency, times the slope of the gain.
            assert_relative_eq!(gain, expected, max_relative = 0.006 * f64::from(order) + 0.002);
        }
        // The delay of a slow signal is that of `Imu::delay_s`.
        let (_, delay_s) = gain_and_delay(&spec, 1.0);
        assert!(delay_s.abs() < 2e-5, "order {order}: {delay_s} s");
    }
}

#[test]
fn a_moving_average_has_the_gain_of_the_mean_over_its_window_and_the_same_delay_at_all_frequencies() {
    // 15 readings at 1 kHz: sinc(f 15 ms), first zero at 66.7 Hz.
    let spec = ideal(Some(OutputFilterSpec::MovingAverage { samples: 15, rate_hz: 1000.0 }));
    for freq_hz in [1.0, 10.0, 40.0, 60.0] {
        let x = PI * freq_hz * 0.015;
        let (gain, delay_s) = gain_and_delay(&spec, freq_hz);
        assert_relative_eq!(gain, x.sin() / x, max_relative = 1e-6);
        assert!(delay_s.abs() < 1e-9, "{freq_hz} Hz: {delay_s} s");
    }
    assert!(gain_and_delay(&spec, 200.0 / 3.0).0 < 1e-6);
}

#[test]
fn a_filter_passes_white_noise_up_to_its_noise_bandwidth() {
    let density = 0.03_f64;
    let mut spec = ideal(Some(OutputFilterSpec::Butterworth { order: 2, cutoff_hz: 20.0 }));
    spec.gyro.density_deg_per_s_per_sqrt_hz = density;
    let mut sampler = ImuSampler::new(&imu(&spec), Seed(4));
    let still = turning(0.0, 1.0);
    let samples: Vec<f64> = (0..200_000)
        .map(|k| {
            let from_s = f64::from(k) * 0.005;
            sampler.sample(&still, (from_s, from_s + 0.005)).angular_velocity_rad_per_s.x.to_degrees()
        })
        .collect();
    // Twice the density squared (both sides) times fc (pi / 4) / sin(pi / 4). 40,000 independent values: 0.7 %.
    let variance = samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64;
    let bandwidth_hz = 20.0 * (PI / 4.0) / (PI / 4.0).sin();
    assert_relative_eq!(variance, 2.0 * density * density * bandwidth_hz, max_relative = 0.03);
    // Slow noise is that of the density: N / sqrt(tau) after 2 s.
    let slow = zsim::signal::allan_deviation(&samples, 200.0, &[400])[0].deviation;
    assert_relative_eq!(slow, density / 2_f64.sqrt(), max_relative = 0.12);
}

#[test]
fn readings_saturate_within_a_sample() {
    let mut spec = ideal(None);
    spec.averaging = ImuAveraging::ConingCorrected;
    (spec.rate_hz, spec.gyro.limit_deg_per_s) = (100.0, 1.0_f64.to_degrees());
    let (mut sampler, motion) = (ImuSampler::new(&imu(&spec), Seed(1)), turning(1.5, 3.0));
    let (mut partly, mut wholly) = (0, 0);
    for k in 0..200 {
        let (from_s, to_s) = (f64::from(k) * 0.01, f64::from(k + 1) * 0.01);
        let sample = sampler.sample(&motion, (from_s, to_s)).angular_velocity_rad_per_s.x;
        let rate = |n: u32| 1.5 * (TAU * 3.0 * (from_s + (f64::from(n) + 0.5) * 1e-5)).cos();
        let expected = (0..1000).map(|n| rate(n).clamp(-1.0, 1.0)).sum::<f64>() / 1000.0;
        // Within one of ten parts the mean is limited instead of the rate: at most 0.25 of half of its change, by 10.
        assert!((sample - expected).abs() < 4e-4, "sample {k}: {sample} {expected}");
        let clipped = (0..1000).filter(|n| rate(*n).abs() > 1.0).count();
        match clipped {
            0 => assert_relative_eq!(sample, expected, epsilon = 1e-8),
            1000 => {
                wholly += 1;
                assert_eq!(sample.abs(), 1.0);
            }
            _ => {
                partly += 1;
                assert!(sample.abs() < 1.0);
            }
        }
    }
    assert!(partly > 15 && wholly > 50, "{partly} {wholly}");
}

#[test]
fn a_bias_approaches_that_of_the_warm_sensor() {
    let mut spec = ideal(None);
    spec.warm_up = Some(WarmUpSpec { rise_k: 15.0, time_s: 60.0 });
    (spec.gyro.bias_deg_per_s_per_k, spec.accel.bias_mg_per_k) = (0.01, 0.5);
    let (model, runs) = (imu(&spec), 400);
    let (mut squares, at_rest) = (Vector::zeros(), InertialReading::default());
    for seed in 0..runs {
        let mut errors = ImuErrors::new(&model, Seed(seed));
        assert_eq!(errors.biases().0, Vector::zeros());
        for _ in 0..60 * 200 {
            errors.measure(&at_rest);
        }
        let after_60_s = errors.biases();
        for _ in 0..60 * 200 {
            errors.measure(&at_rest);
        }
        // 1 - 1/e and 1 - 1/e^2 of the same final bias.
        let ratio = (1.0 - (-2.0_f64).exp()) / (1.0 - (-1.0_f64).exp());
        assert_relative_eq!(errors.biases().1, after_60_s.1 * ratio, max_relative = 1e-9);
        let warm = after_60_s.0 / (1.0 - (-1.0_f64).exp());
        squares += warm.component_mul(&warm) / runs as f64;
    }
    // Standard error of a sigma from 400 runs: 3.5 %.
    assert_relative_eq!(squares.map(|x| x.sqrt().to_degrees()), Vector::repeat(0.15), max_relative = 0.12);
    // An estimator expects the change over the first 100 s as a random walk.
    let expected = 0.15_f64.to_radians() * (1.0 - (-100.0_f64 / 60.0).exp()) / 10.0;
    assert_relative_eq!(model.noise().gyro_bias_walk_rad_per_s_per_sqrt_s, expected, max_relative = 1e-9);
}

#[test]
fn an_inconsistent_filter_or_warm_up_is_refused_with_its_line() {
    let text = std::fs::read_to_string("specs/imus/3dm_gx2.ron").unwrap();
    let with = |lines: &str| text.replace("averaging: coning_corrected,", lines);
    let cases = [
        ("output_filter: butterworth(order: 2, cutoff_hz: 40),", "set averaging: none"),
        ("averaging: none, output_filter: butterworth(order: 9, cutoff_hz: 40),", "give 1 to 8"),
        ("averaging: none, output_filter: butterworth(order: 2, cutoff_hz: 2000),", "at most 1000 Hz"),
        ("averaging: none, output_filter: butterworth(order: 2, cutoff_hz: 0.1),", "at least 1 Hz"),
        ("averaging: none, output_filter: moving_average(samples: 0, rate_hz: 1000),", "give 1 to 1000"),
        ("averaging: none, output_filter: moving_average(samples: 15, rate_hz: 250),", "not 1 to 100 times"),
        ("averaging: none, warm_up: (rise_k: 15, time_s: 600),", "bias_deg_per_s_per_k"),
    ];
    for (lines, expected) in cases {
        let source = Source::in_memory("imu.ron", with(lines));
        let error = Imu::new(&spec::parse(&source).unwrap(), &source).unwrap_err();
        assert!(error.to_string().contains(expected), "{lines}: {error}");
        let key = lines.split(": ").next().unwrap();
        let line = text.lines().position(|line| line.contains("averaging: coning")).unwrap() + 1;
        assert_eq!(error.line_and_column().unwrap().0, line, "{key}");
    }
}
