//! Trajectory of the base from pose fixes and a second IMU on the base.
//!
//! The head's trajectory and the spring model give pose fixes of the base ([`BaseFix`]). They are accurate over seconds, but
//! noisy from pose to pose, because the model needs the head's acceleration. An IMU on the base is accurate from pose to pose
//! and drifts over seconds. This module fuses both:
//!
//! 1. The clock offset between IMU and fixes is the one at which the gyroscope best explains the rotation of the fixes
//!    (`clock_offset`).
//! 2. A forward error-state Kalman filter (`filter`) estimates attitude, position and velocity of the IMU by strapdown
//!    integration, both biases, clock offset and clock rate, and the direction of gravity. Every 50 ms it is updated with the
//!    mean innovation of the fixes of that epoch.
//! 3. A backward smoother (`smoother`; Rauch, Tung and Striebel 1965) corrects the estimates; within an epoch the IMU is
//!    integrated again.
//!
//! Memory holds the samples and fixes, about 100 MB per hour, and the matrices of one minute: the backward pass repeats the
//! filter minute by minute from checkpoints. During IMU gaps only the fixes constrain the pose, with their own uncertainty.

mod clock_offset;
mod filter;
mod fixes;
mod imu;
mod smoother;

pub use fixes::{BaseFix, FixSigmas};
pub use imu::BaseImu;
pub use smoother::BaseEstimate;

use super::inertial::{InertialStream, Screen, Screened};
use super::stamps::StampFilter;
use super::strapdown::Interval;
use super::{EstimationError, EstimatorSpec};
use fixes::Fixes;
use zsim_base::measurement::{ImuAveraging, ImuNoise, ImuSample};
use zsim_base::signal::Regularity;
use zsim_base::time::Stamp;

/// Minimum overlap in time of fixes and IMU samples, s: needed to find the sample rate and the clock offset.
const MIN_OVERLAP_S: f64 = 5.0;

/// Smooths the trajectory of the base from IMU samples and pose fixes.
///
/// `samples` and `fixes` are in order of time. Uses the inertial and clock settings of `spec`.
///
/// # Errors
/// When samples or fixes are not finite or not in order, overlap too little in time, or the gyroscope does not match the
/// rotation of the fixes.
pub fn smooth_base(
    fixes: &[BaseFix],
    samples: &[ImuSample],
    imu: &BaseImu,
    spec: &EstimatorSpec,
) -> Result<BaseEstimate, EstimationError> {
    let origin = check(fixes, samples)?;
    let (start_s, intervals) = intervals(samples, origin, &imu.noise, imu.averaging, spec)?;
    let fixes = Fixes::new(fixes, origin, &imu.base_from_imu)?;
    let offset_s = imu.clock_offset_s.map_or_else(|| clock_offset::find(&fixes, start_s, &intervals), Ok)?;
    smoother::smooth(&fixes, start_s, &intervals, offset_s, imu, spec)
}

/// Checks the input; returns the origin of time in seconds, the first IMU stamp.
fn check(fixes: &[BaseFix], samples: &[ImuSample]) -> Result<Stamp, EstimationError> {
    for sample in samples {
        let numbers = sample.angular_velocity_rad_per_s.iter().chain(sample.specific_force_m_per_s2.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(EstimationError::NotFinite { sensor: "base's IMU", stamp_ns: sample.stamp.nanos() });
        }
    }
    if let Some(pair) = samples.windows(2).find(|pair| pair[1].stamp < pair[0].stamp) {
        let (before, after) = (pair[0].stamp.nanos(), pair[1].stamp.nanos());
        return Err(EstimationError::Base(format!(
            "the IMU sample stamped {after} ns follows one of {before} ns; samples must be in time order"
        )));
    }
    let ends = samples.first().zip(samples.last()).zip(fixes.first().zip(fixes.last()));
    let overlap_s = ends.map_or(0.0, |((first, last), (from, to))| {
        last.stamp.min(to.stamp).seconds_since(first.stamp.max(from.stamp)).max(0.0)
    });
    let Some(first) = samples.first().filter(|_| overlap_s >= MIN_OVERLAP_S) else {
        return Err(EstimationError::Base(format!(
            "IMU and head trajectory overlap for {overlap_s:.3} s; at least {MIN_OVERLAP_S} s are needed"
        )));
    };
    Ok(first.stamp)
}

/// Contiguous IMU intervals and the start of the first one, s after `origin`; gaps are bridged.
pub(super) fn intervals(
    samples: &[ImuSample],
    origin: Stamp,
    noise: &ImuNoise,
    averaging: ImuAveraging,
    spec: &EstimatorSpec,
) -> Result<(f64, Vec<Interval>), EstimationError> {
    let seconds: Vec<f64> = samples.iter().map(|sample| sample.stamp.seconds_since(origin)).collect();
    let learning = seconds.partition_point(|s| *s <= MIN_OVERLAP_S);
    let regularity = Regularity::of(&seconds[..learning]).ok_or_else(|| {
        EstimationError::Base(format!(
            "too few IMU samples to find the sample rate: {learning} in the first {MIN_OVERLAP_S} s"
        ))
    })?;
    let filter = StampFilter::new(regularity, spec.clock.jitter_s);
    let mut stream = InertialStream::new(filter, *noise, averaging, spec.inertial.clone());
    let stamped: Vec<(f64, ImuSample)> = seconds.into_iter().zip(samples.iter().copied()).collect();
    let mut screen = Screen::new(noise);
    let mut placed = Vec::new();
    for (k, (raw_s, sample)) in stamped.iter().enumerate() {
        match screen.screen(*raw_s, sample, stamped[k + 1..].iter()) {
            Screened::Measured(clipped) => {
                let later_s = stamped[k + 1..].iter().map(|(later_s, _)| *later_s);
                stream.push(*raw_s, later_s, sample, clipped, &mut placed);
            }
            Screened::Outlier { may_be_shock: true } => stream.note_possible_shock(),
            Screened::Outlier { may_be_shock: false } | Screened::Frozen => {}
        }
    }
    stream.flush(&mut placed);
    let start_s = placed.first().map_or(0.0, |(start_s, _)| *start_s);
    Ok((start_s, placed.into_iter().map(|(_, interval)| interval).collect()))
}
