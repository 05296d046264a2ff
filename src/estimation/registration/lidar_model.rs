//! Lidar model of the registration: a range bias common to all surfels, and one of weak echoes.
//!
//! A rangefinder that triggers on the leading edge of the echo measures a longer range to a weaker echo. The bias is modelled as
//! proportional to the inverse power of the echo, with an intensity proportional to the square root of the power. It makes
//! distant walls seem to approach by more than the head moves, and so a map too large.
//!
//! A surfel with the intensity `I` moves by `u (o + w (I_median / I)^2)`, with `u` the unit vector from the lidar to it, the common
//! bias `o` and the bias `w` of an echo of median intensity.
//!
//! The extrinsics are not estimated here: the open loop determined them with the IMU, and the matches of the registration add
//! no information. As their estimate changed during the open loop, [`recalibrated`] recomputes the head's poses with the final
//! extrinsics.

use super::equations::{Shared, SharedTerm};
use crate::EstimatorSpec;
use crate::observed::ObservedSurfels;
use crate::surfel::Patch;
use zsim_base::geometry::{Pose, Rotation, Trajectory, TrajectoryError, Vector};
use zsim_base::measurement::{Calibration, LidarCorrection};

/// Largest assumed squared ratio of the median intensity to that of a surfel: limits the effect of a wrong intensity.
const MAX_WEAKNESS: f64 = 100.0;

/// Pose and estimated correction of the lidar.
#[derive(Debug, Clone, Copy)]
pub(super) struct LidarModel {
    /// Pose of the lidar in the head frame, by the open loop.
    head_from_laser: Pose,
    pub(super) lidar: LidarCorrection,
    /// Range correction of an echo of median intensity, in proportion to the inverse square of the intensity, m.
    pub(super) weak_range_m: f64,
    /// Squared median intensity of the surfels; 0 without intensities.
    median_power: f64,
    /// Prior standard deviations of both range biases, m.
    sigmas_m: [f64; 2],
}

/// The vector from the lidar to a surfel.
#[derive(Debug, Clone, Copy)]
pub(super) struct LidarRay {
    /// Vector to the centre of the surfel, in map axes, m.
    vector: Vector,
    /// Squared ratio of the median intensity to that of the surfel.
    weakness: f64,
}

impl LidarModel {
    /// Starts with the estimate of the open loop; the range biases are fixed if they are unobservable.
    pub(super) fn new(
        calibration: &Calibration,
        lidar: &LidarCorrection,
        observed: &ObservedSurfels,
        spec: &EstimatorSpec,
    ) -> Self {
        let sigmas_m = [spec.surfels.range_offset_sigma_m, spec.registration.weak_bias_sigma_m];
        let sigmas_m = if observed.range_bias_is_fixed { [0.0; 2] } else { sigmas_m };
        let mut weaknesses: Vec<f64> =
            observed.surfels.iter().map(|surfel| surfel.weakness).filter(|weakness| *weakness > 0.0).collect();
        weaknesses.sort_unstable_by(f64::total_cmp);
        Self {
            head_from_laser: calibration.head_from_corrected_laser(lidar),
            lidar: *lidar,
            // A tiny standard deviation fixes a bias.
            sigmas_m: sigmas_m.map(|sigma_m| sigma_m.max(1e-9)),
            weak_range_m: 0.0,
            median_power: weaknesses.get(weaknesses.len() / 2).map_or(0.0, |weakness| weakness.recip()),
        }
    }

    /// Vector from the lidar to `patch`, observed by a head at `map_from_head`.
    ///
    /// The patch was built with the correction `made_by` from returns of the mean `weakness`; it is moved to match the current
    /// range biases.
    pub(super) fn ray_to(
        &self,
        map_from_head: &Pose,
        patch: &mut Patch,
        made_by: &LidarCorrection,
        weakness: f64,
    ) -> LidarRay {
        let lidar_at = (map_from_head * self.head_from_laser).translation.vector;
        let old_vector = patch.centre - lidar_at;
        let weakness = (weakness * self.median_power).min(MAX_WEAKNESS);
        let longer_m = self.lidar.range_m - made_by.range_m + self.weak_range_m * weakness;
        let vector = old_vector * (1.0 + longer_m / old_vector.norm());
        patch.centre = lidar_at + vector;
        LidarRay { vector, weakness }
    }

