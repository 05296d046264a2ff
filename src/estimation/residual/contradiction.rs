//! Contradiction between the IMU measurements and a trajectory.

use super::imu_residual::Inertial;
use crate::strapdown::{Biases, Interval, State};
use zsim_base::geometry::Vector;

/// Rotations and velocities are summed over this interval, s, which averages the noise of single samples.
const SUM_INTERVAL_S: f64 = 0.2;

/// Residuals of rotation (rad) and velocity (m/s) summed over a time span, and the variance of each on an axis.
#[derive(Default)]
struct SummedResidual {
    duration_s: f64,
    residuals: [Vector; 2],
    variances: [f64; 2],
}

impl SummedResidual {
    fn add(&mut self, terms: &Inertial, interval: &Interval) {
        let h = interval.h;
        self.duration_s += h;
        self.residuals[0] += terms.map_from_end * terms.rate * h;
        self.residuals[1] += terms.map_from_middle * terms.force * h;
        self.variances[0] += (interval.gyro_sigma * h).powi(2);
        self.variances[1] += (interval.accel_sigma * h).powi(2);
    }

    /// Both residuals as multiples of the standard deviations.
    fn multiples(&self) -> [f64; 2] {
        [0, 1].map(|k| self.residuals[k].norm() / (3.0 * self.variances[k]).sqrt())
    }
}

/// The disagreement between IMU samples and `states`, as a multiple of the IMU noise.
///
/// The median over spans of the rotation or of the velocity residual, the larger of the two; about 1 for consistent
/// data.
pub(crate) fn contradiction(states: &[State], intervals: &[Interval], biases: &Biases, gravity: &Vector) -> f64 {
    let (mut sum, mut times) = (SummedResidual::default(), [Vec::new(), Vec::new()]);
    for (ends, interval) in states.windows(2).zip(intervals) {
        sum.add(&Inertial::between(&ends[0], &ends[1], interval, biases, gravity), interval);
        if sum.duration_s >= SUM_INTERVAL_S {
            let multiples = std::mem::take(&mut sum).multiples();
            times.iter_mut().zip(multiples).for_each(|(all, one)| all.push(one));
        }
    }
    let median = |mut all: Vec<f64>| {
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or_default()
    };
    times.into_iter().map(median).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use zsim_base::geometry::gravity_in_world;

    /// Forty seconds of an IMU under rotation and vibration, and the states integrated from it.
    fn run(biases: &Biases, gravity: &Vector) -> (Vec<State>, Vec<Interval>) {
        let mut states =
            vec![State { rotation: Default::default(), position: Vector::zeros(), velocity: Vector::zeros() }];
        let mut intervals = Vec::new();
        for k in 0..4000 {
            let (sin, cos) = (f64::from(k) * 0.05).sin_cos();
            let interval = Interval {
                h: 0.01,
                gyro: Vector::new(0.5 * cos, 0.2, -sin),
                gyro_slope: Vector::zeros(),
                accel: Vector::new(2.0 * sin, -cos, 9.8 + sin),
                accel_slope: Vector::zeros(),
                uncompensated: 1.0,
                gyro_sigma: 0.006,
                accel_sigma: 0.02,
                bridged: false,
            };
            states.extend(states.last().map(|last| last.after(&interval, biases, gravity)));
            intervals.push(interval);
        }
        (states, intervals)
    }

    #[test]
    fn white_noise_gives_the_median_of_its_norm_and_a_flipped_sign_a_large_value() {
        let (biases, gravity) = (Biases { gyro: Vector::zeros(), accel: Vector::zeros() }, gravity_in_world());
        let (states, mut intervals) = run(&biases, &gravity);
        let multiples = |intervals: &[Interval]| contradiction(&states, intervals, &biases, &gravity);
        assert!(multiples(&intervals) < 1e-6);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut noise = |sigma: f64| Vector::from_fn(|_, _| sigma * random.sample::<f64, _>(StandardNormal));
        for interval in &mut intervals {
            interval.gyro += noise(interval.gyro_sigma);
            interval.accel += noise(interval.accel_sigma);
        }
        // The median of chi-squared with three degrees of freedom is 2.366. With 200 spans the sample median has an
        // error of 6 %; the larger of two medians is above it.
        let expected = (2.366_f64 / 3.0).sqrt();
        assert!((multiples(&intervals) / expected - 1.0).abs() < 0.15, "{}", multiples(&intervals));
        intervals.iter_mut().for_each(|interval| interval.accel.x *= -1.0);
        assert!(multiples(&intervals) > 20.0);
    }
}
