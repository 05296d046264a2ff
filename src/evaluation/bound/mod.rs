//! The Cramer-Rao bound of a recording in a known scene: the accuracy that no estimator can exceed.
//!
//! The covariance of the errors of any unbiased estimator is at least the inverse of the Fisher information of the
//! measurements. Here these are all beams, of known noise, on surfaces that are known exactly, and an inertial
//! measurement unit of known noise whose biases walk. An estimator without the map has less information, so the bound
//! applies to it too, but is optimistic.
//!
//! # The model
//!
//! Errors of the estimate, all to first order about the truth: attitude `dtheta` (`R' = exp(dtheta) R`), velocity and
//! position of the IMU in the world, the biases of gyroscope and accelerometer, and the constants of the run:
//! clock offset `l` and its rate, an offset of all ranges, and the scale and misalignment of both triads. They move as
//!
//! ```text
//! dtheta' = -R (db_g + dM_g w + n_g)      dv' = -[R f]x dtheta - R (db_a + dM_a f + n_a)      dp' = dv      db' = n_b
//! ```
//!
//! A beam from the head that meets a plane of normal `n` at `rho` from the IMU, along `u`, has the range `dr = -n (dp +
//! dtheta x rho) / (n u)`. Its time is converted to the IMU's clock: an error of `l` moves the pose by its velocity.
//! The trajectory is in lidar time, so its error includes `l` too.
//!
//! # Omitted effects, all of which would raise the bound
//!
//! Rounding of ranges, jitter and rounding of stamps, missed echoes and their biases at grazing incidence, beams that
//! hit moving objects, and samples at their limit: assumed known. The IMU samples are averages over adjacent intervals.
//! Gravity is known.

mod epoch;
mod motion;
mod smoother;
mod state;

use epoch::Epoch;
pub use epoch::Sight;

use super::EvaluationError;
use crate::geometry::{Pose, Vector};
use crate::measurement::{ImuNoise, ImuSample};
use crate::time::{Span, Stamp};

/// Time between the epochs at which errors are reported.
const EPOCH: Span = Span::from_nanos(20_000_000);

/// Prior standard deviations of the sensors' errors.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundModel {
    /// Where the IMU is in the head.
    pub head_from_imu: Pose,
    /// The IMU's noise.
    pub imu: ImuNoise,
    /// The gyroscope's scale (the diagonal) and misalignment (the rest of the matrix), 1 and rad.
    pub gyro_matrix: (f64, f64),
    /// The same of the accelerometer.
    pub accel_matrix: (f64, f64),
    /// The offset common to all ranges of the run, m.
    pub range_offset_m: f64,
    /// The offset between the clocks, s.
    pub clock_offset_s: f64,
    /// Rate of the clock offset, s/s.
    pub clock_rate: f64,
}

/// The information in a recording, accumulated while it is read.
///
/// Stores some hundred bytes for each 20 ms: the information of the beams and the motion of the head.
#[derive(Debug, Clone)]
pub struct Information {
    model: BoundModel,
    start: Stamp,
    epochs: Vec<Epoch>,
}

/// The least errors, root mean square or standard deviation, that any unbiased estimator can have.
#[derive(Debug, Clone, PartialEq)]
pub struct InformationBound {
    /// When, lidar time.
    pub stamps: Vec<Stamp>,
    /// Of the head's position along each axis of the world, m.
    pub position_sigma_m: Vec<Vector>,
    /// Of the head's attitude about each axis of the world, rad.
    pub attitude_sigma_rad: Vec<Vector>,
    /// Of the position over the run, in the world, m.
    pub position_rmse_m: f64,
    /// The same along each axis of the world, m.
    pub axis_rmse_m: Vector,
    /// RMSE of the position after the rigid alignment that the evaluation uses, m: comparable with the RMSE of an
    /// estimate.
    pub aligned_position_rmse_m: f64,
    /// Of the attitude over the run, in the world, rad.
    pub attitude_rmse_rad: f64,
    /// Of the clock offset at the end, s.
    pub clock_offset_s: f64,
    /// Of the offset of all ranges, m.
    pub range_offset_m: f64,
}

impl Information {
    /// No measurements yet; the true trajectory is `heads`: `world_from_head` in lidar time, in order, at
    /// least 50 a second.
    pub fn new<E>(model: BoundModel, heads: impl Iterator<Item = Result<(Stamp, Pose), E>>) -> Result<Self, E> {
        let mut epochs: Vec<Epoch> = Vec::new();
        let (mut start, mut before): (Option<Stamp>, Option<(Stamp, Pose)>) = (None, None);
        for head in heads {
            let (stamp, world_from_head) = head?;
            let world_from_imu = world_from_head * model.head_from_imu;
            let start = *start.get_or_insert(stamp);
            let due = start + Span::from_nanos(epochs.len() as i64 * EPOCH.nanos());
            if stamp >= due {
                let past = before.unwrap_or((stamp - EPOCH, world_from_imu));
                epochs.push(Epoch::new(&world_from_imu, &past.1, stamp.seconds_since(past.0)));
            }
            before = Some((stamp, world_from_imu));
        }
        Ok(Self { model, start: start.unwrap_or_default(), epochs })
    }

    /// Adds a sample of the IMU with the stamp `stamp` of the lidar's clock.
    pub fn hear(&mut self, stamp: Stamp, sample: &ImuSample) {
        if let Some(epoch) = self.epoch_at(stamp) {
            epoch.hear(sample);
        }
    }

    /// Sees a beam that met a surface.
    pub fn see(&mut self, sight: &Sight) {
        let head_from_imu = self.model.head_from_imu;
        if let Some(epoch) = self.epoch_at(sight.stamp) {
            epoch.see(sight, &head_from_imu);
        }
    }

    /// The epoch at a time.
    fn epoch_at(&mut self, stamp: Stamp) -> Option<&mut Epoch> {
        let index = (stamp.seconds_since(self.start) / EPOCH.seconds()).round();
        (index >= 0.0).then(|| self.epochs.get_mut(index as usize)).flatten()
    }

    /// The bound.
    ///
    /// # Errors
    /// When the truth is shorter than a tenth of a second.
    pub fn bound(self) -> Result<InformationBound, EvaluationError> {
        let found_s = self.epochs.len() as f64 * EPOCH.seconds();
        if found_s < 0.1 {
            return Err(EvaluationError::TooShort { measure: "the information bound", needed_s: 0.1, found_s });
        }
        Ok(smoother::bound(&self.model, self.start, &self.epochs))
    }
}
