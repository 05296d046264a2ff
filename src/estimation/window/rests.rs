//! Rests after the start: zero-velocity and zero-rate measurements.

use crate::initial::RestReadings;
use crate::strapdown::{Biases, Interval};

/// Minimum duration of a rest, s.
const MIN_DURATION_S: f64 = 0.7;
/// Margin at both ends of a rest, in which no rest is assumed, s.
const MARGIN_S: f64 = 0.15;
/// Longer runs of missing samples end a rest, s: in a gap of this length the head could move and stop.
const MAX_MISSING_S: f64 = 0.1;
/// Maximum turn rate at rest after subtraction of the gyroscope bias, rad/s; the sample noise is added to it.
const MAX_RATE_RAD_PER_S: f64 = 0.01;
/// Maximum estimated speed at rest, m/s, where the lidar does not show rest: the IMU cannot distinguish constant motion from it.
pub(super) const MAX_SPEED_M_PER_S: f64 = 0.15;

/// Detects rests in the sequence of intervals.
#[derive(Debug, Default)]
pub(super) struct Rests {
    /// The IMU readings of a possible rest, and the start of it, trajectory time, s.
    candidate: Option<(RestReadings, f64)>,
    /// Duration of the missing samples so far, s.
    missing_s: f64,
    /// Start and end of each rest, in order, trajectory time, s.
    found: Vec<(f64, f64)>,
}

impl Rests {
    /// Adds the interval that ends at `end_s`, where the estimated speed is `speed_m_per_s`, as far as the lidar
    /// does not show rest.
    pub(super) fn take(&mut self, interval: &Interval, biases: &Biases, end_s: f64, speed_m_per_s: f64) {
        self.missing_s = if interval.bridged { self.missing_s + interval.h } else { 0.0 };
        if interval.bridged && self.missing_s < MAX_MISSING_S {
            return;
        }
        let continues = self.candidate.is_some_and(|(rest, _)| rest.agrees_with(interval));
        let is_still = !interval.bridged && !turns(interval, biases) && speed_m_per_s < MAX_SPEED_M_PER_S;
        if !(continues && is_still) {
            self.candidate = is_still.then(|| (RestReadings::from(interval), end_s));
            return;
        }
        let Some((_, since_s)) = self.candidate else { return };
        if end_s - since_s < MIN_DURATION_S {
            return;
        }
        let rest = (since_s + MARGIN_S, end_s - MARGIN_S);
        match self.found.last_mut().filter(|last| last.0 == rest.0) {
            Some(last) => *last = rest,
            None => self.found.push(rest),
        }
    }

    /// Whether the head rests at `u_s`, trajectory time.
    pub(super) fn at(&self, u_s: f64) -> bool {
        let after = self.found.partition_point(|(from_s, _)| *from_s <= u_s);
        after.checked_sub(1).is_some_and(|k| u_s <= self.found[k].1)
    }

    /// Removes rests that ended before `u_s`.
    pub(super) fn forget_before(&mut self, u_s: f64) {
        self.found.retain(|(_, until_s)| *until_s >= u_s);
    }
}

/// Whether the head turns during an interval, by more than noise.
pub(super) fn turns(interval: &Interval, biases: &Biases) -> bool {
    (interval.gyro - biases.gyro).norm() >= MAX_RATE_RAD_PER_S + 6.0 * interval.gyro_sigma
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;

    fn interval(rate: f64) -> Interval {
        Interval {
            h: 0.01,
            gyro: Vector::new(rate, 0.0, 0.001),
            gyro_slope: Vector::zeros(),
            accel: Vector::new(0.0, 0.0, 9.81),
            accel_slope: Vector::zeros(),
            uncompensated: 1.0,
            gyro_sigma: 0.005,
            accel_sigma: 0.02,
            bridged: false,
        }
    }

    /// Rests of a head that turns before 1 s and after 3 s and has a speed of `speed`.
    fn rests(speed: f64) -> Rests {
        let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let mut rests = Rests::default();
        for k in 1..=400 {
            let end_s = f64::from(k) * 0.01;
            let rate = if (1.0..3.0).contains(&(end_s - 0.005)) { 0.002 } else { 0.5 };
            rests.take(&interval(rate), &biases, end_s, speed);
        }
        rests
    }

    #[test]
    fn a_head_that_does_not_turn_and_does_not_move_rests() {
        let rests = rests(0.01);
        assert!(
            !rests.at(0.9) && !rests.at(1.1) && rests.at(1.3) && rests.at(2.8) && !rests.at(2.95) && !rests.at(3.5)
        );
    }

    /// A head that rests throughout; every fifth sample is lost, or the samples from 2 s to 2.3 s.
    #[test]
    fn lost_samples_do_not_end_a_rest_and_gaps_do() {
        let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let found = |is_lost: &dyn Fn(usize) -> bool| {
            let mut rests = Rests::default();
            for k in 1..=400 {
                let interval = Interval { bridged: is_lost(k), ..interval(0.002) };
                rests.take(&interval, &biases, k as f64 * 0.01, 0.01);
            }
            rests
        };
        let sparse = found(&|k| k % 5 == 0);
        assert!((20..380).all(|k| sparse.at(f64::from(k) * 0.01)));
        let gap = found(&|k| (200..230).contains(&k));
        assert!(gap.at(1.7) && !gap.at(2.15) && !gap.at(2.35) && gap.at(3.5));
    }

    #[test]
    fn constant_motion_is_no_rest() {
        let rests = rests(8.0);
        assert!((0..400).all(|k| !rests.at(f64::from(k) * 0.01)));
    }
}
