use super::EvaluationError;
use std::collections::VecDeque;
use zsim_base::geometry::{Pose, Rotation, STANDARD_GRAVITY_M_PER_S2, Trajectory, Vector};
use zsim_base::measurement::ImuSample;
use zsim_base::time::{Span, Stamp};

/// Time between output poses.
const OUTPUT_PERIOD: Span = Span::from_nanos(100_000_000);

/// Limits that define rest at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestDetection {
    /// Maximum deviation of the angular velocity from the running mean, rad/s.
    pub gyro_rad_per_s: f64,
    /// Maximum deviation of the specific force from the running mean, m/s^2.
    pub accel_m_per_s2: f64,
    /// Minimum duration of the rest, s.
    pub min_s: f64,
    /// Delay with which a motion is detected, s: the last part of the rest of this length is not averaged.
    pub onset_s: f64,
}

impl Default for RestDetection {
    /// Ten standard deviations of the noise of a 3DM-GX2 at 100 Hz; 0.5 s for both times.
    fn default() -> Self {
        Self { gyro_rad_per_s: 0.06, accel_m_per_s2: 0.3, min_s: 0.5, onset_s: 0.5 }
    }
}

/// Dead reckoning by the IMU only: raw samples integrated from a start at rest, the simplest strapdown.
///
/// The rest determines the gyroscope bias (the mean) and down (the mean specific force, with the magnitude of
/// gravity). Then attitude, velocity and position are integrated by the trapezoidal rule. Samples that run
/// backwards in time or are not finite are skipped. The map's origin is the position of the IMU at rest, the heading
/// is arbitrary.
#[derive(Debug, Clone)]
pub struct DeadReckoning {
    rest: RestDetection,
    imu_from_head: Pose,
    start: RestMean,
    still: bool,
    /// The last samples of the rest, which can include the onset of motion.
    queue: VecDeque<ImuSample>,
    latest: Option<Stamp>,
    previous: Option<ImuSample>,
    map_from_imu: Rotation,
    position_in_map: Vector,
    velocity_in_map: Vector,
    trajectory: Trajectory,
}

/// Running means over the rest.
#[derive(Debug, Clone, Default)]
struct RestMean {
    first: Option<Stamp>,
    last: Option<Stamp>,
    count: f64,
    gyro: Vector,
    accel: Vector,
}

impl RestMean {
    fn take(&mut self, sample: &ImuSample) {
        self.first.get_or_insert(sample.stamp);
        self.last = Some(sample.stamp);
        self.count += 1.0;
        self.gyro += (sample.angular_velocity_rad_per_s - self.gyro) / self.count;
        self.accel += (sample.specific_force_m_per_s2 - self.accel) / self.count;
    }

    fn seconds(&self) -> f64 {
        self.first.zip(self.last).map_or(0.0, |(first, last)| last.seconds_since(first))
    }
}

impl DeadReckoning {
    /// Creates the dead reckoning of a head with the IMU at `head_from_imu`.
    pub fn new(head_from_imu: &Pose, rest: RestDetection) -> Self {
        Self {
            rest,
            imu_from_head: head_from_imu.inverse(),
            start: RestMean::default(),
            still: true,
            queue: VecDeque::new(),
            latest: None,
            previous: None,
            map_from_imu: Rotation::identity(),
            position_in_map: Vector::zeros(),
            velocity_in_map: Vector::zeros(),
            trajectory: Trajectory::new(),
        }
    }

    /// Processes the next sample.
    pub fn push(&mut self, sample: &ImuSample) {
        let finite = |v: &Vector| v.iter().all(|x| x.is_finite());
        let usable = finite(&sample.angular_velocity_rad_per_s) && finite(&sample.specific_force_m_per_s2);
        if !usable || self.latest.is_some_and(|latest| sample.stamp <= latest) {
            return;
        }
        self.latest = Some(sample.stamp);
        if self.still && self.is_at_rest(sample) {
            self.delay(sample);
        } else {
            self.still = false;
            for sample in std::mem::take(&mut self.queue) {
                self.step(&sample);
            }
            self.step(sample);
        }
    }

    /// Delays a sample, so that the onset of motion is not averaged.
    fn delay(&mut self, sample: &ImuSample) {
        self.queue.push_back(*sample);
        while self.queue.front().is_some_and(|first| sample.stamp.seconds_since(first.stamp) >= self.rest.onset_s) {
            let Some(settled) = self.queue.pop_front() else { return };
            self.start.take(&settled);
            self.map_from_imu = level(&self.start.accel);
            self.output_pose(&settled);
        }
    }

    fn is_at_rest(&self, sample: &ImuSample) -> bool {
        let Some(reference) = self.queue.front() else { return true };
        let (gyro, accel) = match self.start.count {
            0.0 => (reference.angular_velocity_rad_per_s, reference.specific_force_m_per_s2),
            _ => (self.start.gyro, self.start.accel),
        };
        let gyro = (sample.angular_velocity_rad_per_s - gyro).norm();
        let accel = (sample.specific_force_m_per_s2 - accel).norm();
        gyro <= self.rest.gyro_rad_per_s && accel <= self.rest.accel_m_per_s2
    }

