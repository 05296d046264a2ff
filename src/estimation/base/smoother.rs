//! Forwards, backwards, and the poses in between.

use super::filter::{Difference, Estimate, Filter, Square};
use super::fixes::Fixes;
use super::{BaseEstimate, BaseImu, EPOCH_S, FixSigmas};
use crate::estimation::nominal::{Correction, Nominal};
use crate::estimation::strapdown::Interval;
use crate::estimation::{EstimationError, EstimatorSpec};
use crate::geometry::{Pose, Rotation, Trajectory, Vector};
use crate::time::Stamp;
use std::ops::Range;

/// Epochs whose matrices are in memory at once: a minute.
const EPOCHS_AT_ONCE: usize = 1200;

/// Instants that are this close are one, s.
const ROUNDED_S: f64 = 1e-6;

/// An epoch: some intervals, and when the first of them begins, s on the IMU's clock.
#[derive(Debug, Clone)]
struct Epoch {
    start_s: f64,
    intervals: Range<usize>,
}

/// What the filter did in an epoch.
struct Step {
    /// How the errors at its start went along to its end.
    along: Square,
    predicted: Estimate,
    predicted_covariance: Square,
    corrected: Estimate,
    corrected_covariance: Square,
}

/// The whole problem.
struct Problem<'a> {
    fixes: &'a Fixes,
    intervals: &'a [Interval],
}

/// Smooths the base's trajectory from the `intervals` of its IMU, which begin at `start_s`.
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
    let Some((fix, velocity)) = start else {
        return Err(EstimationError::Base("no fixes while its IMU spoke".to_owned()));
    };
    let mut filter = Filter::beginning(fix, velocity, offset_s, &imu.noise, spec);
    let mut kept = Vec::new();
    for minute in epochs.chunks(EPOCHS_AT_ONCE) {
        kept.push(filter.clone());
        for epoch in minute {
            problem.step(&mut filter, epoch);
        }
    }
    let poses = problem.backwards(&epochs, kept)?;
    let imu_from_base = imu.base_from_imu.inverse();
    let poses = poses.into_iter().rev().map(|(stamp, world_from_imu)| (stamp, world_from_imu * imu_from_base));
    Ok(BaseEstimate {
        trajectory: Trajectory::from_poses(poses)
            .map_err(|error| EstimationError::Base(format!("its estimate: {error}")))?,
        up_in_world: -filter.estimate.gravity().normalize(),
        clock_offset_s: filter.estimate.offset_s,
        clock_offset_sigma_s: filter.offset_sigma_s(),
    })
}

impl Problem<'_> {
    /// Cuts the time that intervals and fixes have in common into epochs.
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

    /// The fix at `tau_s`, or after it, and the velocity there, m/s.
    fn start(&self, tau_s: f64) -> Option<((Pose, FixSigmas), Vector)> {
        let (from, to) = (self.fixes.at(tau_s)?, self.fixes.at(tau_s + EPOCH_S)?);
        let way = to.0.translation.vector - from.0.translation.vector;
        Some((from, way / EPOCH_S))
    }

    /// The filter through an epoch.
    fn step(&self, filter: &mut Filter, epoch: &Epoch) -> Step {
        let mut along = Square::identity();
        let mut differences = Vec::new();
        let mut u_s = epoch.start_s;
        for interval in &self.intervals[epoch.intervals.clone()] {
            along = filter.predict(interval) * along;
            u_s += interval.h;
            differences.extend(self.difference(&filter.estimate, interval, u_s));
        }
        let (predicted, predicted_covariance) = (filter.estimate, filter.covariance);
        if let Some(difference) = mean(&differences, u_s) {
            filter.correct(&difference);
        }
        let (corrected, corrected_covariance) = (filter.estimate, filter.covariance);
        Step { along, predicted, predicted_covariance, corrected, corrected_covariance }
    }

    /// What a fix says at `u_s`, where `interval` ends, against `estimate`, with that instant.
    fn difference(&self, estimate: &Estimate, interval: &Interval, u_s: f64) -> Option<(f64, Difference)> {
        let (pose, sigmas) = self.fixes.at(u_s - estimate.offset_s)?;
        let state = &estimate.state;
        let difference = Difference {
            turn: (pose.rotation * state.rotation.inverse()).scaled_axis(),
            shift: pose.translation.vector - state.position,
            turning: state.rotation * (interval.gyro - estimate.biases.gyro),
            ago_s: 0.0,
            sigmas,
        };
        Some((u_s, difference))
    }

    /// The smoothed poses at the fixes' stamps, the last one first; `kept` has the filter at the start of each minute.
    fn backwards(&self, epochs: &[Epoch], kept: Vec<Filter>) -> Result<Vec<(Stamp, Pose)>, EstimationError> {
        let mut poses = Vec::new();
        let mut untold = self.fixes.world_from_imu.stamps();
        let mut smoothed: Option<Estimate> = None;
        for (minute, start) in epochs.chunks(EPOCHS_AT_ONCE).zip(kept).rev() {
            let mut filter = start.clone();
            let steps: Vec<Step> = minute.iter().map(|epoch| self.step(&mut filter, epoch)).collect();
            for (k, epoch) in minute.iter().enumerate().rev() {
                let end = smoothed.unwrap_or(steps[k].corrected);
                let before = k.checked_sub(1).map(|k| &steps[k]);
                let filtered = before.map_or((&start.estimate, &start.covariance), Step::end);
                let begin = steps[k].smoothed_start(filtered, &end)?;
                untold = self.tell(epoch, [&begin, &end], untold, &mut poses);
                smoothed = Some(begin);
            }
        }
        Ok(poses)
    }

    /// Adds the poses of an epoch between two smoothed estimates at the last of the `untold` stamps, and tells which
    /// are left.
    fn tell<'s>(
        &self,
        epoch: &Epoch,
        [begin, end]: [&Estimate; 2],
        mut untold: &'s [Stamp],
        poses: &mut Vec<(Stamp, Pose)>,
    ) -> &'s [Stamp] {
        let between = between(epoch.start_s, &self.intervals[epoch.intervals.clone()], [begin, end]);
        let span_s = between.end_s() - epoch.start_s;
        while let Some((stamp, earlier)) = untold.split_last() {
            let near_s = stamp.seconds_since(self.fixes.origin) + begin.offset_s;
            let u_s = near_s + (end.offset_s - begin.offset_s) * ((near_s - epoch.start_s) / span_s).clamp(0.0, 1.0);
            if u_s < epoch.start_s {
                break;
            }
            untold = earlier;
            if u_s <= between.end_s() + ROUNDED_S {
                let motion = between.at(u_s, &begin.biases.gyro);
                let rotation = Rotation::from_matrix(&motion.rotation);
                poses.push((*stamp, Pose::from_parts(motion.position.into(), rotation)));
            }
        }
        untold
    }
}

