//! The base's trajectory from an IMU of its own.
//!
//! Where the base is, the head's trajectory tells by the law of the spring between the two ([`BaseFix`]): well over
//! seconds, badly from one pose to the next, since the law asks for the head's acceleration. An IMU on the base tells
//! how it turns and accelerates from one pose to the next, and drifts over seconds. Both together are smoothed here:
//!
//! 1. How far the IMU's clock is ahead of the fixes' is sought where the IMU turns most as the fixes do (`offset`).
//! 2. An error-state Kalman filter goes forwards (`filter`): attitude, position and velocity of the IMU by strapdown
//!    integration, its biases, offset and rate of its clock, the direction of gravity. Every 50 ms it is corrected by
//!    the mean of what the fixes say of that time.
//! 3. A Rauch-Tung-Striebel smoother goes backwards (`smoother`; Rauch, Tung and Striebel 1965), and between its epochs
//!    the IMU is integrated anew.
//!
//! In memory are the samples and the fixes, about 100 MB an hour, and the matrices of a minute: the filter is repeated
//! minute by minute from states that are kept. Where the IMU is silent the fixes alone lead, as loosely as they are
//! believed.

mod filter;
mod fixes;
mod offset;
mod smoother;

use super::inertial::{InertialStream, Screen, Screened};
use super::stamps::StampFilter;
use super::strapdown::Interval;
use super::{EstimationError, EstimatorSpec};
use crate::geometry::{Pose, Trajectory, Vector};
use crate::measurement::{ImuNoise, ImuSample};
use crate::signal::Regularity;
use crate::time::{Span, Stamp};
use fixes::Fixes;

/// Time between two corrections of the filter, s.
const EPOCH_S: f64 = 0.05;
/// Least time that the fixes and the IMU have in common, s.
const LEAST_COMMON_S: f64 = 5.0;

/// A pose of the base that is known without its IMU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseFix {
    /// When, on the clock of the head's trajectory.
    pub stamp: Stamp,
    /// The pose; the world's z axis points up, to half a degree.
    pub world_from_base: Pose,
    /// How well it is known.
    pub sigmas: FixSigmas,
}

/// How well fixes are known: the standard deviation, on each axis, of their mean over 50 ms. Their errors last longer
/// than that, so it is greater than what their scatter alone would make.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixSigmas {
    /// Of the position, m.
    pub position_m: f64,
    /// Of the attitude, rad.
    pub rotation_rad: f64,
}

impl FixSigmas {
    /// Of a base found by the spring's law from an estimated head. Measured on seeds 701 and 702, office and courtyard,
    /// by hand and on the vehicle, after the map was levelled: on each axis the position errs by 0.1 to 0.2 mm between
    /// 0.3 and 1 Hz and by 0.5 mm below, the attitude by 0.01 degrees in either band and by 0.05 above 6 Hz. With these
    /// sigmas the gyroscope leads above some 0.4 Hz.
    pub const SPRING: Self = Self { position_m: 1e-3, rotation_rad: 1e-3 };
    /// Of a base taken to be where it would be with the head at rest on it: that errs by 20 degrees and 20 mm, by hand,
    /// for as long as the head swings to one side.
    pub const RIGID_LINK: Self = Self { position_m: 0.05, rotation_rad: 0.4 };
}

/// The base's trajectory, and what was learnt of its IMU.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseEstimate {
    /// `world_from_base` at the stamps of those fixes that the IMU covers.
    pub trajectory: Trajectory,
    /// Against gravity, a unit vector: where the IMU says the world's z axis should be, given the fixes' attitudes.
    pub up_in_world: Vector,
    /// How much later the IMU stamps an instant than the fixes do, at the end, s.
    pub clock_offset_s: f64,
    /// Its standard deviation, s: great where the base moved too little to tell, and then of no consequence.
    pub clock_offset_sigma_s: f64,
}

/// What is known of the base's IMU.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseImu {
    /// Its pose in the base.
    pub base_from_imu: Pose,
    /// Its noise.
    pub noise: ImuNoise,
    /// How much later it stamps an instant than the fixes do, to a millisecond or two, s; sought within a second where
    /// `None`.
    pub clock_offset_s: Option<f64>,
}

