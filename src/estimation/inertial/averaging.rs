//! Means and slopes over the intervals of an IMU, from readings of its kind of averaging.

use super::Mean;
use zsim_base::geometry::Vector;
use zsim_base::measurement::ImuAveraging;

/// Readings whose spacings differ by less than this fraction are evenly spaced.
const EVEN: f64 = 0.1;

/// Relation of readings to the motion in their intervals.
///
/// A reading that averages `n` samples over an interval `h` has the terms of its samples, which are proportional to the
/// square of their length `h / n`: the fraction `1 / n^2` of the terms for `h`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compensation {
    /// Factor of `h^2 / 24` times the second derivative, by which the mean over the interval exceeds the reading.
    curvature: f64,
    /// See [`Interval`](crate::strapdown::Interval).
    pub(super) uncompensated: f64,
}

/// A reading and those around it.
#[derive(Debug)]
pub(super) struct Neighbours {
    pub earlier: Option<Mean>,
    pub before: Option<Mean>,
    pub now: Mean,
    pub next: Mean,
}

impl Compensation {
    /// For averages of `per_group` samples. Resampling an irregular sensor discards the compensation of its intervals.
    pub(super) fn of(averaging: ImuAveraging, per_group: usize, is_irregular: bool) -> Self {
        let fraction = (per_group as f64).powi(-2);
        match averaging {
            ImuAveraging::None => Self { curvature: fraction, uncompensated: 1.0 },
            ImuAveraging::ConingCorrected if !is_irregular => Self { curvature: 0.0, uncompensated: 1.0 - fraction },
            ImuAveraging::BodyMean | ImuAveraging::ConingCorrected => Self { curvature: 0.0, uncompensated: 1.0 },
        }
    }

    /// Mean over the interval of `now`, and slope in its middle.
    ///
    /// The mean is that of a parabola through three readings. The slope is that of a cubic which has the four readings; for
    /// evenly spaced means `(10, -54, 30, 14) / 48 h`, for instantaneous readings `(8, -48, 24, 16) / 48 h`. In a swing at
    /// 100 Hz the position error of 30 s is a twentieth of that with the central difference, which is used where the
    /// spacing is uneven.
    pub(super) fn mean_and_slope(&self, readings: &Neighbours, of: fn(&Mean) -> Vector) -> (Vector, Vector) {
        let Neighbours { earlier, before, now, next } = readings;
        let until_s = next.centre_s - now.centre_s;
        let Some(before) = before else { return (of(now), (of(next) - of(now)) / until_s) };
        let since_s = now.centre_s - before.centre_s;
        let h = 0.5 * (since_s + until_s);
        let second_derivative = ((of(next) - of(now)) / until_s - (of(now) - of(before)) / since_s) / h;
        let mean = of(now) + second_derivative * (self.curvature * h * h / 24.0);
        let is_even = |spacing_s: f64| (spacing_s - h).abs() < EVEN * h;
        let earlier = earlier.filter(|earlier| is_even(until_s) && is_even(before.centre_s - earlier.centre_s));
        let slope = match earlier {
            Some(earlier) => {
                let averaged = 1.0 - self.curvature;
                let [a, b, c, d] =
                    [8.0 + 2.0 * averaged, -48.0 - 6.0 * averaged, 24.0 + 6.0 * averaged, 16.0 - 2.0 * averaged];
                (of(&earlier) * a + of(before) * b + of(now) * c + of(next) * d) / (48.0 * h)
            }
            None => (of(next) - of(before)) / (2.0 * h),
        };
        (mean, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::Clipped;
    use approx::assert_relative_eq;

    const H_S: f64 = 0.01;

    /// A cubic in time about 0; its mean over a time `h` about `t` is exceeded by `h^2 / 24` times the second derivative.
    fn cubic(t: f64, h: f64) -> Vector {
        let (c, d) = (Vector::new(30.0, -20.0, 10.0), Vector::new(200.0, 100.0, -300.0));
        Vector::new(1.0, 2.0, 3.0)
            + Vector::new(4.0, -5.0, 6.0) * t
            + c * (t * t)
            + d * t.powi(3)
            + (c * 2.0 + d * (6.0 * t)) * (h * h / 24.0)
    }

    /// Averages of `n` samples, each the mean over the length `h`, spaced by [`H_S`].
    fn readings(n: u32, h: f64) -> Neighbours {
        let reading = |k: i32| {
            let start_s = (f64::from(k) - 0.5) * H_S;
            let sample = |i: u32| cubic(start_s + (f64::from(i) + 0.5) * H_S / f64::from(n), h);
            let gyro = (0..n).map(sample).sum::<Vector>() / f64::from(n);
            let (extra_gyro_sigma, extra_accel_sigma, clipped, bridged) = (0.0, 0.0, Clipped::NONE, false);
            let (centre_s, accel) = (f64::from(k) * H_S, gyro * -2.0);
            Mean { centre_s, gyro, accel, extra_gyro_sigma, extra_accel_sigma, clipped, bridged }
        };
        Neighbours { earlier: Some(reading(-2)), before: Some(reading(-1)), now: reading(0), next: reading(1) }
    }

    #[test]
    fn mean_and_slope_of_a_cubic_are_exact_for_samples_and_means() {
        for n in [1, 2, 5] {
            for (averaging, h) in [(ImuAveraging::None, 0.0), (ImuAveraging::BodyMean, H_S / f64::from(n))] {
                let compensation = Compensation::of(averaging, n as usize, false);
                let (mean, slope) = compensation.mean_and_slope(&readings(n, h), |mean| mean.gyro);
                assert_relative_eq!(mean, cubic(0.0, H_S), epsilon = 1e-12);
                assert_relative_eq!(slope, Vector::new(4.0, -5.0, 6.0), epsilon = 1e-10);
            }
        }
    }

    #[test]
    fn averages_of_compensated_samples_lack_most_of_the_terms() {
        assert_eq!(Compensation::of(ImuAveraging::ConingCorrected, 1, false).uncompensated, 0.0);
        assert_eq!(Compensation::of(ImuAveraging::ConingCorrected, 10, false).uncompensated, 0.99);
        assert_eq!(Compensation::of(ImuAveraging::ConingCorrected, 1, true).uncompensated, 1.0);
        assert_eq!(Compensation::of(ImuAveraging::BodyMean, 1, false).uncompensated, 1.0);
    }
}
