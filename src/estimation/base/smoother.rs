//! Rauch-Tung-Striebel smoother: forward filter, backward pass, interpolated poses.

use super::filter::{EPOCH_S, ErrorMatrix, Estimate, Filter, Innovation};
use super::fixes::{FixSigmas, Fixes};
use super::imu::BaseImu;
use crate::nominal::{Correction, Nominal};
use crate::strapdown::Interval;
use crate::{EstimationError, EstimatorSpec};
use std::ops::Range;
use zsim_base::geometry::{Pose, Rotation, Trajectory, Vector};
use zsim_base::time::Stamp;

/// Estimated trajectory of the base and parameters of its IMU.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseEstimate {
    /// `world_from_base` at the stamps of the fixes that the IMU covers.
    pub trajectory: Trajectory,
    /// Unit vector opposite to the estimated gravity, in the world frame of the fixes.
    pub up_in_world: Vector,
    /// Clock offset at the end: IMU stamp minus fix stamp of the same event, s.
    pub clock_offset_s: f64,
    /// Standard deviation of the clock offset, s; large, but without effect, if the base hardly moved.
    pub clock_offset_sigma_s: f64,
}

/// Number of epochs whose matrices are in memory at once (60 s).
const EPOCHS_IN_MEMORY: usize = 1200;

/// Times that differ by less than this are equal, s: covers rounding errors.
const TIME_TOLERANCE_S: f64 = 1e-6;

/// An epoch: consecutive IMU intervals and the start of the first one, s on the IMU clock.
#[derive(Debug, Clone)]
struct Epoch {
    start_s: f64,
    intervals: Range<usize>,
}

/// Filter results of one epoch.
struct Step {
    /// Transition matrix of the errors from start to end.
    transition: ErrorMatrix,
    predicted: Estimate,
    predicted_covariance: ErrorMatrix,
    corrected: Estimate,
    corrected_covariance: ErrorMatrix,
}

/// Measurements to be smoothed.
struct Problem<'a> {
    fixes: &'a Fixes,
    intervals: &'a [Interval],
}

/// Smooths the trajectory of the base; the IMU `intervals` start at `start_s`.
pub(super) fn smooth(
    fixes: &Fixes,
    start_s: f64,
    intervals: &[Interval],
    offset_s: f64,
    imu: &BaseImu,
    spec: &EstimatorSpec,
) -> Result<BaseEstimate, EstimationError> {
    let problem = Problem { fixes, intervals };
    let epochs = problem.epochs(start_s, offset_s);
    let start = epochs.first().and_then(|epoch| problem.start(epoch.start_s - offset_s));
    let Some(((pose, sigmas), velocity)) = start else {
        return Err(EstimationError::Base("no fixes within the time of the IMU samples".to_owned()));
    };
    let mut filter = Filter::starting_at(pose, sigmas, velocity, offset_s, &imu.noise, spec);
    let mut checkpoints = Vec::new();
    for minute in epochs.chunks(EPOCHS_IN_MEMORY) {
        checkpoints.push(filter.clone());
        for epoch in minute {
            problem.step(&mut filter, epoch);
        }
    }
    let poses = problem.backwards(&epochs, checkpoints)?;
    let imu_from_base = imu.base_from_imu.inverse();
    let poses = poses.into_iter().rev().map(|(stamp, world_from_imu)| (stamp, world_from_imu * imu_from_base));
    Ok(BaseEstimate {
        trajectory: Trajectory::from_poses(poses)
            .map_err(|error| EstimationError::Base(format!("invalid estimate: {error}")))?,
        up_in_world: -filter.estimate.gravity().normalize(),
        clock_offset_s: filter.estimate.offset_s,
        clock_offset_sigma_s: filter.offset_sigma_s(),
    })
}

