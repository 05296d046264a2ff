//! Samples of an IMU that moves.

use super::filter::{OutputFilter, steps_per_sample};
use super::ideal::{SUBINTERVALS, ideal_reading, parts};
use super::{Imu, ImuErrors, InertialReading};
use zsim_base::geometry::Kinematics;
use zsim_base::measurement::ImuAveraging;
use zsim_base::random::Seed;

/// An IMU in one run: the ideal reading of each interval with errors, saturation and the output filter.
#[derive(Debug, Clone)]
pub struct ImuSampler {
    averaging: ImuAveraging,
    errors: ImuErrors,
    filter: Option<OutputFilter>,
    /// Steps of the filter per sample.
    steps: usize,
}

impl ImuSampler {
    /// The sampler of `imu` in the run with `seed`.
    pub fn new(imu: &Imu, seed: Seed) -> Self {
        let filter = imu.spec().output_filter.as_ref();
        Self {
            averaging: imu.averaging(),
            errors: ImuErrors::new(imu, seed),
            filter: filter.map(|spec| OutputFilter::new(spec, imu.step_s())),
            steps: filter.map_or(1, |spec| steps_per_sample(spec, imu.spec().rate_hz)),
        }
    }

    /// The next sample, over the interval from `from_s` to `to_s`; `motion` is that of the IMU frame, by time.
    ///
    /// Readings saturate within the interval too, by a tenth of it; with an output filter, at each of its steps.
    pub fn sample(&mut self, motion: impl Fn(f64) -> Kinematics, interval: (f64, f64)) -> InertialReading {
        let Some(filter) = &mut self.filter else {
            let ideal = ideal_reading(self.averaging, &motion, interval);
            if self.averaging == ImuAveraging::None || self.errors.is_in_range_throughout(&ideal) {
                return self.errors.measure(&ideal);
            }
            return self.errors.measure_mean(&ideal, parts(&motion, interval, SUBINTERVALS));
        };
        let before = InertialReading::default();
        let steps = parts(&motion, interval, self.steps);
        let output = steps.fold(before, |_, part| filter.step(&self.errors.sense(&part)));
        self.errors.read_out(&output)
    }
}
