//! The motion of the last seconds, on which the bridging of a gap is tried.

use super::Mean;
use super::interpolation::InterpolationError;
use super::reconstruction::{FIT_MEANS, bridge};
use std::collections::VecDeque;
use zsim_base::geometry::Rotation;

/// Length of the motion that is kept, s: about two swings of the head.
const KEPT_S: f64 = 2.0;
/// Fewer trials say nothing about the motion.
const MIN_TRIALS: usize = 4;
/// Means between the starts of two trials.
const TRIAL_STRIDE: usize = 5;

/// Consecutive measured means of the last two seconds, at regular intervals.
#[derive(Debug, Default)]
pub(super) struct RecentMotion {
    means: VecDeque<Mean>,
}

impl RecentMotion {
    /// Adds a mean; `spacing_s` is the regular interval. A bridged mean or a gap ends the motion before it.
    pub(super) fn push(&mut self, mean: Mean, spacing_s: f64) {
        if self.means.back().is_some_and(|last| mean.centre_s - last.centre_s > 1.5 * spacing_s) {
            self.means.clear();
        }
        if mean.bridged || mean.clipped.any() {
            self.means.clear();
            return;
        }
        self.means.push_back(mean);
        while self.means.front().is_some_and(|first| mean.centre_s - first.centre_s > KEPT_S) {
            self.means.pop_front();
        }
    }

    pub(super) fn clear(&mut self) {
        self.means.clear();
    }

    /// Root mean square error of the attitude after bridging gaps of `gap_s` in this motion, rad.
    ///
    /// `None` if the motion is too short to tell.
    pub(super) fn bridging_error_rad(&self, gap_s: f64, spacing_s: f64) -> Option<f64> {
        let means: Vec<Mean> = self.means.iter().copied().collect();
        let steps = (gap_s / spacing_s).round().max(2.0) as usize;
        let length = 2 * FIT_MEANS + steps - 1;
        let trials: Vec<f64> =
            means.windows(length).step_by(TRIAL_STRIDE).map(|run| attitude_error(run, steps, spacing_s)).collect();
        let mean_square = trials.iter().map(|error| error * error).sum::<f64>() / trials.len() as f64;
        (trials.len() >= MIN_TRIALS).then(|| mean_square.sqrt())
    }
}

/// Attitude error of bridging the middle of `run`, whose ends of [`FIT_MEANS`] means are given, rad.
fn attitude_error(run: &[Mean], steps: usize, spacing_s: f64) -> f64 {
    let (before, rest) = run.split_at(FIT_MEANS);
    let (missing, after) = rest.split_at(steps - 1);
    let bridged = bridge(before, after, steps, &InterpolationError::new());
    let turn = |means: &[Mean]| {
        means.iter().fold(Rotation::identity(), |turn, mean| turn * Rotation::from_scaled_axis(mean.gyro * spacing_s))
    };
    turn(missing).angle_to(&turn(&bridged))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::clipping::Clipped;
    use zsim_base::geometry::Vector;

    /// Error of bridging 0.2 s of a sinusoidal rotation about one axis with an amplitude of 3 rad/s.
    fn error_at(frequency_hz: f64) -> f64 {
        let mut motion = RecentMotion::default();
        for k in 0..200 {
            let centre_s = 0.01 * f64::from(k);
            let rate = 3.0 * (std::f64::consts::TAU * frequency_hz * centre_s).sin();
            let (gyro, accel) = (Vector::new(rate, 0.0, 0.0), Vector::new(0.0, 0.0, 9.81));
            let (extra_gyro_sigma, extra_accel_sigma) = (0.0, 0.0);
            let clipped = Clipped::NONE;
            motion.push(
                Mean { centre_s, gyro, accel, extra_gyro_sigma, extra_accel_sigma, clipped, bridged: false },
                0.01,
            );
        }
        motion.bridging_error_rad(0.2, 0.01).unwrap()
    }

    /// The error of a cubic Hermite through both ends is that of the fourth derivative: `w^4 gap^4 / 384` at its middle and
    /// 8/15 of that on average. The slopes of the fitted lines, 20 ms inside, add about as much.
    #[test]
    fn a_slow_swing_can_be_bridged_and_a_fast_one_cannot() {
        let cubic = |frequency_hz: f64| {
            let turns = std::f64::consts::TAU * frequency_hz * 0.2;
            3.0 / 2.0_f64.sqrt() * turns.powi(4) / 384.0 * 8.0 / 15.0 * 0.2
        };
        let slow = error_at(1.0);
        assert!(slow > cubic(1.0) && slow < 20.0 * cubic(1.0), "{slow} {}", cubic(1.0));
        assert!(error_at(6.0) > 0.2, "{}", error_at(6.0));
    }

    #[test]
    fn a_gap_ends_the_motion() {
        let mean = |centre_s: f64| Mean {
            centre_s,
            gyro: Vector::zeros(),
            accel: Vector::zeros(),
            extra_gyro_sigma: 0.0,
            extra_accel_sigma: 0.0,
            clipped: Clipped::NONE,
            bridged: false,
        };
        let mut motion = RecentMotion::default();
        (0..150).for_each(|k| motion.push(mean(0.01 * f64::from(k)), 0.01));
        assert_eq!(motion.bridging_error_rad(0.2, 0.01), Some(0.0));
        (160..180).for_each(|k| motion.push(mean(0.01 * f64::from(k)), 0.01));
        assert_eq!(motion.bridging_error_rad(0.2, 0.01), None);
    }
}