impl Step {
    /// What the filter says at the step's end.
    fn end(&self) -> (&Estimate, &Square) {
        (&self.corrected, &self.corrected_covariance)
    }

    /// The smoothed estimate at the step's start, where the filter said `filtered`, from that at its end.
    fn smoothed_start(&self, filtered: (&Estimate, &Square), end: &Estimate) -> Result<Estimate, EstimationError> {
        let whole = self.predicted_covariance.cholesky().ok_or_else(|| {
            EstimationError::Base("its covariance lost its rank: are the IMU's noise figures right?".to_owned())
        })?;
        // P F' (F P F' + Q)^-1, transposed.
        let gain = whole.solve(&(self.along * filtered.1)).transpose();
        Ok(filtered.0.plus(&(gain * end.minus(&self.predicted))))
    }
}

/// The IMU's way through an epoch: integrated from its start, and by and by shifted onto its end.
fn between(start_s: f64, intervals: &[Interval], [begin, end]: [&Estimate; 2]) -> Nominal {
    let mut way = Nominal::starting(start_s, begin.state);
    for interval in intervals {
        way.extend(*interval, &begin.biases, &begin.gravity());
    }
    let Some(last) = way.states().last().copied() else { return way };
    let turn = (end.state.rotation * last.rotation.inverse()).scaled_axis();
    let (shift, faster) = (end.state.position - last.position, end.state.velocity - last.velocity);
    let span_s = way.end_s() - start_s;
    let shares: Vec<f64> = way.times_s().iter().map(|at_s| (at_s - start_s) / span_s).collect();
    way.correct(0, |node| Correction {
        rotation: turn * shares[node],
        translation: shift * shares[node],
        velocity: faster * shares[node],
    });
    way
}

/// The mean of an epoch's differences, each with its instant, in an epoch that ends at `end_s`.
fn mean(differences: &[(f64, Difference)], end_s: f64) -> Option<Difference> {
    let n = differences.len() as f64;
    let vector = |of: fn(&Difference) -> Vector| differences.iter().map(|(_, one)| of(one)).sum::<Vector>() / n;
    let worst = |of: fn(&FixSigmas) -> f64| differences.iter().map(|(_, one)| of(&one.sigmas)).fold(0.0, f64::max);
    (!differences.is_empty()).then(|| Difference {
        turn: vector(|one| one.turn),
        shift: vector(|one| one.shift),
        turning: vector(|one| one.turning),
        ago_s: end_s - differences.iter().map(|(at_s, _)| at_s).sum::<f64>() / n,
        sigmas: FixSigmas { position_m: worst(|s| s.position_m), rotation_rad: worst(|s| s.rotation_rad) },
    })
}