    /// Adds the prior of the range biases.
    pub(super) fn add_to(&self, shared_term: &mut SharedTerm) {
        let [range_sigma_m, weak_sigma_m] = self.sigmas_m;
        shared_term.add(&Shared::new(1.0, 0.0), self.lidar.range_m, range_sigma_m.powi(-2));
        shared_term.add(&Shared::new(0.0, 1.0), self.weak_range_m, weak_sigma_m.powi(-2));
    }

    /// Applies a step.
    pub(super) fn correct(&mut self, step: &Shared) {
        self.lidar.range_m += step[0];
        self.weak_range_m += step[1];
    }
}

impl LidarRay {
    /// Derivative of the distance along `normal` by the range biases.
    pub(super) fn derivative(&self, normal: &Vector) -> Shared {
        Shared::new(1.0, self.weakness) * normal.dot(&self.vector.normalize())
    }

    /// Rotates the vector with the trajectory.
    pub(super) fn rotate(&mut self, turn: &Rotation) {
        self.vector = turn * self.vector;
    }

    /// Moves the patch by a step of the lidar; returns the displacement of the centre, m.
    pub(super) fn correct(&mut self, step: &Shared, patch: &mut Patch) -> Vector {
        let moved = self.vector * ((step[0] + step[1] * self.weakness) / self.vector.norm());
        patch.centre += moved;
        self.vector += moved;
        moved
    }
}

/// Rotates a patch about the centre.
pub(super) fn rotate_patch(patch: &mut Patch, turn: &Rotation) {
    let turn = turn.to_rotation_matrix().into_inner();
    patch.normal = turn * patch.normal;
    patch.covariance = turn * patch.covariance * turn.transpose();
}

/// Recomputes the trajectory of the head with the final extrinsics `lidar`.
///
/// The surfels, and therefore the poses of the lidar, stay unchanged; the poses of the head follow from these.
pub(super) fn recalibrated(
    map_from_head: &Trajectory,
    observed: &ObservedSurfels,
    calibration: &Calibration,
    lidar: &LidarCorrection,
) -> Result<Trajectory, TrajectoryError> {
    let laser_from_head = calibration.head_from_corrected_laser(lidar).inverse();
    let recalibrate = |(stamp, pose): (_, &Pose)| {
        let then = observed.lidar_at(stamp);
        let head_from_head =
            then.map_or_else(Pose::identity, |then| calibration.head_from_corrected_laser(then) * laser_from_head);
        (stamp, pose * head_from_head)
    };
    Trajectory::from_poses(map_from_head.iter().map(recalibrate))
}

