//! Writing and reading 10 s of recording: per second 40 sweeps of 1081 beams, 100 IMU samples and 1000 poses.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails by panicking, and has no readers")]

use criterion::{Criterion, criterion_group, criterion_main};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use std::io::{Cursor, Write};
use zsim::geometry::{Kinematics, Pose, Vector, from_roll_pitch_yaw};
use zsim::measurement::{
    Calibration, ImuAveraging, ImuNoise, ImuSample, LidarNoise, LidarReturn, LidarScan, PlanarScan, Sink,
};
use zsim::random::{Seed, Stream};
use zsim::recording::{Reader, RunDescription, TopicPreference, Truth, TumWriter, Writer};
use zsim::time::{Span, Stamp};
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

const SECONDS: i64 = 10;

fn run() -> RunDescription {
    let imu = ImuNoise {
        gyro_density_rad_per_s_per_sqrt_hz: 5e-4,
        accel_density_m_per_s2_per_sqrt_hz: 8e-4,
        gyro_bias_walk_rad_per_s_per_sqrt_s: 5e-5,
        accel_bias_walk_m_per_s2_per_sqrt_s: 2e-4,
        gyro_turn_on_bias_rad_per_s: 3e-3,
        accel_turn_on_bias_m_per_s2: 0.05,
        gyro_scale_error: 0.0,
        gyro_misalignment_rad: 0.0,
        accel_scale_error: 0.0,
        accel_misalignment_rad: 0.0,
        gyro_limit_rad_per_s: 10.0,
        accel_limit_m_per_s2: 49.0,
    };
    let lidar = LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 };
    let (head_from_laser, head_from_imu) = (Pose::identity(), Pose::identity());
    let calibration =
        Calibration { head_from_laser, head_from_imu, imu, imu_averaging: ImuAveraging::ConingCorrected, lidar };
    RunDescription { calibration, imu_rate_hz: 100.0, base_imu: None, manifest: String::new(), truth_tf: false }
}

fn normal(stream: &mut Stream) -> f64 {
    StandardNormal.sample(stream)
}

/// A sweep of a room 8 m wide, with 10 mm of noise in steps of 1 mm: noisy low bits, as a real scan has for compression.
fn sweep(stamp: Stamp, stream: &mut Stream) -> LidarScan {
    let (angle_min_rad, angle_increment_rad, time_increment_s) = (-2.356_194_5, 0.004_363_323, 1.736_111_1e-5);
    let (mut ranges_m, mut intensities, mut returns) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..1081 {
        let (sin, cos) = (angle_min_rad + f64::from(k) * angle_increment_rad).sin_cos();
        let range = 4.0 / sin.abs().max(cos.abs()) + 0.01 * normal(stream);
        let range = (range * 1000.0).round() / 1000.0;
        let intensity = (1000.0 / range).round() as f32;
        ranges_m.push(range as f32);
        intensities.push(intensity);
        returns.push(LidarReturn {
            offset: Span::from_seconds(f64::from(k) * time_increment_s),
            point_in_laser: Vector::new(range * cos, range * sin, 0.0).cast(),
            intensity,
        });
    }
    let planar = PlanarScan {
        angle_min_rad,
        angle_increment_rad,
        time_increment_s,
        scan_time_s: 0.025,
        range_min_m: 0.1,
        range_max_m: 30.0,
        ranges_m,
        intensities,
    };
    LidarScan { stamp, stamped_after: Span::ZERO, returns, planar: Some(planar) }
}

/// Contents of the recording, generated before timing.
struct Run {
    truth: Vec<(Stamp, TruthSample)>,
    imu: Vec<ImuSample>,
    sweeps: Vec<LidarScan>,
}

fn make_run() -> Run {
    let mut stream = Seed(1).stream("bench");
    let head = |t: f64| Pose::from_parts([t.cos(), t.sin(), 1.4].into(), from_roll_pitch_yaw(0.1, (7.0 * t).sin(), t));
    let truth = (0..SECONDS * 1000).map(|k| {
        let now = Stamp::from_nanos(k * 1_000_000);
        let head = Kinematics::at_rest(head(k as f64 * 1e-3));
        (now, TruthSample { lidar_stamp: now, head, base: head })
    });
    let truth = truth.collect();
    let mut noise = || Vector::from_fn(|_, _| normal(&mut stream));
    let imu = (0..SECONDS * 100).map(|k| ImuSample {
        stamp: Stamp::from_nanos(k * 10_000_000),
        angular_velocity_rad_per_s: noise(),
        specific_force_m_per_s2: noise(),
    });
    let imu = imu.collect();
    let sweeps = (0..SECONDS * 40).map(|k| sweep(Stamp::from_nanos(k * 25_000_000), &mut stream)).collect();
    stream.next_u64();
    Run { truth, imu, sweeps }
}

fn record<W: Write + Send + 'static>(made: &Run, file: W) {
    let mut writer = Writer::new(file, run()).unwrap();
    let clock = ClockTruth { lidar_offset: Span::ZERO, imu_offset: Span::ZERO };
    for (k, (now, sample)) in made.truth.iter().enumerate() {
        writer.truth(*now, sample).unwrap();
        if k % 10 == 0 {
            writer.imu(*now, &made.imu[k / 10]).unwrap();
            writer.clock(*now, &clock).unwrap();
        }
        if k % 25 == 0 {
            writer.lidar(*now, &made.sweeps[k / 25]).unwrap();
        }
    }
    writer.finish().unwrap();
}

fn benches(criterion: &mut Criterion) {
    let made = make_run();
    criterion.bench_function("write 10 s to a file", |b| {
        b.iter(|| record(&made, tempfile::tempfile().unwrap()));
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    record(&made, std::fs::File::create(&path).unwrap());
    let bytes = std::fs::read(&path).unwrap();
    println!("10 s are {} bytes", bytes.len());
    for topic in ["/scan", "/points"] {
        criterion.bench_function(&format!("read the measurements of 10 s by {topic}"), |b| {
            b.iter(|| {
                let reader = Reader::new("memory", Cursor::new(bytes.clone())).unwrap();
                let preference = TopicPreference { lidar_topic: Some(topic.to_owned()), imu_topic: None };
                let selection = reader.select(&preference).unwrap();
                reader.measurements(&selection).count()
            });
        });
    }
    criterion.bench_function("read the truth of 10 s", |b| {
        let reader = Reader::open(&path).unwrap();
        b.iter(|| reader.truth().filter(|truth| matches!(truth, Ok(Truth::Head(..)))).count());
    });
    criterion.bench_function("write 10 s of truth as TUM", |b| {
        b.iter(|| {
            let mut writer = TumWriter::new(Vec::new());
            made.truth.iter().for_each(|(now, sample)| writer.truth(*now, sample).unwrap());
            writer.finish().unwrap();
        });
    });
}

criterion_group!(recording, benches);
criterion_main!(recording);
