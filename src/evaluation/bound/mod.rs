//! The Cramer-Rao bound of a recording: the accuracy that no estimator can exceed.
//!
//! The covariance of the errors of any unbiased estimator is at least the inverse of the Fisher information of the
//! measurements. Here these are all beams, of known noise, and an inertial measurement unit of known noise with random-walk
//! biases. The surfaces are known exactly (the bound of localisation), or planes of unknown offset and slopes (the bound
//! of SLAM, `unknown_map`). The bound of localisation applies to SLAM too, but is optimistic.
//!
//! # The model
//!
//! Errors of the estimate, all to first order about the truth: attitude `dtheta` (`R' = exp(dtheta) R`), velocity and
//! position of the IMU in the world, the biases of gyroscope and accelerometer, and the constants of the run:
//! clock offset `l` and its rate, an offset of all ranges, and the scale and misalignment of both triads. The model is
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
//! Rounding of ranges, jitter and rounding of stamps, missed returns and range biases at grazing incidence, beams on
//! moving objects, and saturated samples: assumed known. The IMU samples are averages over adjacent intervals.
//! Gravity is known.

mod epoch;
mod model;
mod motion;
mod smoother;
mod state;
mod unknown_map;

pub use epoch::BeamObservation;
pub use model::{BoundModel, InformationBound, MapKnowledge, UnknownMap};

use super::EvaluationError;
use epoch::Epoch;
use model::EPOCH;
use unknown_map::{MapPrior, Sightings};
use zsim_base::geometry::Pose;
use zsim_base::measurement::ImuSample;
use zsim_base::time::{Span, Stamp};

/// Fisher information of a recording, accumulated while it is read.
///
/// Stores some hundred bytes for each 20 ms: the information of the beams and the motion of the head. With an unknown map,
/// also some hundred bytes for each plane that the beams of 20 ms hit.
#[derive(Debug, Clone)]
pub struct FisherInformation {
    model: BoundModel,
    start: Option<Stamp>,
    /// Last true pose of the IMU.
    before: Option<(Stamp, Pose)>,
    epochs: Vec<Epoch>,
    /// Beams by plane, if the map is unknown.
    sightings: Option<Sightings>,
}

impl FisherInformation {
    /// Creates an accumulator without motion and measurements.
    pub fn new(model: BoundModel, map: MapKnowledge) -> Self {
        let sightings = (map == MapKnowledge::Unknown).then(Sightings::default);
        Self { model, start: None, before: None, epochs: Vec::new(), sightings }
    }

    /// Adds the next true pose of the head, in lidar time, at 50 Hz or more.
    ///
    /// Measurements of a time follow its poses.
    pub fn add_head(&mut self, stamp: Stamp, world_from_head: &Pose) {
        let world_from_imu = world_from_head * self.model.head_from_imu;
        let start = *self.start.get_or_insert(stamp);
        let due = start + Span::from_nanos(self.epochs.len() as i64 * EPOCH.nanos());
        if stamp >= due {
            let previous = self.before.unwrap_or((stamp - EPOCH, world_from_imu));
            self.epochs.push(Epoch::new(&world_from_imu, &previous.1, stamp.seconds_since(previous.0)));
        }
        self.before = Some((stamp, world_from_imu));
    }

    /// Adds an IMU sample; `stamp` is on the lidar clock.
    pub fn add_imu_sample(&mut self, stamp: Stamp, sample: &ImuSample) {
        if let Some(epoch) = self.index_at(stamp).and_then(|index| self.epochs.get_mut(index)) {
            epoch.add_imu_sample(sample);
        }
    }

    /// Adds the observation of a surface by a beam.
    pub fn add_beam(&mut self, beam: &BeamObservation) {
        let Some(index) = self.index_at(beam.stamp) else { return };
        let Some(epoch) = self.epochs.get_mut(index) else { return };
        let by_clock = epoch.add_beam(beam, &self.model.head_from_imu);
        if let (Some(sightings), Some(by_clock)) = (&mut self.sightings, by_clock) {
            sightings.add(index, beam, by_clock);
        }
    }

    /// Index of the epoch at a time.
    fn index_at(&self, stamp: Stamp) -> Option<usize> {
        let index = (stamp.seconds_since(self.start?) / EPOCH.seconds()).round();
        (index >= 0.0).then_some(index as usize)
    }

    /// Computes the bound.
    ///
    /// # Errors
    /// When the truth is shorter than 0.1 s; with an unknown map, also when it is longer than 300 s.
    pub fn bound(self) -> Result<InformationBound, EvaluationError> {
        let found_s = self.epochs.len() as f64 * EPOCH.seconds();
        if found_s < 0.1 {
            return Err(EvaluationError::TooShort { measure: "the information bound", needed_s: 0.1, found_s });
        }
        let start = self.start.unwrap_or_default();
        match &self.sightings {
            None => Ok(smoother::bound(&self.model, start, &self.epochs)),
            Some(sightings) => unknown_map::bound(&self.model, start, &self.epochs, sightings, MapPrior::UNKNOWN),
        }
    }
}