#[cfg(test)]
mod tests {
    use super::super::equations::SHARED_DIMENSION;
    use super::*;
    use crate::load;
    use crate::observed::ObservedSurfel;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Matrix, from_roll_pitch_yaw};
    use zsim_base::measurement::{ImuAveraging, ImuNoise, LidarNoise};
    use zsim_base::time::{Span, Stamp};

    fn calibration() -> Calibration {
        Calibration {
            head_from_laser: Pose::from_parts(Vector::new(0.1, -0.2, 0.3).into(), from_roll_pitch_yaw(0.1, 0.2, 0.3)),
            head_from_imu: Pose::from_parts(Vector::new(0.2, 0.1, -0.1).into(), from_roll_pitch_yaw(-0.4, 0.1, 1.3)),
            imu: ImuNoise {
                gyro_density_rad_per_s_per_sqrt_hz: 1.0,
                accel_density_m_per_s2_per_sqrt_hz: 1.0,
                gyro_bias_walk_rad_per_s_per_sqrt_s: 1.0,
                accel_bias_walk_m_per_s2_per_sqrt_s: 1.0,
                gyro_turn_on_bias_rad_per_s: 1.0,
                accel_turn_on_bias_m_per_s2: 1.0,
                gyro_scale_error: 0.0,
                gyro_misalignment_rad: 0.0,
                accel_scale_error: 0.0,
                accel_misalignment_rad: 0.0,
                gyro_limit_rad_per_s: 1.0,
                accel_limit_m_per_s2: 1.0,
            },
            imu_averaging: ImuAveraging::ConingCorrected,
            lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
        }
    }

    fn model(lidar: LidarCorrection) -> LidarModel {
        let mut spec = load("default").unwrap();
        spec.extrinsics.estimated = true;
        let wall = Patch {
            centre: Vector::x(),
            normal: Vector::x(),
            points: 50.0,
            covariance: Matrix::identity(),
            roughness_variance: 0.0,
            level: 0,
        };
        let surfel = |weakness: f64| ObservedSurfel { tau_s: 0.0, patch: wall, weakness, lidar: 0 };
        let surfels = vec![surfel(1e-6), surfel(4e-6), surfel(9e-6)];
        LidarModel::new(&calibration(), &lidar, &ObservedSurfels { surfels, ..ObservedSurfels::default() }, &spec)
    }

    fn map_from_head() -> Pose {
        Pose::from_parts(Vector::new(3.0, 1.0, 1.5).into(), from_roll_pitch_yaw(0.3, -0.5, 2.0))
    }

    fn correction(scale: f64) -> LidarCorrection {
        LidarCorrection {
            range_m: 0.01 * scale,
            rotation: from_roll_pitch_yaw(0.02 * scale, -0.01 * scale, 0.03 * scale),
            translation: Vector::new(0.005, -0.01, 0.02) * scale,
        }
    }

    /// A patch at `range_m` along `direction` from the lidar of `model`.
    fn patch_at(model: &LidarModel, direction: &Vector, range_m: f64) -> Patch {
        let map_from_laser = map_from_head() * model.head_from_laser;
        let centre = map_from_laser.translation.vector + map_from_laser.rotation * direction * range_m;
        let covariance = Matrix::from_diagonal(&Vector::new(0.02, 0.05, 1e-4));
        Patch { centre, normal: Vector::z(), points: 50.0, covariance, roughness_variance: 0.0, level: 0 }
    }

    #[test]
    fn patch_with_an_old_range_bias_is_moved_to_the_new_one() {
        let (direction, now) = (Vector::new(2.0, 3.0, -1.0).normalize(), model(correction(1.0)));
        let then = LidarCorrection { range_m: -0.007, ..now.lidar };
        let mut patch = patch_at(&now, &direction, 3.0 + then.range_m);
        now.ray_to(&map_from_head(), &mut patch, &then, 0.0);
        assert_relative_eq!(patch.centre, patch_at(&now, &direction, 3.0 + now.lidar.range_m).centre, epsilon = 1e-12);
    }

    #[test]
    fn derivatives_match_finite_differences_and_steps() {
        let (start, normal) = (model(correction(1.0)), Vector::new(0.3, -0.8, 0.5).normalize());
        let patch = patch_at(&start, &Vector::new(2.0, 3.0, -4.0).normalize(), 4.0);
        let ray = start.ray_to(&map_from_head(), &mut { patch }, &start.lidar, 1e-5);
        for k in 0..SHARED_DIMENSION {
            let step = Shared::from_fn(|row, _| if row == k { 1e-6 } else { 0.0 });
            let mut there = start;
            there.correct(&step);
            let mut moved = patch;
            there.ray_to(&map_from_head(), &mut moved, &start.lidar, 1e-5);
            let moved = moved.centre - patch.centre;
            assert_relative_eq!(ray.derivative(&normal)[k], normal.dot(&moved) * 1e6, epsilon = 1e-5);
            let by_step = { ray }.correct(&step, &mut { patch });
            assert_relative_eq!(by_step, moved, epsilon = 1e-11);
        }
    }

    #[test]
    fn recalibration_keeps_the_poses_of_the_lidar() {
        let stamp = |k: i64| Stamp::from_nanos(k * 500_000_000);
        let mut observed = ObservedSurfels::default();
        let (early, late) = (correction(-0.5), correction(1.0));
        observed.extend(Stamp::from_nanos(0), std::iter::empty(), early, 0.75);
        observed.extend(Stamp::from_nanos(0), std::iter::empty(), late, 2.0);
        let poses = (0..5).map(|k| {
            let along = Pose::from_parts(Vector::new(k as f64, 0.5, 1.0).into(), Rotation::identity());
            (stamp(k), along * map_from_head())
        });
        let open = Trajectory::from_poses(poses).unwrap();
        let calibration = calibration();
        let anew = recalibrated(&open, &observed, &calibration, &late).unwrap();
        for ((at, before), after) in open.iter().zip(anew.poses()) {
            let known_then = if at <= stamp(0) + Span::from_seconds(0.75) { early } else { late };
            let was = before * calibration.head_from_corrected_laser(&known_then);
            let is = after * calibration.head_from_corrected_laser(&late);
            assert_relative_eq!(was.translation.vector, is.translation.vector, epsilon = 1e-12);
            assert!(was.rotation.angle_to(&is.rotation) < 1e-12);
        }
    }
}
