//! Rests of the head on the way: zero velocity and zero rate are measurements too.

use crate::estimation::initial::Rest;
use crate::estimation::strapdown::{Biases, Interval};

/// A rest lasts at least this long, s, and is not believed for this long at either end.
const LASTS_S: f64 = 0.7;
const MARGIN_S: f64 = 0.15;
/// A candidate survives missing samples over at most this, s: single ones that a driver loses, no gap in which a head
/// could move and come to rest again.
const MISSING_S: f64 = 0.1;
/// A head at rest turns more slowly than this beyond the gyroscope's bias, rad/s.
const RATE_RAD_PER_S: f64 = 0.01;
/// And moves more slowly than this by the estimate, m/s: even motion feels the same.
const SPEED_M_PER_S: f64 = 0.15;

/// Finds rests in the intervals as they come.
#[derive(Debug, Default)]
pub(super) struct Rests {
    /// What the IMU reads since when, IMU time, s, if that has not changed since.
    candidate: Option<(Rest, f64)>,
    /// For how long the samples have been missing, s.
    missing_s: f64,
    /// From when until when the head rested, in order.
    found: Vec<(f64, f64)>,
}

impl Rests {
    /// Takes the interval that ends at `end_s`, at which the estimate has a speed of `speed_m_per_s`.
    pub(super) fn take(&mut self, interval: &Interval, biases: &Biases, (end_s, speed_m_per_s): (f64, f64)) {
        self.missing_s = if interval.bridged { self.missing_s + interval.h } else { 0.0 };
        if interval.bridged && self.missing_s < MISSING_S {
            return;
        }
        let goes_on = self.candidate.is_some_and(|(rest, _)| rest.goes_on(interval));
        let is_still = (interval.gyro - biases.gyro).norm() < RATE_RAD_PER_S + 6.0 * interval.gyro_sigma
            && !interval.bridged
            && speed_m_per_s < SPEED_M_PER_S;
        if !(goes_on && is_still) {
            self.candidate = is_still.then(|| (Rest::from(interval), end_s));
            return;
        }
        let Some((_, since_s)) = self.candidate else { return };
        if end_s - since_s < LASTS_S {
            return;
        }
        let rest = (since_s + MARGIN_S, end_s - MARGIN_S);
        match self.found.last_mut().filter(|last| last.0 == rest.0) {
            Some(last) => *last = rest,
            None => self.found.push(rest),
        }
    }

    /// Whether the head rests at `u_s`, IMU time.
    pub(super) fn at(&self, u_s: f64) -> bool {
        let after = self.found.partition_point(|(from_s, _)| *from_s <= u_s);
        after.checked_sub(1).is_some_and(|k| u_s <= self.found[k].1)
    }

    /// Forgets rests that were over before `u_s`.
    pub(super) fn forget_before(&mut self, u_s: f64) {
        self.found.retain(|(_, until_s)| *until_s >= u_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;

    fn interval(rate: f64) -> Interval {
        Interval {
            h: 0.01,
            gyro: Vector::new(rate, 0.0, 0.001),
            gyro_slope: Vector::zeros(),
            accel: Vector::new(0.0, 0.0, 9.81),
            accel_slope: Vector::zeros(),
            gyro_sigma: 0.005,
            accel_sigma: 0.02,
            bridged: false,
        }
    }

    /// Rests found when the head turns before 1 s and after 3 s, at a speed of `speed`.
    fn rests(speed: f64) -> Rests {
        let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let mut rests = Rests::default();
        for k in 1..=400 {
            let end_s = f64::from(k) * 0.01;
            let rate = if (1.0..3.0).contains(&(end_s - 0.005)) { 0.002 } else { 0.5 };
            rests.take(&interval(rate), &biases, (end_s, speed));
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

    /// A head that rests throughout; every fifth sample is lost, or those from 2 s to 2.3 s.
    #[test]
    fn lost_samples_do_not_end_a_rest_and_gaps_do() {
        let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let found = |is_lost: &dyn Fn(usize) -> bool| {
            let mut rests = Rests::default();
            for k in 1..=400 {
                let interval = Interval { bridged: is_lost(k), ..interval(0.002) };
                rests.take(&interval, &biases, (k as f64 * 0.01, 0.01));
            }
            rests
        };
        let sparse = found(&|k| k % 5 == 0);
        assert!((20..380).all(|k| sparse.at(f64::from(k) * 0.01)));
        let gap = found(&|k| (200..230).contains(&k));
        assert!(gap.at(1.7) && !gap.at(2.15) && !gap.at(2.35) && gap.at(3.5));
    }

    #[test]
    fn even_motion_is_no_rest() {
        let rests = rests(8.0);
        assert!((0..400).all(|k| !rests.at(f64::from(k) * 0.01)));
    }
}