impl Problem<'_> {
    /// Divides the overlap of intervals and fixes into epochs.
    fn epochs(&self, start_s: f64, offset_s: f64) -> Vec<Epoch> {
        let (from_s, to_s) = self.fixes.span_s();
        let mut epochs: Vec<Epoch> = Vec::new();
        let mut at_s = start_s;
        for (index, interval) in self.intervals.iter().enumerate() {
            let tau_s = at_s - offset_s;
            if tau_s >= from_s && tau_s + interval.h <= to_s {
                match epochs.last_mut().filter(|epoch| at_s + 0.5 * interval.h < epoch.start_s + EPOCH_S) {
                    Some(epoch) => epoch.intervals.end = index + 1,
                    None => epochs.push(Epoch { start_s: at_s, intervals: index..index + 1 }),
                }
            }
            at_s += interval.h;
        }
        epochs
    }

    /// The fix at `tau_s` and the velocity from the fix one epoch later, m/s.
    fn start(&self, tau_s: f64) -> Option<((Pose, FixSigmas), Vector)> {
        let (from, to) = (self.fixes.at(tau_s)?, self.fixes.at(tau_s + EPOCH_S)?);
        let step = to.0.translation.vector - from.0.translation.vector;
        Some((from, step / EPOCH_S))
    }

    /// Runs the filter through an epoch.
    fn step(&self, filter: &mut Filter, epoch: &Epoch) -> Step {
        let mut transition = ErrorMatrix::identity();
        let mut innovations = Vec::new();
        let mut u_s = epoch.start_s;
        for interval in &self.intervals[epoch.intervals.clone()] {
            transition = filter.predict(interval) * transition;
            u_s += interval.h;
            innovations.extend(self.innovation(&filter.estimate, interval, u_s));
        }
        let (predicted, predicted_covariance) = (filter.estimate, filter.covariance);
        if let Some(innovation) = mean(&innovations, u_s) {
            filter.correct(&innovation);
        }
        let (corrected, corrected_covariance) = (filter.estimate, filter.covariance);
        Step { transition, predicted, predicted_covariance, corrected, corrected_covariance }
    }

    /// Innovation of the fixes at `u_s`, the end of `interval`, and that time, s.
    fn innovation(&self, estimate: &Estimate, interval: &Interval, u_s: f64) -> Option<(f64, Innovation)> {
        let (pose, sigmas) = self.fixes.at(u_s - estimate.offset_s)?;
        let state = &estimate.state;
        let innovation = Innovation {
            rotation: (pose.rotation * state.rotation.inverse()).scaled_axis(),
            translation: pose.translation.vector - state.position,
            angular_velocity: state.rotation * (interval.gyro - estimate.biases.gyro),
            ago_s: 0.0,
            sigmas,
        };
        Some((u_s, innovation))
    }

    /// Backward pass: smoothed poses at the stamps of the fixes, in reverse order.
    ///
    /// `checkpoints` holds the filter at the start of each minute.
    fn backwards(&self, epochs: &[Epoch], checkpoints: Vec<Filter>) -> Result<Vec<(Stamp, Pose)>, EstimationError> {
        let mut poses = Vec::new();
        let mut pending = self.fixes.world_from_imu.stamps();
        let mut smoothed: Option<Estimate> = None;
        for (minute, start) in epochs.chunks(EPOCHS_IN_MEMORY).zip(checkpoints).rev() {
            let mut filter = start.clone();
            let steps: Vec<Step> = minute.iter().map(|epoch| self.step(&mut filter, epoch)).collect();
            for (k, epoch) in minute.iter().enumerate().rev() {
                let end = smoothed.unwrap_or(steps[k].corrected);
                let before = k.checked_sub(1).map(|k| &steps[k]);
                let (filtered, covariance) = before.map_or((&start.estimate, &start.covariance), Step::end);
                let start_estimate = steps[k].smoothed_start(filtered, covariance, &end)?;
                pending = self.add_poses(epoch, [&start_estimate, &end], pending, &mut poses);
                smoothed = Some(start_estimate);
            }
        }
        Ok(poses)
    }

    /// Adds the poses of one epoch, between two smoothed estimates, for the last of the `pending` stamps.
    ///
    /// Returns the stamps that are still pending.
    fn add_poses<'s>(
        &self,
        epoch: &Epoch,
        [start_estimate, end]: [&Estimate; 2],
        mut pending: &'s [Stamp],
        poses: &mut Vec<(Stamp, Pose)>,
    ) -> &'s [Stamp] {
        let between = between(epoch.start_s, &self.intervals[epoch.intervals.clone()], [start_estimate, end]);
        let span_s = between.end_s() - epoch.start_s;
        while let Some((stamp, earlier)) = pending.split_last() {
            let near_s = stamp.seconds_since(self.fixes.origin) + start_estimate.offset_s;
            let u_s =
                near_s + (end.offset_s - start_estimate.offset_s) * ((near_s - epoch.start_s) / span_s).clamp(0.0, 1.0);
            if u_s < epoch.start_s {
                break;
            }
            pending = earlier;
            if u_s <= between.end_s() + TIME_TOLERANCE_S {
                let motion = between.at(u_s, &start_estimate.biases.gyro);
                let rotation = Rotation::from_matrix(&motion.rotation);
                poses.push((*stamp, Pose::from_parts(motion.position.into(), rotation)));
            }
        }
        pending
    }
}