/// Smooths the trajectory of a base from `samples` of an IMU on it and from `fixes` of its pose, both in the order of
/// their time. Of `spec` the inertial settings and what is believed of clocks are used.
///
/// # Errors
/// When samples or fixes are not finite or not in order, have too little time in common, or the IMU does not turn as
/// the fixes do.
pub fn smooth_base(
    fixes: &[BaseFix],
    samples: &[ImuSample],
    imu: &BaseImu,
    spec: &EstimatorSpec,
) -> Result<BaseEstimate, EstimationError> {
    let origin = check(fixes, samples)?;
    let (start_s, intervals) = intervals(samples, origin, &imu.noise, spec)?;
    let fixes = Fixes::new(fixes, origin, &imu.base_from_imu)?;
    let offset_s = imu.clock_offset_s.map_or_else(|| offset::find(&fixes, start_s, &intervals), Ok)?;
    smoother::smooth(&fixes, start_s, &intervals, offset_s, imu, spec)
}

/// Checks the input, and tells the stamp from which seconds count.
fn check(fixes: &[BaseFix], samples: &[ImuSample]) -> Result<Stamp, EstimationError> {
    for sample in samples {
        let numbers = sample.angular_velocity_rad_per_s.iter().chain(sample.specific_force_m_per_s2.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(EstimationError::NotFinite { sensor: "base's IMU", stamp_ns: sample.stamp.nanos() });
        }
    }
    if let Some(pair) = samples.windows(2).find(|pair| pair[1].stamp < pair[0].stamp) {
        let (before, after) = (pair[0].stamp.nanos(), pair[1].stamp.nanos());
        return Err(EstimationError::Base(format!("its IMU's sample stamped {after} ns follows one of {before} ns")));
    }
    let ends = samples.first().zip(samples.last()).zip(fixes.first().zip(fixes.last()));
    let common_s = ends.map_or(0.0, |((first, last), (from, to))| {
        last.stamp.min(to.stamp).seconds_since(first.stamp.max(from.stamp)).max(0.0)
    });
    let Some(first) = samples.first().filter(|_| common_s >= LEAST_COMMON_S) else {
        return Err(EstimationError::Base(format!(
            "its IMU and the head's trajectory have {common_s:.3} s in common; at least {LEAST_COMMON_S} s are needed"
        )));
    };
    Ok(first.stamp)
}

/// The intervals of the IMU without holes, from the first one's start, s after `origin`.
fn intervals(
    samples: &[ImuSample],
    origin: Stamp,
    noise: &ImuNoise,
    spec: &EstimatorSpec,
) -> Result<(f64, Vec<Interval>), EstimationError> {
    let seconds: Vec<f64> = samples.iter().map(|sample| sample.stamp.seconds_since(origin)).collect();
    let learning = seconds.partition_point(|s| *s <= LEAST_COMMON_S);
    let regularity = Regularity::of(&seconds[..learning]).ok_or_else(|| {
        EstimationError::Base(format!("its IMU has {learning} samples in its first {LEAST_COMMON_S} s"))
    })?;
    let filter = StampFilter::new(regularity, spec.clock.jitter_s);
    let mut stream = InertialStream::new(filter, *noise, spec.inertial.clone());
    let stamped: Vec<(f64, ImuSample)> = seconds.into_iter().zip(samples.iter().copied()).collect();
    let mut screen = Screen::new(noise);
    let mut placed = Vec::new();
    for (k, (raw_s, sample)) in stamped.iter().enumerate() {
        match screen.screen((*raw_s, sample), stamped[k + 1..].iter()) {
            Screened::Measured(clipped) => stream.push(*raw_s, (sample, clipped), &mut placed),
            Screened::Outlier => stream.note_discarded_outlier(),
            Screened::Frozen => {}
        }
    }
    stream.flush(&mut placed);
    let start_s = placed.first().map_or(0.0, |(start_s, _)| *start_s);
    Ok((start_s, placed.into_iter().map(|(_, interval)| interval).collect()))
}

/// The stamp `seconds` after `origin`.
fn stamp(origin: Stamp, seconds: f64) -> Stamp {
    origin + Span::from_seconds(seconds)
}
