//! The lidar among the unknowns: how its ranges differ from what the open loop took them for.
//!
//! Common to all that was seen, it stands beside the knots' corrections: a range longer by `o` moves a surfel's centre
//! by `u o`, with `u` the unit vector to it from the lidar.
//!
//! How the lidar sits on the IMU is not among the unknowns: the open loop has told it by the IMU, and what was seen
//! says nothing more of it. As the open loop went on it learnt better, so what it then took the head's poses for is
//! told anew: [`remounted`].

use super::equations::Beside;
use crate::estimation::EstimatorSpec;
use crate::estimation::surfel::Patch;
use crate::estimation::survey::Survey;
use crate::geometry::{Pose, Rotation, Trajectory, Vector};
use crate::measurement::{Calibration, LidarCorrection};
use nalgebra::SVector;

/// Unknowns of the lidar: the offset of its ranges, m.
pub(super) const SHARED: usize = 1;
/// Those of one residual, or of a step.
pub(super) type Shared = SVector<f64, SHARED>;

/// How the lidar measures: as calibrated, and as it is known now.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mount {
    /// Where the lidar is in the head, as the open loop left it.
    head_from_laser: Pose,
    pub(super) lidar: LidarCorrection,
    /// Standard deviation of the ranges' offset, m.
    range_sigma_m: f64,
}

/// From where a surfel was seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    /// From the lidar to the surfel's centre, m.
    reach: Vector,
}

impl Mount {
    /// As the open loop left it, with the ranges held where nothing tells their offset.
    pub(super) fn new(
        calibration: &Calibration,
        (lidar, ranges_are_held): (&LidarCorrection, bool),
        spec: &EstimatorSpec,
    ) -> Self {
        let range_sigma_m = if ranges_are_held { 0.0 } else { spec.surfels.range_offset_sigma_m };
        Self {
            head_from_laser: calibration.head_from_corrected_laser(lidar),
            lidar: *lidar,
            // What is left at zero is held there.
            range_sigma_m: range_sigma_m.max(1e-9),
        }
    }

    /// From where `patch`, made by the correction `made_by`, was seen by a head at `map_from_head`; the patch becomes
    /// what the lidar as it is known now makes of it.
    pub(super) fn sight(&self, map_from_head: &Pose, patch: &mut Patch, made_by: &LidarCorrection) -> Sight {
        let lidar_at = (map_from_head * self.head_from_laser).translation.vector;
        let seen = patch.centre - lidar_at;
        let reach = seen * (1.0 + (self.lidar.range_m - made_by.range_m) / seen.norm());
        patch.centre = lidar_at + reach;
        Sight { reach }
    }

    /// Adds what the calibration says of the correction so far.
    pub(super) fn add_to(&self, beside: &mut Beside) {
        beside.add(&Shared::new(1.0), self.lidar.range_m, self.range_sigma_m.powi(-2));
    }

    /// Takes a step.
    pub(super) fn correct(&mut self, step: &Shared) {
        self.lidar.range_m += step[0];
    }
}

impl Sight {
    /// By how much the distance along `normal` grows with the ranges.
    pub(super) fn by(&self, normal: &Vector) -> Shared {
        Shared::new(normal.dot(&self.reach.normalize()))
    }

    /// The trajectory turns at its time.
    pub(super) fn turn(&mut self, turn: &Rotation) {
        self.reach = turn * self.reach;
    }

    /// Moves a patch, seen from here, by a step of the lidar; by how much its centre moves, m.
    pub(super) fn correct(&mut self, step: &Shared, patch: &mut Patch) -> Vector {
        let moved = self.reach * (step[0] / self.reach.norm());
        patch.centre += moved;
        self.reach += moved;
        moved
    }
}

/// Turns a patch about its centre.
pub(super) fn turn_patch(patch: &mut Patch, turn: &Rotation) {
    let turn = turn.to_rotation_matrix().into_inner();
    patch.normal = turn * patch.normal;
    patch.covariance = turn * patch.covariance * turn.transpose();
}

