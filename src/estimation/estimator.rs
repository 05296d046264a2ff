use super::{EstimatedPose, EstimationError, EstimatorSpec, OpenLoop};
use crate::geometry::Trajectory;
use crate::measurement::{Calibration, Measurement};

/// The open-loop estimator: measurements in, poses out, memory bounded by the window and the fixed views.
///
/// Latency: a pose is final, and handed out by [`Estimator::take_poses`], when the window has passed it:
/// `window_s + step_s` after its instant at most.
#[derive(Debug)]
pub struct Estimator {
    _spec: EstimatorSpec,
    poses: Vec<EstimatedPose>,
    output: OpenLoop,
}

impl Estimator {
    /// An estimator that has seen nothing yet.
    ///
    /// # Errors
    /// When a setting or the calibration makes no sense.
    pub fn new(spec: &EstimatorSpec, _calibration: &Calibration) -> Result<Self, EstimationError> {
        spec.check()?;
        Ok(Self { _spec: spec.clone(), poses: Vec::new(), output: OpenLoop::default() })
    }

    /// Takes a measurement, in about the order of time, and solves a window when one is full.
    ///
    /// # Errors
    /// When the measurement is not finite.
    pub fn push(&mut self, _measurement: Measurement) -> Result<(), EstimationError> {
        Ok(())
    }

    /// The poses that became final since the last call, in order of time.
    pub fn take_poses(&mut self) -> Vec<EstimatedPose> {
        std::mem::take(&mut self.poses)
    }

    /// Solves what is left; the result holds the poses not taken yet, and the reports of all windows.
    ///
    /// # Errors
    /// When there was no IMU, no lidar, or too little of both to start.
    pub fn finish(mut self) -> Result<OpenLoop, EstimationError> {
        self.output.poses = self.poses;
        Ok(self.output)
    }
}

/// Estimates a whole recording.
///
/// # Errors
/// As [`Estimator::new`], [`Estimator::push`] and [`Estimator::finish`].
pub fn estimate_all(
    spec: &EstimatorSpec,
    calibration: &Calibration,
    measurements: impl Iterator<Item = Measurement>,
) -> Result<OpenLoop, EstimationError> {
    let mut estimator = Estimator::new(spec, calibration)?;
    for measurement in measurements {
        estimator.push(measurement)?;
    }
    let mut result = estimator.finish()?;
    let stamped = result.poses.iter().map(|pose| (pose.stamp, pose.map_from_head));
    result.trajectory = Trajectory::from_poses(stamped).unwrap_or_default();
    Ok(result)
}
