//! The IMU readings of the window's intervals, as the clock offset and the corrections of the IMU change.

use crate::clock::Clock;
use crate::imu_signal::ImuSignal;
use crate::nominal::Nominal;
use crate::spec::Formulation;
use crate::strapdown::Interval;
use crate::unknowns::{Unknowns, scale_misalignment_step};

/// A node of the trajectory is left out if it would be closer to the last one than this fraction of the interval.
const MIN_INTERVAL_RATIO: f64 = 0.25;
/// Readings are kept for this time before the first node, s: room for a change of the clock offset.
const KEPT_S: f64 = 0.1;

/// How the intervals of the trajectory get their readings.
#[derive(Debug)]
pub(super) enum Readings {
    /// The trajectory is in IMU time: its intervals are those of the IMU.
    OfIntervals,
    /// The trajectory is in lidar time: the readings depend on the clock offset.
    OfSignal(ImuSignal),
}

impl Readings {
    pub(super) fn of(formulation: Formulation) -> Self {
        match formulation {
            Formulation::ImuTime => Self::OfIntervals,
            Formulation::Paper => Self::OfSignal(ImuSignal::default()),
        }
    }

    /// The next interval of the trajectory, given the next `interval` of the IMU and its start, IMU time, s.
    ///
    /// None if the clock offset has increased so much that the interval belongs to the past.
    pub(super) fn next(
        &mut self,
        start_s: f64,
        interval: &Interval,
        nominal: &Nominal,
        clock: &Clock,
    ) -> Option<Interval> {
        let Self::OfSignal(signal) = self else { return Some(*interval) };
        signal.push(start_s, *interval);
        let from_s = nominal.end_s();
        let to_s = clock.trajectory_from_imu_s(start_s + interval.h);
        let h = to_s - from_s;
        let is_new = h > MIN_INTERVAL_RATIO * interval.h;
        let (from_u_s, to_u_s) = (clock.imu_from_trajectory_s(from_s), clock.imu_from_trajectory_s(to_s));
        signal.mean(from_u_s, to_u_s).filter(|_| is_new).map(|readings| Interval { h, ..readings })
    }

    /// Forgets readings that no node of the trajectory needs.
    pub(super) fn forget_before(&mut self, nominal: &Nominal, clock: &Clock) {
        if let (Self::OfSignal(signal), Some(first_s)) = (self, nominal.times_s().first()) {
            signal.forget_before(clock.imu_from_trajectory_s(*first_s) - KEPT_S);
        }
    }

    /// Updates the readings of all intervals of `nominal` after a step of the border, which the `unknowns` include.
    pub(super) fn update(&self, nominal: &mut Nominal, unknowns: &Unknowns, step: &[f64]) {
        let Self::OfSignal(signal) = self else {
            return nominal.correct_readings(&scale_misalignment_step(step));
        };
        let clock = &unknowns.clock;
        nominal.replace_readings(|from_s, to_s| {
            let (from_u_s, to_u_s) = (clock.imu_from_trajectory_s(from_s), clock.imu_from_trajectory_s(to_s));
            signal.mean(from_u_s, to_u_s).map(|readings| readings.corrected_by(&unknowns.scale_misalignment))
        });
    }
}