/// The trajectory of a head whose lidar had been known all along as `lidar`, while what was seen stays where it is: the
/// lidar was where the survey has it, and the head is told from there.
pub(super) fn remounted(
    map_from_head: &Trajectory,
    survey: &Survey,
    (calibration, lidar): (&Calibration, &LidarCorrection),
) -> Trajectory {
    let laser_from_head = calibration.head_from_corrected_laser(lidar).inverse();
    let told_anew = |(stamp, pose): (_, &Pose)| {
        let then = survey.lidar_at(stamp);
        let head_from_head =
            then.map_or_else(Pose::identity, |then| calibration.head_from_corrected_laser(then) * laser_from_head);
        (stamp, pose * head_from_head)
    };
    Trajectory::from_poses(map_from_head.iter().map(told_anew)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::load;
    use crate::geometry::{Matrix, from_roll_pitch_yaw};
    use crate::measurement::{ImuNoise, LidarNoise};
    use crate::time::{Span, Stamp};
    use approx::assert_relative_eq;

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
                gyro_limit_rad_per_s: 1.0,
                accel_limit_m_per_s2: 1.0,
            },
            lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
        }
    }

    fn mount(lidar: LidarCorrection) -> Mount {
        let mut spec = load("default").unwrap();
        spec.extrinsics.estimated = true;
        Mount::new(&calibration(), (&lidar, false), &spec)
    }

    fn map_from_head() -> Pose {
        Pose::from_parts(Vector::new(3.0, 1.0, 1.5).into(), from_roll_pitch_yaw(0.3, -0.5, 2.0))
    }

    fn correction(scale: f64) -> LidarCorrection {
        LidarCorrection {
            range_m: 0.01 * scale,
            turn: from_roll_pitch_yaw(0.02 * scale, -0.01 * scale, 0.03 * scale),
            shift: Vector::new(0.005, -0.01, 0.02) * scale,
        }
    }

    /// A patch `range_m` along `direction` from the lidar of `mount`.
    fn seen(mount: &Mount, direction: &Vector, range_m: f64) -> Patch {
        let map_from_laser = map_from_head() * mount.head_from_laser;
        let centre = map_from_laser.translation.vector + map_from_laser.rotation * direction * range_m;
        let covariance = Matrix::from_diagonal(&Vector::new(0.02, 0.05, 1e-4));
        Patch { centre, normal: Vector::z(), points: 50.0, covariance, roughness_variance: 0.0, level: 0 }
    }

    #[test]
    fn a_patch_made_by_older_ranges_becomes_that_of_the_newer() {
        let (direction, now) = (Vector::new(2.0, 3.0, -1.0).normalize(), mount(correction(1.0)));
        let then = LidarCorrection { range_m: -0.007, ..now.lidar };
        let mut patch = seen(&now, &direction, 3.0 + then.range_m);
        now.sight(&map_from_head(), &mut patch, &then);
        assert_relative_eq!(patch.centre, seen(&now, &direction, 3.0 + now.lidar.range_m).centre, epsilon = 1e-12);
    }

    #[test]
    fn derivatives_are_those_of_differences_and_steps_move_the_patch_by_them() {
        let (start, normal) = (mount(correction(1.0)), Vector::new(0.3, -0.8, 0.5).normalize());
        let patch = seen(&start, &Vector::new(2.0, 3.0, -4.0).normalize(), 4.0);
        let sight = start.sight(&map_from_head(), &mut { patch }, &start.lidar);
        for k in 0..SHARED {
            let step = Shared::from_fn(|row, _| if row == k { 1e-6 } else { 0.0 });
            let mut there = start;
            there.correct(&step);
            let mut moved = patch;
            there.sight(&map_from_head(), &mut moved, &start.lidar);
            let moved = moved.centre - patch.centre;
            assert_relative_eq!(sight.by(&normal)[k], normal.dot(&moved) * 1e6, epsilon = 1e-5);
            let by_step = { sight }.correct(&step, &mut { patch });
            assert_relative_eq!(by_step, moved, epsilon = 1e-11);
        }
    }

    #[test]
    fn told_anew_the_lidar_stays_where_it_was() {
        let stamp = |k: i64| Stamp::from_nanos(k * 500_000_000);
        let mut survey = Survey::default();
        let (early, late) = (correction(-0.5), correction(1.0));
        survey.extend(Stamp::from_nanos(0), std::iter::empty(), early, 0.75);
        survey.extend(Stamp::from_nanos(0), std::iter::empty(), late, 2.0);
        let poses = (0..5).map(|k| {
            let along = Pose::from_parts(Vector::new(k as f64, 0.5, 1.0).into(), Rotation::identity());
            (stamp(k), along * map_from_head())
        });
        let open = Trajectory::from_poses(poses).unwrap();
        let calibration = calibration();
        let anew = remounted(&open, &survey, (&calibration, &late));
        for ((at, before), after) in open.iter().zip(anew.poses()) {
            let known_then = if at <= stamp(0) + Span::from_seconds(0.75) { early } else { late };
            let was = before * calibration.head_from_corrected_laser(&known_then);
            let is = after * calibration.head_from_corrected_laser(&late);
            assert_relative_eq!(was.translation.vector, is.translation.vector, epsilon = 1e-12);
            assert!(was.rotation.angle_to(&is.rotation) < 1e-12);
        }
    }
}
