//! The IMU readings as a signal over IMU time.

use super::strapdown::Interval;
use std::collections::VecDeque;
use zsim_base::geometry::Vector;

/// Readings as a function of IMU time: linear in each interval, and extrapolated before the first and after the last one.
#[derive(Debug, Clone, Default)]
pub(super) struct ImuSignal {
    /// Start of each interval, IMU time, s, with the readings.
    intervals: VecDeque<(f64, Interval)>,
}

impl ImuSignal {
    /// Appends the interval that starts at `start_s`, IMU time, s.
    pub(super) fn push(&mut self, start_s: f64, interval: Interval) {
        self.intervals.push_back((start_s, interval));
    }

    /// Removes the intervals that end before `time_s`, IMU time, s.
    pub(super) fn forget_before(&mut self, time_s: f64) {
        while self.intervals.len() > 1 && self.intervals[0].0 + self.intervals[0].1.h < time_s {
            self.intervals.pop_front();
        }
    }

    /// The mean readings from `from_s` to `to_s`, IMU time, s; none without readings.
    pub(super) fn mean(&self, from_s: f64, to_s: f64) -> Option<Interval> {
        let after = self.intervals.partition_point(|(start_s, _)| *start_s <= from_s);
        let mut index = after.saturating_sub(1);
        let mut mean = zero(to_s - from_s);
        let mut part_from_s = from_s;
        while part_from_s < to_s {
            let (start_s, interval) = self.intervals.get(index)?;
            let is_last = index + 1 == self.intervals.len();
            let part_to_s = if is_last { to_s } else { self.intervals[index + 1].0.min(to_s) };
            let middle_s = 0.5 * (part_from_s + part_to_s);
            let weight = (part_to_s - part_from_s) / (to_s - from_s);
            add(&mut mean, interval, middle_s - start_s - 0.5 * interval.h, weight);
            part_from_s = part_to_s;
            index += 1;
        }
        Some(mean)
    }
}

/// Readings of length `h`, s, to which [`add`] adds.
fn zero(h: f64) -> Interval {
    Interval {
        h,
        gyro: Vector::zeros(),
        gyro_slope: Vector::zeros(),
        accel: Vector::zeros(),
        accel_slope: Vector::zeros(),
        uncompensated: 0.0,
        gyro_sigma: 0.0,
        accel_sigma: 0.0,
        bridged: false,
    }
}

/// Adds a part of `interval`, the middle of which is `later_s` after the middle of the interval, with a weight.
fn add(mean: &mut Interval, interval: &Interval, later_s: f64, weight: f64) {
    mean.gyro += (interval.gyro + interval.gyro_slope * later_s) * weight;
    mean.gyro_slope += interval.gyro_slope * weight;
    mean.accel += (interval.accel + interval.accel_slope * later_s) * weight;
    mean.accel_slope += interval.accel_slope * weight;
    mean.uncompensated += interval.uncompensated * weight;
    mean.gyro_sigma += interval.gyro_sigma * weight;
    mean.accel_sigma += interval.accel_sigma * weight;
    mean.bridged |= interval.bridged;
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const H_S: f64 = 0.01;

    /// A signal whose readings are the means of `signal` and its slopes.
    fn sampled(count: usize) -> ImuSignal {
        let mut sampled = ImuSignal::default();
        for k in 0..count {
            let start_s = 5.0 + k as f64 * H_S;
            let mean = (integral(start_s + H_S) - integral(start_s)) / H_S;
            let slope = Vector::new(8.0 * (8.0 * (start_s + 0.5 * H_S)).cos(), 0.0, 3.0);
            let sigmas = (0.01, 0.02);
            let interval =
                Interval { gyro: mean, gyro_slope: slope, gyro_sigma: sigmas.0, accel_sigma: sigmas.1, ..zero(H_S) };
            sampled.push(start_s, interval);
        }
        sampled
    }

    /// Integral of `(sin 8 t, 1, 3 t)`.
    fn integral(t_s: f64) -> Vector {
        Vector::new(-(8.0 * t_s).cos() / 8.0, t_s, 1.5 * t_s * t_s)
    }

    #[test]
    fn the_mean_over_an_interval_is_its_reading() {
        let signal = sampled(20);
        let mean = signal.mean(5.03, 5.04).unwrap();
        assert_relative_eq!(mean.gyro, (integral(5.04) - integral(5.03)) / H_S, epsilon = 1e-9);
        assert_relative_eq!(mean.gyro_sigma, 0.01, epsilon = 1e-12);
        assert_relative_eq!(mean.h, H_S, epsilon = 1e-12);
    }

    #[test]
    fn a_shifted_mean_is_that_of_the_signal() {
        let signal = sampled(20);
        for from_s in [5.0124, 5.0377, 5.1009] {
            let to_s = from_s + 0.0173;
            let mean = signal.mean(from_s, to_s).unwrap();
            // Linear in each interval: the error is h^2 / 12 of the second derivative, 64 / s^2, at most.
            assert_relative_eq!(mean.gyro, (integral(to_s) - integral(from_s)) / (to_s - from_s), epsilon = 5e-4);
        }
    }

    #[test]
    fn readings_are_extrapolated_at_both_ends_and_kept_after_forgetting() {
        let mut signal = sampled(20);
        for (from_s, to_s) in [(4.996, 5.006), (5.196, 5.206)] {
            let mean = signal.mean(from_s, to_s).unwrap();
            assert_relative_eq!(mean.gyro, (integral(to_s) - integral(from_s)) / H_S, epsilon = 2e-3);
        }
        let before = signal.mean(5.1, 5.11);
        signal.forget_before(5.09);
        assert_eq!(signal.mean(5.1, 5.11), before);
        assert!(signal.intervals.len() < 13, "{}", signal.intervals.len());
        assert_eq!(ImuSignal::default().mean(0.0, 0.1), None);
    }
}
