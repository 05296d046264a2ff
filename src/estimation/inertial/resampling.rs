//! Resampling of a sensor without a period: a cubic through its readings, on a grid of about 10 ms.

use super::{Mean, SPACING_S};
use crate::geometry::Vector;
use std::collections::VecDeque;

/// Initial interpolation error as a multiple of the squared gap, rad/s and m/s^2 per s^2: a head that rocks by 5 rad/s
/// at 1.2 Hz.
const INITIAL_ERROR_PER_S2: (f64, f64) = (20.0, 100.0);
/// Weight of a new measurement of the interpolation error: the error is a mean over about 30 samples.
const NEW_ERROR_WEIGHT: f64 = 1.0 / 30.0;
/// Largest standard deviation of an interpolated reading, rad/s and m/s^2.
const MAX_SIGMA: (f64, f64) = (30.0, 60.0);

/// Interpolates irregular readings by a cubic Hermite spline with slopes from finite differences.
///
/// The error of the interpolation is measured by leaving out one reading at a time, and scaled with the squared gap. A
/// smooth motion errs by a higher power of the gap; the square is on the safe side for gaps shorter than those measured.
#[derive(Debug)]
pub(super) struct Resampler {
    /// The last readings, at most five.
    readings: VecDeque<Mean>,
    /// Mean squared error of the interpolation over the squared gap, (rad/s/s^2)^2 and (m/s^2/s^2)^2.
    error2: (f64, f64),
}

impl Resampler {
    pub(super) fn new() -> Self {
        let (gyro, accel) = INITIAL_ERROR_PER_S2;
        Self { readings: VecDeque::new(), error2: (gyro * gyro, accel * accel) }
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
        self.measure_error();
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
        let slopes = (slope(before, &from, Some(&to)), slope(Some(&from), &to, self.readings.get(k + 2)));
        let gap_s = to.centre_s - from.centre_s;
        let steps = (gap_s / SPACING_S).round().max(1.0);
        // The errors within a gap have one sign: together they count as one.
        let sigma = |error2: f64, most: f64| (error2 * steps).sqrt().min(most / (gap_s * gap_s)) * gap_s * gap_s;
        let sigmas = (sigma(self.error2.0, MAX_SIGMA.0), sigma(self.error2.1, MAX_SIGMA.1));
        let inner = (1..steps as usize).map(|step| {
            let u = step as f64 / steps;
            let near = if u < 0.5 { &from } else { &to };
            let (gyro, accel) = hermite((&from, &to), &slopes, u);
            let (extra_gyro_sigma, extra_accel_sigma) = sigmas;
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

    /// Compares the reading in the middle of the last five with the interpolation between its neighbours.
    fn measure_error(&mut self) {
        let [first, from, middle, to, last] = match *self.readings.make_contiguous() {
            [a, b, c, d, e] => [a, b, c, d, e],
            _ => return,
        };
        let is_clipped = [first, from, middle, to, last].iter().any(|mean| mean.clipped.any());
        let gap_s = to.centre_s - from.centre_s;
        if is_clipped || gap_s <= 0.0 {
            return;
        }
        let slopes = (slope(Some(&first), &from, Some(&to)), slope(Some(&from), &to, Some(&last)));
        let (gyro, accel) = hermite((&from, &to), &slopes, (middle.centre_s - from.centre_s) / gap_s);
        let take = |mean: &mut f64, error: &Vector| {
            *mean += NEW_ERROR_WEIGHT * (error.norm_squared() / 3.0 / gap_s.powi(4) - *mean);
        };
        take(&mut self.error2.0, &(gyro - middle.gyro));
        take(&mut self.error2.1, &(accel - middle.accel));
    }
}

/// Slopes of angular velocity and specific force at `at`: the parabola through it and its neighbours.
fn slope(before: Option<&Mean>, at: &Mean, after: Option<&Mean>) -> (Vector, Vector) {
    let chord = |a: &Mean, b: &Mean| {
        let h = b.centre_s - a.centre_s;
        ((b.gyro - a.gyro) / h, (b.accel - a.accel) / h, h)
    };
    match (before.map(|before| chord(before, at)), after.map(|after| chord(at, after))) {
        (Some((g0, a0, h0)), Some((g1, a1, h1))) => {
            let share = h1 / (h0 + h1);
            (g0 * share + g1 * (1.0 - share), a0 * share + a1 * (1.0 - share))
        }
        (Some((gyro, accel, _)), None) | (None, Some((gyro, accel, _))) => (gyro, accel),
        (None, None) => (Vector::zeros(), Vector::zeros()),
    }
}

/// Angular velocity and specific force `u` of the way between two readings with their slopes, `u` from 0 to 1.
fn hermite((from, to): (&Mean, &Mean), slopes: &((Vector, Vector), (Vector, Vector)), u: f64) -> (Vector, Vector) {
    let gap_s = to.centre_s - from.centre_s;
    let between = |from, to| super::reconstruction::hermite(from, to, gap_s, u);
    (between((from.gyro, slopes.0.0), (to.gyro, slopes.1.0)), between((from.accel, slopes.0.1), (to.accel, slopes.1.1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::inertial::Clipped;

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
