//! Output of final poses, which later windows do not change.

use super::Estimator;
use super::phase::{Phase, Tracking};
use crate::EstimatedPose;
use crate::window::Window;
use zsim_base::geometry::{Pose, Rotation};
use zsim_base::time::{Span, Stamp};

impl Estimator {
    /// Returns the poses so far after `after`, up to the end of the window.
    ///
    /// They are at whole multiples of the IMU period. Later windows change them; [`Self::take_poses`] returns them when
    /// they are final. None before the first window, before the localisation in a given map, and while the place after
    /// a gap is not known.
    pub fn newest_poses(&self, after: Option<Stamp>) -> Vec<EstimatedPose> {
        let Phase::Tracking(tracking) = &self.phase else { return Vec::new() };
        let is_unplaced = self.map_localisation.as_ref().is_some_and(|map| map.found().is_none());
        if is_unplaced || self.phase.awaits_relocalisation() {
            return Vec::new();
        }
        let window = &tracking.window;
        let first_u_s = window.nominal.times_s().first().copied().unwrap_or(f64::INFINITY);
        let first = after.unwrap_or_else(|| self.intake.stamp(window.unknowns.clock.lidar_s(first_u_s)));
        let mut stamp = self.multiple_after(first);
        let mut poses = Vec::new();
        loop {
            let tau_s = stamp.seconds_since(self.intake.origin());
            let u_s = window.unknowns.clock.trajectory_s(tau_s);
            if u_s.is_nan() || u_s > window.nominal.end_s() {
                return poses;
            }
            if u_s >= first_u_s {
                poses.push(self.pose_at(window, stamp, tau_s, u_s));
            }
            stamp += self.pose_period();
        }
    }

    /// Time between poses: the IMU period in whole milliseconds.
    fn pose_period(&self) -> Span {
        Span::from_nanos(self.intake.imu_period_s().map_or(10, |s| (s * 1e3).round().max(1.0) as i64) * 1_000_000)
    }

    /// The first multiple of the period of poses after `stamp`.
    fn multiple_after(&self, stamp: Stamp) -> Stamp {
        let period_ns = self.pose_period().nanos();
        Stamp::from_nanos((stamp.nanos().div_euclid(period_ns) + 1) * period_ns)
    }

    /// Outputs the poses up to `until_u_s` (trajectory time) at whole multiples of the IMU period.
    pub(super) fn output_poses(&mut self, tracking: &mut Tracking, until_u_s: f64) {
        let window = &tracking.window;
        let first_u_s = window.nominal.times_s().first().copied().unwrap_or(f64::INFINITY);
        let mut stamp = tracking
            .next_pose
            .unwrap_or_else(|| self.multiple_after(self.intake.stamp(window.unknowns.clock.lidar_s(first_u_s))));
        // After a gap the window may start before the last pose; the stamps must still increase strictly.
        if let Some(last) = self.newest_pose.filter(|last| stamp <= *last) {
            stamp = self.multiple_after(last);
        }
        loop {
            let tau_s = stamp.seconds_since(self.intake.origin());
            let u_s = window.unknowns.clock.trajectory_s(tau_s);
            if u_s.is_nan() || u_s > until_u_s {
                break;
            }
            self.poses.push(self.pose_at(window, stamp, tau_s, u_s));
            self.newest_pose = Some(stamp);
            stamp += self.pose_period();
        }
        tracking.next_pose = Some(stamp);
    }

    /// The pose at `stamp`, which is `tau_s` in lidar time and `u_s` in trajectory time, s.
    fn pose_at(&self, window: &Window, stamp: Stamp, tau_s: f64, u_s: f64) -> EstimatedPose {
        let imu_from_head = self.calibration.head_from_imu.inverse();
        let motion = window.nominal.at(u_s, &window.unknowns.biases.gyro);
        let rotation = Rotation::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(motion.rotation));
        let map_from_imu = Pose::from_parts(motion.position.into(), rotation);
        let map_from_head = map_from_imu * imu_from_head;
        let arm = rotation * imu_from_head.translation.vector;
        EstimatedPose {
            stamp,
            map_from_head,
            covariance: self.local_map.consider.covariance_at(&map_from_head.translation.vector),
            covariance_against_gauge: self
                .local_map
                .consider
                .covariance_against_gauge(&map_from_head.translation.vector),
            velocity_in_map_m_per_s: motion.velocity + motion.angular_velocity.cross(&arm),
            gyro_bias_rad_per_s: window.unknowns.biases.gyro,
            accel_bias_m_per_s2: window.unknowns.biases.accel,
            clock_offset_s: window.unknowns.clock.offset_at(tau_s),
        }
    }
}
