//! Resampling of a sensor without a period: a cubic through its readings, on a grid of about 10 ms.

use super::interpolation::{InterpolationError, between, slope};
use super::{Mean, SPACING_S};
use std::collections::VecDeque;

/// Largest standard deviation of an interpolated reading, rad/s and m/s^2.
const MAX_SIGMA: (f64, f64) = (30.0, 60.0);

/// Interpolates irregular readings by a cubic Hermite spline with slopes from finite differences.
///
#[derive(Debug)]
pub(super) struct Resampler {
    /// The last readings, at most five.
    readings: VecDeque<Mean>,
    error: InterpolationError,
}

impl Resampler {
    pub(super) fn new() -> Self {
        Self { readings: VecDeque::new(), error: InterpolationError::new() }
    }

    /// Forgets the readings: the next one does not continue them.
    pub(super) fn restart(&mut self) {
        self.readings.clear();
    }

    /// Takes a reading. Returns the readings of the grid that have become known: those up to the previous reading.
    pub(super) fn push(&mut self, reading: Mean) -> Vec<Mean> {
        if self.readings.back().is_some_and(|last| reading.centre_s - last.centre_s < 0.2 * SPACING_S) {
            return Vec::new(); // the same sample twice
        }
        self.readings.push_back(reading);
        if self.readings.len() > 5 {
            self.readings.pop_front();
        }
        if let [a, b, c, d, e] = *self.readings.make_contiguous() {
            self.error.measure(&[a, b, c, d, e]);
        }
        match self.readings.len() {
            1 => Vec::new(),
            2 => vec![self.readings[0]],
            n => self.between(n - 3),
        }
    }

    /// The remaining readings of the grid: nothing follows.
    pub(super) fn flush(&mut self) -> Vec<Mean> {
        let rest = match self.readings.len() {
            0 => Vec::new(),
            1 => vec![self.readings[0]],
            n => self.between(n - 2),
        };
        self.readings.clear();
        rest
    }

    /// The grid from reading `k` (excluded) to the next one (included).
    fn between(&self, k: usize) -> Vec<Mean> {
        let (from, to) = (self.readings[k], self.readings[k + 1]);
        let before = k.checked_sub(1).map(|k| &self.readings[k]);
        let slopes = [slope(before, &from, Some(&to)), slope(Some(&from), &to, self.readings.get(k + 2))];
        let gap_s = to.centre_s - from.centre_s;
        let steps = (gap_s / SPACING_S).round().max(1.0);
        let sigmas = self.error.sigmas(gap_s, steps);
        let (extra_gyro_sigma, extra_accel_sigma) = (sigmas.0.min(MAX_SIGMA.0), sigmas.1.min(MAX_SIGMA.1));
        let inner = (1..steps as usize).map(|step| {
            let u = step as f64 / steps;
            let near = if u < 0.5 { &from } else { &to };
            let (gyro, accel) = between(&from, &to, &slopes, u);
            let bridged = gap_s > 4.5 * SPACING_S;
            Mean {
                centre_s: from.centre_s + u * gap_s,
                gyro,
                accel,
                extra_gyro_sigma,
                extra_accel_sigma,
                bridged,
                ..*near
            }
        });
        inner.chain([to]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::Clipped;
    use zsim_base::geometry::Vector;

    /// Rate and force of a head that rocks at 1.2 Hz, with a second component at 3.1 Hz.
    fn signal(t_s: f64) -> (Vector, Vector) {
        let (a, b) = (7.5 * t_s, 19.5 * t_s);
        (Vector::new(5.0 * a.cos(), 0.4 * b.sin(), 0.1), Vector::new(3.0 * a.sin(), 0.5 * b.cos(), 9.8))
    }

    fn reading(centre_s: f64) -> Mean {
        let (gyro, accel) = signal(centre_s);
        let (extra_gyro_sigma, extra_accel_sigma) = (0.0, 0.0);
        Mean { centre_s, gyro, accel, extra_gyro_sigma, extra_accel_sigma, clipped: Clipped::NONE, bridged: false }
    }

    /// Twenty seconds of readings, 25 to 65 ms apart (golden-ratio sequence), with one gap of 0.2 s.
    fn irregular_times() -> Vec<f64> {
        let step = |k: i32| 0.025 + 0.04 * (0.618_033_988_75 * f64::from(k)).fract() + if k == 200 { 0.2 } else { 0.0 };
        let sum_before = |t_s: &mut f64, k: i32| Some(std::mem::replace(t_s, *t_s + step(k)));
        (0..440).scan(0.0, sum_before).collect()
    }

    #[test]
    fn readings_on_the_grid_are_as_accurate_as_they_claim() {
        let mut resampler = Resampler::new();
        let mut grid: Vec<Mean> = irregular_times().into_iter().flat_map(|t| resampler.push(reading(t))).collect();
        grid.extend(resampler.flush());
        let spacings = grid.windows(2).map(|pair| pair[1].centre_s - pair[0].centre_s);
        assert!(spacings.clone().all(|spacing| spacing > 0.0 && spacing < 1.5 * SPACING_S));
        let interpolated: Vec<&Mean> = grid.iter().filter(|mean| mean.extra_gyro_sigma > 0.0).collect();
        assert!(interpolated.len() > 1000, "{}", interpolated.len());
        let error = |mean: &Mean| (mean.gyro - signal(mean.centre_s).0).norm();
        let within = interpolated.iter().filter(|mean| error(mean) < 2.0 * mean.extra_gyro_sigma).count();
        assert!(within as f64 > 0.99 * interpolated.len() as f64, "{within} of {}", interpolated.len());
        // Except in the gap the interpolation is good to a hundredth of the amplitude.
        let worst = interpolated.iter().filter(|mean| !mean.bridged).map(|mean| error(mean)).fold(0.0, f64::max);
        assert!(worst < 0.05, "{worst}");
    }

    #[test]
    fn readings_are_kept_as_they_are() {
        let times = irregular_times();
        let mut resampler = Resampler::new();
        let mut grid: Vec<Mean> = times.iter().flat_map(|t| resampler.push(reading(*t))).collect();
        grid.extend(resampler.flush());
        let kept: Vec<f64> =
            grid.iter().filter(|mean| mean.extra_gyro_sigma == 0.0).map(|mean| mean.centre_s).collect();
        assert_eq!(kept, times);
    }
}
