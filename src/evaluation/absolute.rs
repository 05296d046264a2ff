use super::Pairs;
use zsim_base::geometry::{Pose, Vector};
use zsim_base::time::Stamp;

/// The errors of an estimate over time, in the world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Errors {
    /// Stamps, lidar time.
    pub stamps: Vec<Stamp>,
    /// Estimated minus true position, m.
    pub position_m: Vec<Vector>,
    /// Rotation vector that takes the true attitude to the estimated one, `log(R_est R_true^T)`, rad; empty without true
    /// attitudes.
    pub rotation_rad: Vec<Vector>,
}

impl Errors {
    /// Errors of the estimate after the alignment `world_from_map`.
    pub fn after(pairs: &Pairs, world_from_map: &Pose) -> Self {
        let (position_m, rotation_rad) = (Vec::with_capacity(pairs.len()), Vec::with_capacity(pairs.len()));
        let mut errors = Self { stamps: pairs.stamps().to_vec(), position_m, rotation_rad };
        for (map_from_head, world_from_head) in pairs.estimate().iter().zip(pairs.truth()) {
            let estimated = world_from_map * map_from_head;
            errors.position_m.push(estimated.translation.vector - world_from_head.translation.vector);
            if !pairs.have_positions_only() {
                errors.rotation_rad.push((estimated.rotation * world_from_head.rotation.inverse()).scaled_axis());
            }
        }
        errors
    }

    /// Decimates the errors: every `stride`-th pair.
    #[must_use]
    pub fn decimated(&self, stride: usize) -> Self {
        let thin = |vectors: &[Vector]| vectors.iter().step_by(stride).copied().collect();
        Self {
            stamps: self.stamps.iter().step_by(stride).copied().collect(),
            position_m: thin(&self.position_m),
            rotation_rad: thin(&self.rotation_rad),
        }
    }

    /// Returns the root mean square position error, m: the `rmse` of `evo_ape -a`.
    pub fn position_rmse_m(&self) -> f64 {
        root_mean_square(&self.position_m)
    }

    /// Returns the root mean square angle between estimated and true attitude, rad.
    ///
    /// It is the `rmse` of `evo_ape -a -r angle_rad`.
    pub fn rotation_rmse_rad(&self) -> f64 {
        root_mean_square(&self.rotation_rad)
    }

    /// Returns the distance between estimated and true position at the end, m.
    pub fn end_position_m(&self) -> Option<f64> {
        self.position_m.last().map(Vector::norm)
    }

    /// Returns the mean distance between estimated and true position, m.
    pub fn mean_position_m(&self) -> f64 {
        self.position_m.iter().map(Vector::norm).sum::<f64>() / self.position_m.len() as f64
    }

    /// Returns the mean rotation error about the world's vertical, rad.
    pub fn mean_yaw_rad(&self) -> f64 {
        self.rotation_rad.iter().map(|rotation| rotation.z).sum::<f64>() / self.rotation_rad.len() as f64
    }
}

fn root_mean_square(vectors: &[Vector]) -> f64 {
    (vectors.iter().map(Vector::norm_squared).sum::<f64>() / vectors.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Trajectory, from_roll_pitch_yaw};

    /// A walk round a tilted square with the head nodding, 1000 poses at 100 Hz.
    fn walk() -> Trajectory {
        let pose = |k: i64| {
            let t = k as f64 * 0.01;
            let at = Vector::new(3.0 * t.cos(), 2.0 * (1.3 * t).sin(), 0.2 * (2.0 * t).sin());
            (Stamp::from_nanos(k * 10_000_000), Pose::from_parts(at.into(), from_roll_pitch_yaw(0.0, t.sin(), t)))
        };
        Trajectory::from_poses((0..1000).map(pose)).unwrap()
    }

    #[test]
    fn a_rigidly_moved_trajectory_has_no_error() {
        let moved = walk()
            .transformed(&Pose::from_parts(Vector::new(5.0, 1.0, -2.0).into(), from_roll_pitch_yaw(0.1, 0.2, 2.0)));
        let pairs = Pairs::associate(&moved, &walk()).unwrap();
        let errors = Errors::after(&pairs, &pairs.world_from_map().unwrap());
        assert!(errors.position_rmse_m() < 1e-12 && errors.rotation_rmse_rad() < 1e-12);
    }

    #[test]
    fn an_alternating_error_has_an_rmse_of_its_amplitude() {
        // +-3 cm along x, alternating from pose to pose, cannot be aligned: RMSE is 3 cm. A constant rotation of the
        // head in the head frame by 2 degrees does not move the positions: rotation RMSE is 2 degrees.
        let turn = Pose::from_parts(Vector::zeros().into(), from_roll_pitch_yaw(0.0, 0.0, 2_f64.to_radians()));
        let walked = walk();
        let shaken = walked.iter().enumerate().map(|(k, (stamp, pose))| {
            let side = if k % 2 == 0 { 0.03 } else { -0.03 };
            (stamp, Pose::translation(side, 0.0, 0.0) * pose * turn)
        });
        let pairs = Pairs::associate(&Trajectory::from_poses(shaken).unwrap(), &walk()).unwrap();
        let errors = Errors::after(&pairs, &pairs.world_from_map().unwrap());
        assert_relative_eq!(errors.position_rmse_m(), 0.03, epsilon = 1e-5);
        assert_relative_eq!(errors.rotation_rmse_rad().to_degrees(), 2.0, epsilon = 1e-3);
        assert_relative_eq!(errors.end_position_m().unwrap(), 0.03, epsilon = 1e-4);
    }
}