    fn step(&mut self, sample: &ImuSample) {
        let Some(before) = self.previous else { return self.output_pose(sample) };
        let dt_s = sample.stamp.seconds_since(before.stamp);
        let rate = (before.angular_velocity_rad_per_s + sample.angular_velocity_rad_per_s) / 2.0 - self.start.gyro;
        let turned = self.map_from_imu * Rotation::from_scaled_axis(rate * dt_s);
        let force =
            (self.map_from_imu * before.specific_force_m_per_s2 + turned * sample.specific_force_m_per_s2) / 2.0;
        let acceleration = force - Vector::z() * self.start.accel.norm();
        self.position_in_map += self.velocity_in_map * dt_s + acceleration * (dt_s * dt_s / 2.0);
        self.velocity_in_map += acceleration * dt_s;
        self.map_from_imu = turned;
        self.output_pose(sample);
    }

    fn output_pose(&mut self, sample: &ImuSample) {
        self.previous = Some(*sample);
        let map_from_imu = Pose::from_parts(self.position_in_map.into(), self.map_from_imu);
        if self.trajectory.span().is_some_and(|(_, last)| sample.stamp - last < OUTPUT_PERIOD) {
            return;
        }
        // The pose is not finite only if the integration diverged; the trajectory ends there.
        let _ = self.trajectory.push(sample.stamp, map_from_imu * self.imu_from_head);
    }

    /// Returns `map_from_head` at 10 Hz on the IMU clock.
    ///
    /// If the recording is at rest to the end, the last 0.5 s are missing.
    ///
    /// # Errors
    /// When the rest at the start was too short.
    pub fn finish(self) -> Result<Trajectory, EvaluationError> {
        let (needed_s, found_s) = (self.rest.min_s, self.start.seconds());
        let weightless = self.start.accel.norm() < STANDARD_GRAVITY_M_PER_S2 / 2.0;
        if found_s < needed_s || weightless {
            return Err(EvaluationError::NoRest { needed_s, found_s: if weightless { 0.0 } else { found_s } });
        }
        Ok(self.trajectory)
    }
}

/// The attitude with zero heading in which the specific force at rest points up.
fn level(specific_force: &Vector) -> Rotation {
    // If it points straight down, the shortest rotation is not unique: use a half turn about a horizontal axis.
    Rotation::rotation_between(specific_force, &Vector::z())
        .unwrap_or_else(|| Rotation::from_scaled_axis(Vector::x() * std::f64::consts::PI))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Kinematics, from_roll_pitch_yaw};

    /// At rest for 2 s, then `x = a (1 - cos w s)^2 / 4` forward while pitching by the same law: smooth, back and
    /// forth.
    fn motion(t_s: f64) -> Kinematics {
        let (size, w) = (1.0, 1.5);
        let s = (t_s - 2.0).max(0.0);
        let (sin, cos) = (w * s).sin_cos();
        let value = size * (1.0 - cos).powi(2) / 4.0;
        let rate = size * w * sin * (1.0 - cos) / 2.0;
        let second = size * w * w * (cos * (1.0 - cos) + sin * sin) / 2.0;
        Kinematics {
            world_from_body: Pose::from_parts(
                Vector::x_axis().scale(value).into(),
                from_roll_pitch_yaw(0.0, value, 0.0),
            ),
            velocity_in_world: Vector::x() * rate,
            angular_velocity_in_world: Vector::y() * rate,
            acceleration_in_world: Vector::x() * second,
            angular_acceleration_in_world: Vector::y() * second,
        }
    }

    fn reckon(head_from_imu: &Pose, gyro_bias: Vector, seconds: f64) -> Result<Trajectory, EvaluationError> {
        let mut reckoning = DeadReckoning::new(head_from_imu, RestDetection::default());
        for k in 0..(seconds * 1000.0) as i64 {
            let imu = motion(k as f64 * 1e-3).of_frame(head_from_imu);
            reckoning.push(&ImuSample {
                stamp: Stamp::from_nanos(k * 1_000_000),
                angular_velocity_rad_per_s: imu.angular_velocity_in_body() + gyro_bias,
                specific_force_m_per_s2: imu.specific_force_in_body(),
            });
        }
        reckoning.finish()
    }

    #[test]
    fn a_noise_free_imu_with_lever_arm_and_bias_gives_the_true_trajectory() {
        // 2 mm and 0.02 degrees over 10 s at 1 kHz. The map origin is the IMU at rest, level, with the heading of the
        // head.
        let head_from_imu = Pose::from_parts(Vector::new(0.02, -0.01, -0.06).into(), Rotation::identity());
        let found = reckon(&head_from_imu, Vector::new(0.01, -0.02, 0.005), 12.0).unwrap();
        let map_from_world = head_from_imu.inverse();
        for (stamp, pose) in found.iter() {
            let expected = map_from_world * motion(stamp.nanos() as f64 * 1e-9).world_from_body;
            assert!((pose.translation.vector - expected.translation.vector).norm() < 2e-3, "at {stamp:?}");
            assert!(pose.rotation.angle_to(&expected.rotation) < 0.02_f64.to_radians(), "at {stamp:?}");
        }
    }

    #[test]
    fn a_tilted_start_is_levelled() {
        let tilt = from_roll_pitch_yaw(0.3, -0.2, 0.0);
        let rotation = level(&(tilt.inverse() * Vector::z()));
        assert_relative_eq!(rotation * (tilt.inverse() * Vector::z()), Vector::z(), epsilon = 1e-12);
        assert_relative_eq!(level(&-Vector::z()) * -Vector::z(), Vector::z(), epsilon = 1e-12);
    }

    #[test]
    fn without_a_rest_there_is_no_dead_reckoning() {
        let error = reckon(&Pose::identity(), Vector::zeros(), 0.9).unwrap_err();
        assert!(matches!(error, EvaluationError::NoRest { needed_s, .. } if needed_s == 0.5));
    }
}