impl Step {
    /// Filtered estimate and covariance at the end of the epoch.
    fn end(&self) -> (&Estimate, &ErrorMatrix) {
        (&self.corrected, &self.corrected_covariance)
    }

    /// Smoothed estimate at the start of the epoch, from the `filtered` one there, with its `covariance`, and the smoothed
    /// one at the `end`.
    fn smoothed_start(
        &self,
        filtered: &Estimate,
        covariance: &ErrorMatrix,
        end: &Estimate,
    ) -> Result<Estimate, EstimationError> {
        let cholesky = self.predicted_covariance.cholesky().ok_or_else(|| {
            EstimationError::Base("the covariance became singular; check the noise parameters of the IMU".to_owned())
        })?;
        // P F' (F P F' + Q)^-1, transposed.
        let gain = cholesky.solve(&(self.transition * covariance)).transpose();
        Ok(filtered.plus(&(gain * end.minus(&self.predicted))))
    }
}

/// Trajectory within an epoch: integrated from the start, corrected linearly in time to meet the estimate at the end.
fn between(start_s: f64, intervals: &[Interval], [start_estimate, end]: [&Estimate; 2]) -> Nominal {
    let mut path = Nominal::starting(start_s, start_estimate.state);
    for interval in intervals {
        path.extend(*interval, &start_estimate.biases, &start_estimate.gravity());
    }
    let Some(last) = path.states().last().copied() else { return path };
    let rotation = (end.state.rotation * last.rotation.inverse()).scaled_axis();
    let (translation, velocity_change) = (end.state.position - last.position, end.state.velocity - last.velocity);
    let span_s = path.end_s() - start_s;
    let fractions: Vec<f64> = path.times_s().iter().map(|at_s| (at_s - start_s) / span_s).collect();
    path.correct(0, |node| Correction {
        rotation: rotation * fractions[node],
        translation: translation * fractions[node],
        velocity: velocity_change * fractions[node],
    });
    path
}

/// Mean of the timed innovations of an epoch that ends at `end_s`, with their largest standard deviations.
fn mean(innovations: &[(f64, Innovation)], end_s: f64) -> Option<Innovation> {
    let n = innovations.len() as f64;
    let vector = |of: fn(&Innovation) -> Vector| innovations.iter().map(|(_, one)| of(one)).sum::<Vector>() / n;
    let worst = |of: fn(&FixSigmas) -> f64| innovations.iter().map(|(_, one)| of(&one.sigmas)).fold(0.0, f64::max);
    (!innovations.is_empty()).then(|| Innovation {
        rotation: vector(|one| one.rotation),
        translation: vector(|one| one.translation),
        angular_velocity: vector(|one| one.angular_velocity),
        ago_s: end_s - innovations.iter().map(|(at_s, _)| at_s).sum::<f64>() / n,
        sigmas: FixSigmas { position_m: worst(|s| s.position_m), rotation_rad: worst(|s| s.rotation_rad) },
    })
}
