use super::{Room, Walk};
use rand::RngExt;
use rand_distr::StandardNormal;
use zsim::geometry::{Pose, Rotation, Vector, from_roll_pitch_yaw};
use zsim::measurement::{
    Calibration, ImuAveraging, ImuNoise, ImuSample, LidarNoise, LidarReturn, LidarScan, Measurement, PlanarScan,
};
use zsim::random::{Seed, Stream};
use zsim::time::{Span, Stamp};

/// A UTM-30LX above and a 3DM-GX2 below the head's origin, with the specified noise.
pub fn calibration() -> Calibration {
    Calibration {
        head_from_laser: Pose::from_parts(Vector::new(0.01, 0.0, 0.04).into(), from_roll_pitch_yaw(0.0, 0.0, 0.0)),
        head_from_imu: Pose::from_parts(
            Vector::new(-0.02, 0.005, -0.03).into(),
            from_roll_pitch_yaw(0.0, 0.0, std::f64::consts::FRAC_PI_2),
        ),
        imu: ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 5.236e-4,
            accel_density_m_per_s2_per_sqrt_hz: 7.85e-4,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 5e-5,
            accel_bias_walk_m_per_s2_per_sqrt_s: 2e-4,
            gyro_turn_on_bias_rad_per_s: 0.2_f64.to_radians(),
            accel_turn_on_bias_m_per_s2: 5e-3 * 9.81,
            gyro_limit_rad_per_s: 600_f64.to_radians(),
            accel_limit_m_per_s2: 5.0 * 9.81,
        },
        imu_averaging: ImuAveraging::BodyMean,
        lidar: LidarNoise { near_sigma_m: 0.010, near_m: 10.0, far_sigma_m: 0.030, far_m: 30.0 },
    }
}

/// Lidar of the head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scanner {
    /// As a UTM-30LX: 1081 beams over 270 degrees in a plane at 40 Hz.
    Plane,
    /// As a VLP-16 with half the azimuths: 16 rings from -15 to 15 degrees fired together, at 10 Hz.
    Rings,
}

impl Scanner {
    /// Duration of a revolution, s, and the beams with their times in it.
    fn beams(self) -> (f64, Vec<(f64, Vector)>) {
        let beam = |azimuth: f64, elevation: f64| {
            let (sin, cos) = elevation.sin_cos();
            Vector::new(azimuth.cos() * cos, azimuth.sin() * cos, sin)
        };
        match self {
            Self::Plane => {
                let angle = |k: i32| (-135.0 + 0.25 * f64::from(k)).to_radians();
                (0.025, (0..1081).map(|k| (f64::from(k) * 0.025 / 1440.0, beam(angle(k), 0.0))).collect())
            }
            Self::Rings => {
                let rings = (0..16).map(|ring| (2.0 * f64::from(ring) - 15.0).to_radians());
                let fired = |k: i32| (f64::from(k) * 0.1 / 900.0, f64::from(k) * std::f64::consts::TAU / 900.0);
                let firing = |(after_s, azimuth)| rings.clone().map(move |up| (after_s, beam(azimuth, up)));
                (0.1, (0..900).map(fired).flat_map(firing).collect())
            }
        }
    }
}

/// A recording of a walk through a room.
#[derive(Debug, Clone)]
pub struct Run {
    pub room: Room,
    pub walk: Walk,
    pub seed: Seed,
    pub duration_s: f64,
    /// 1 for the specified noise, 0 for none.
    pub noise: f64,
    pub clock_offset_s: f64,
    pub clock_drift: f64,
    pub jitter_s: f64,
    pub imu_rate_hz: f64,
    pub scanner: Scanner,
}

fn normal(stream: &mut Stream) -> f64 {
    stream.sample::<f64, _>(StandardNormal)
}

fn normals(stream: &mut Stream) -> Vector {
    Vector::from_fn(|_, _| normal(stream))
}

impl Run {
    pub fn new(room: Room, walk: Walk, seed: u64, duration_s: f64) -> Self {
        Self {
            room,
            walk,
            seed: Seed(seed),
            duration_s,
            noise: 1.0,
            clock_offset_s: 3e-3,
            clock_drift: 1e-3 / 60.0,
            jitter_s: 1e-4,
            imu_rate_hz: 100.0,
            scanner: Scanner::Plane,
        }
    }

    /// Delay of the IMU's stamps at true time `t_s`, s.
    pub fn offset_s(&self, t_s: f64) -> f64 {
        self.clock_offset_s + self.clock_drift * t_s
    }

