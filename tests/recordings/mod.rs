//! A small recording for the tests of writing and reading.

use std::io::{self, Write};
use std::sync::{Arc, Mutex};
use zsim::geometry::{Kinematics, Pose, Vector, from_roll_pitch_yaw};
use zsim::measurement::{
    Calibration, ImuAveraging, ImuNoise, ImuSample, LidarNoise, LidarReturn, LidarScan, Measurement, PlanarScan, Sink,
};
use zsim::recording::{RunDescription, Writer};
use zsim::time::{Span, Stamp};
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

/// Memory that a writer's thread fills.
#[derive(Clone, Default)]
pub struct SharedBytes(Arc<Mutex<Vec<u8>>>);

impl SharedBytes {
    pub fn take(&self) -> Vec<u8> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
}

impl Write for SharedBytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A file in memory, and a handle to its content.
pub fn shared_file() -> (SharedBytes, SharedBytes) {
    let bytes = SharedBytes::default();
    (bytes.clone(), bytes)
}

pub fn calibration() -> Calibration {
    Calibration {
        head_from_laser: Pose::from_parts([0.02, 0.0, 0.05].into(), from_roll_pitch_yaw(0.0, 0.1, 0.0)),
        head_from_imu: Pose::from_parts([-0.01, 0.003, -0.04].into(), from_roll_pitch_yaw(0.02, 0.0, 1.5)),
        imu: ImuNoise {
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
        },
        imu_averaging: ImuAveraging::ConingCorrected,
        lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
    }
}

pub fn run() -> RunDescription {
    RunDescription {
        calibration: calibration(),
        imu_rate_hz: 100.0,
        base_imu: None,
        manifest: "(seed: 1)".to_owned(),
        truth_tf: false,
    }
}

pub fn imu_sample(stamp: Stamp) -> ImuSample {
    let t = stamp.nanos() as f64 * 1e-9;
    ImuSample {
        stamp,
        angular_velocity_rad_per_s: Vector::new(t.sin(), t.cos() * 4.0, 0.1),
        specific_force_m_per_s2: Vector::new(0.3 * t.sin(), 0.0, 9.81),
    }
}

/// A sweep that a `LaserScan` represents exactly: 32-bit angles and times, some beams without a return.
pub fn planar_scan(stamp: Stamp) -> LidarScan {
    let beams = 1081;
    let mut planar = PlanarScan {
        angle_min_rad: f64::from(-2.356_194_5_f32),
        angle_increment_rad: f64::from(0.004_363_323_f32),
        time_increment_s: f64::from(1.736_111_1e-5_f32),
        scan_time_s: f64::from(0.025_f32),
        range_min_m: 0.1,
        range_max_m: 30.0,
        ranges_m: Vec::new(),
        intensities: Vec::new(),
    };
    for k in 0..beams {
        let angle = planar.angle_min_rad + f64::from(k) * planar.angle_increment_rad;
        planar.ranges_m.push(match k % 97 {
            0 => f32::INFINITY,
            1 => f32::NEG_INFINITY,
            _ => ((4.0 + (stamp.nanos() as f64 * 1e-9 + 3.0 * angle).sin()) * 1000.0).round() as f32 / 1000.0,
        });
        planar.intensities.push((k % 256) as f32);
    }
    with_returns(stamp, planar)
}

/// A sweep with its returns, those within the sensor's range, as points.
pub fn with_returns(stamp: Stamp, planar: PlanarScan) -> LidarScan {
    let beams = planar.ranges_m.iter().zip(&planar.intensities).enumerate();
    let back = beams.filter(|(_, (range, _))| (planar.range_min_m..=planar.range_max_m).contains(*range));
    let returns = back.map(|(k, (range, intensity))| {
        let (sin, cos) = (planar.angle_min_rad + k as f64 * planar.angle_increment_rad).sin_cos();
        let r = f64::from(*range);
        LidarReturn {
            offset: Span::from_seconds(k as f64 * planar.time_increment_s),
            point_in_laser: nalgebra::Vector3::new((r * cos) as f32, (r * sin) as f32, 0.0),
            intensity: *intensity,
        }
    });
    LidarScan { stamp, stamped_after: Span::ZERO, returns: returns.collect(), planar: Some(planar) }
}

/// Ground truth of a head that nods and moves on a circle of 1 m.
pub fn truth_sample(now: Stamp, clock: &ClockTruth) -> TruthSample {
    let t = now.nanos() as f64 * 1e-9;
    let nod = from_roll_pitch_yaw(0.0, 0.7 * (7.0 * t).sin(), t);
    let head = Pose::from_parts([t.cos(), t.sin(), 1.4].into(), nod);
    let base = Pose::from_parts([t.cos(), t.sin(), 1.1].into(), from_roll_pitch_yaw(0.0, 0.0, t));
    TruthSample {
        lidar_stamp: now + clock.lidar_offset,
        head: Kinematics::at_rest(head),
        base: Kinematics::at_rest(base),
    }
}

/// The file of a recording of `samples` IMU samples at 100 Hz, scans at 40 Hz and ground truth at 1 kHz.
pub fn record_all(run: RunDescription, samples: i64) -> Vec<u8> {
    let (file, bytes) = shared_file();
    let has_base_imu = run.base_imu.is_some();
    let mut writer = Writer::new(file, run).unwrap();
    let clock = ClockTruth { lidar_offset: Span::ZERO, imu_offset: Span::from_nanos(3_000_000) };
    for k in 0..samples * 10 {
        let now = Stamp::from_nanos(k * 1_000_000);
        writer.truth(now, &truth_sample(now, &clock)).unwrap();
        if k % 10 == 0 {
            writer.clock(now, &clock).unwrap();
            writer.imu(now, &imu_sample(now + clock.imu_offset)).unwrap();
            if has_base_imu {
                writer.base_imu(now, &imu_sample(now + clock.imu_offset)).unwrap();
            }
        }
        if k % 25 == 0 {
            writer.lidar(now, &planar_scan(now)).unwrap();
        }
    }
    writer.finish().unwrap();
    bytes.take()
}

/// Sorts measurements by stamp as the reader does; an IMU sample precedes a scan with the same stamp.
pub fn in_order(mut measurements: Vec<Measurement>) -> Vec<Measurement> {
    measurements.sort_by_key(|measurement| match measurement {
        Measurement::Imu(sample) => (sample.stamp, 0),
        Measurement::Lidar(scan) => (scan.stamp, 1),
    });
    measurements
}

/// The file and the measurements of a recording of `samples` IMU samples at 100 Hz and scans at 40 Hz.
pub fn record(run: RunDescription, samples: i64) -> (Vec<u8>, Vec<Measurement>) {
    let (file, bytes) = shared_file();
    let mut writer = Writer::new(file, run).unwrap();
    let mut written = Vec::new();
    for k in 0..samples * 10 {
        let now = Stamp::from_nanos(k * 1_000_000);
        if k % 10 == 0 {
            let sample = imu_sample(now + Span::from_nanos(3_000_000));
            writer.imu(now, &sample).unwrap();
            written.push(Measurement::Imu(sample));
        }
        if k % 25 == 0 {
            let scan = planar_scan(now);
            writer.lidar(now, &scan).unwrap();
            written.push(Measurement::Lidar(scan));
        }
    }
    writer.finish().unwrap();
    (bytes.take(), written)
}
