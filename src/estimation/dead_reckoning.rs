//! Strapdown integration of IMU samples without other sensors.

use super::strapdown::{Biases, State};
use super::{EstimationError, EstimatorSpec, base};
use zsim_base::geometry::{Kinematics, Pose, Trajectory, Vector, gravity_in_world};
use zsim_base::measurement::{ImuAveraging, ImuNoise, ImuSample};
use zsim_base::time::Span;

/// Integrates IMU samples as the estimator does, with zero biases.
///
/// `start` is the motion of the IMU frame at the start. Returns `world_from_imu` at the boundaries of the integration
/// intervals, about 10 ms apart, in IMU time. `start` applies at the first boundary: half a sample period before the
/// first stamp. At least five seconds of samples are needed.
///
/// # Errors
/// When there are too few samples, or the integrated poses are not finite.
pub fn integrate_imu(
    samples: &[ImuSample],
    noise: &ImuNoise,
    averaging: ImuAveraging,
    start: &Kinematics,
    spec: &EstimatorSpec,
) -> Result<Trajectory, EstimationError> {
    let origin = samples.first().map(|sample| sample.stamp).unwrap_or_default();
    let (start_s, intervals) = base::intervals(samples, origin, noise, averaging, spec)?;
    let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
    let pose = start.world_from_body;
    let mut state =
        State { rotation: pose.rotation, position: pose.translation.vector, velocity: start.velocity_in_world };
    let mut time_s = start_s;
    let mut poses = vec![(origin + Span::from_seconds(time_s), pose)];
    for interval in &intervals {
        state = state.after(interval, &biases, &gravity_in_world());
        time_s += interval.h;
        let pose = Pose::from_parts(state.position.into(), state.rotation);
        poses.push((origin + Span::from_seconds(time_s), pose));
    }
    Ok(Trajectory::from_poses(poses)?)
}