    /// All measurements in order of arrival.
    pub fn measurements(&self) -> Vec<Measurement> {
        let mut all: Vec<(f64, Measurement)> = self.imu();
        all.extend(self.lidar());
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, measurement)| measurement).collect()
    }

    fn imu(&self) -> Vec<(f64, Measurement)> {
        let (noise, calibration) = (calibration().imu, calibration());
        let (mut white, mut once) = (self.seed.stream("imu/white"), self.seed.stream("imu/once"));
        let mut stamps = self.seed.stream("imu/stamps");
        let scale = self.noise;
        let mut gyro_bias = normals(&mut once) * noise.gyro_turn_on_bias_rad_per_s * scale;
        let mut accel_bias = normals(&mut once) * noise.accel_turn_on_bias_m_per_s2 * scale;
        // Scale 0.1 % on each axis, misalignment 0.05 degrees.
        let mut distortion = || {
            let turn = Rotation::from_scaled_axis(normals(&mut once) * 0.05_f64.to_radians() * scale);
            let axes = normals(&mut once) * (0.001 * scale) + Vector::repeat(1.0);
            turn.to_rotation_matrix().into_inner() * nalgebra::Matrix3::from_diagonal(&axes)
        };
        let (gyro_matrix, accel_matrix) = (distortion(), distortion());
        let dt = 1.0 / self.imu_rate_hz;
        let count = (self.duration_s * self.imu_rate_hz) as usize;
        let mut samples = Vec::with_capacity(count);
        for k in 0..count {
            let centre_s = (k as f64 + 0.5) * dt;
            let (rate, force) = self.mean_of_interval(centre_s, dt, &calibration.head_from_imu);
            gyro_bias += normals(&mut white) * (noise.gyro_bias_walk_rad_per_s_per_sqrt_s * dt.sqrt() * scale);
            accel_bias += normals(&mut white) * (noise.accel_bias_walk_m_per_s2_per_sqrt_s * dt.sqrt() * scale);
            let gyro_white = normals(&mut white) * (noise.gyro_density_rad_per_s_per_sqrt_hz / dt.sqrt() * scale);
            let accel_white = normals(&mut white) * (noise.accel_density_m_per_s2_per_sqrt_hz / dt.sqrt() * scale);
            let stamp_s = centre_s + self.offset_s(centre_s) + self.jitter_s * normal(&mut stamps);
            let sample = ImuSample {
                stamp: Stamp::from_nanos(0) + Span::from_seconds(stamp_s),
                angular_velocity_rad_per_s: gyro_matrix * rate + gyro_bias + gyro_white,
                specific_force_m_per_s2: accel_matrix * force + accel_bias + accel_white,
            };
            samples.push((centre_s + 0.5 * dt, Measurement::Imu(sample)));
        }
        samples
    }

    /// Mean rate and force over an interval: five-point Gauss-Legendre quadrature, exact to ninth order.
    fn mean_of_interval(&self, centre_s: f64, dt_s: f64, head_from_imu: &Pose) -> (Vector, Vector) {
        let nodes = [
            (0.0, 0.568_888_888_888_889),
            (0.538_469_310_105_683, 0.478_628_670_499_366),
            (0.906_179_845_938_664, 0.236_926_885_056_189),
        ];
        let (mut rate, mut force) = (Vector::zeros(), Vector::zeros());
        for (x, weight) in nodes.iter().flat_map(|(x, w)| [(*x, *w), (-*x, if *x == 0.0 { 0.0 } else { *w })]) {
            let imu = self.walk.at(centre_s + 0.5 * dt_s * x).of_frame(head_from_imu);
            rate += imu.angular_velocity_in_body() * (0.5 * weight);
            force += imu.specific_force_in_body() * (0.5 * weight);
        }
        (rate, force)
    }

    fn lidar(&self) -> Vec<(f64, Measurement)> {
        let mut stream = self.seed.stream("lidar");
        let (noise, head_from_laser) = (calibration().lidar, calibration().head_from_laser);
        let bias_m = 0.005 * normal(&mut stream) * self.noise;
        let (scan_s, beams) = self.scanner.beams();
        let room_from_world = self.walk.world_from_room.inverse();
        let mut scans = Vec::new();
        for k in 0..(self.duration_s / scan_s) as usize {
            let start_s = k as f64 * scan_s;
            let mut returns = Vec::with_capacity(beams.len());
            for (after_s, direction) in beams.iter().copied() {
                let room_from_laser = room_from_world * self.walk.pose(start_s + after_s) * head_from_laser;
                let true_range =
                    self.room.cast(&room_from_laser.translation.vector, &(room_from_laser.rotation * direction));
                let white = noise.sigma_m(true_range) * normal(&mut stream) * self.noise;
                let mut range = true_range + bias_m + white;
                if self.noise > 0.0 {
                    range = (range * 1e3).round() / 1e3;
                }
                let point = (direction * range).cast::<f32>();
                returns.push(LidarReturn {
                    offset: Span::from_seconds(after_s),
                    point_in_laser: point,
                    intensity: 0.0,
                });
            }
            let stamp = Stamp::from_nanos(0) + Span::from_seconds(start_s);
            let planar = PlanarScan {
                angle_min_rad: -135_f64.to_radians(),
                angle_increment_rad: 0.25_f64.to_radians(),
                time_increment_s: scan_s / 1440.0,
                scan_time_s: scan_s,
                range_min_m: 0.1,
                range_max_m: 30.0,
                ranges_m: Vec::new(),
                intensities: Vec::new(),
            };
            let planar = (self.scanner == Scanner::Plane).then_some(planar);
            scans.push((
                start_s + scan_s,
                Measurement::Lidar(LidarScan { stamp, stamped_after: Span::ZERO, returns, planar }),
            ));
        }
        scans
    }
}
