//! Screens IMU samples before integration: outliers, frozen readings, clipped axes.

use super::clipping::{Clipped, RangeLimits};
use zsim_base::geometry::Vector;
use zsim_base::measurement::{ImuNoise, ImuSample};

/// Length of the later data that the screening of a sample uses, s. The intake queues at least as much.
pub(crate) const LOOKAHEAD_S: f64 = 0.1;
/// Larger readings are implausible on a moving head, rad/s and m/s^2.
const IMPLAUSIBLE: (f64, f64) = (100.0, 5000.0);
/// Outlier gate of the gyroscope, rad/s.
const OUTLIER_GYRO: OutlierGate = OutlierGate { floor: 0.6, factor: 4.0 };
/// Outlier gate of the accelerometer, m/s^2.
const OUTLIER_ACCEL: OutlierGate = OutlierGate { floor: 30.0, factor: 6.0 };
/// All six readings unchanged for this time, s, and this number of samples: the sensor is frozen. The noise of a
/// working sensor changes even rounded readings.
const FROZEN: (f64, usize) = (0.08, 4);

/// Gate on the deviation of a sample from both neighbours.
#[derive(Debug, Clone, Copy)]
struct OutlierGate {
    /// Deviation that is always accepted.
    floor: f64,
    /// Accepted deviation in addition, as a multiple of the difference of the neighbours.
    factor: f64,
}

impl OutlierGate {
    /// The largest accepted deviation, if the neighbours differ by `usual`.
    fn limit(self, usual: f64) -> f64 {
        self.floor + self.factor * usual
    }
}

/// Result of screening a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Screened {
    /// A measurement, with the clipped axes.
    Measured(Clipped),
    /// Far from both neighbours, implausibly large, or not finite.
    Outlier {
        /// Whether a mechanical shock can have caused the reading: a specific force within the sensor's range.
        /// Otherwise it is a corrupt message, and the motion between the neighbours was smooth.
        may_be_shock: bool,
    },
    /// A repetition of the previous reading.
    Frozen,
}

/// Screens samples in order of time.
#[derive(Debug)]
pub(crate) struct Screen {
    limits: RangeLimits,
    /// The two previous measurements, the later one first.
    before: [Option<ImuSample>; 2],
    /// The last sample of any kind, and the time since which the reading has not changed, s.
    reading: Option<(ImuSample, f64)>,
}

fn is_implausible(sample: &ImuSample) -> bool {
    let exceeds = |v: &Vector, limit: f64| !v.iter().all(|x| x.abs() <= limit);
    exceeds(&sample.angular_velocity_rad_per_s, IMPLAUSIBLE.0)
        || exceeds(&sample.specific_force_m_per_s2, IMPLAUSIBLE.1)
}

fn is_same_reading(a: &ImuSample, b: &ImuSample) -> bool {
    a.angular_velocity_rad_per_s == b.angular_velocity_rad_per_s
        && a.specific_force_m_per_s2 == b.specific_force_m_per_s2
}

impl Screen {
    pub(crate) fn new(noise: &ImuNoise) -> Self {
        Self { limits: RangeLimits::new(noise), before: [None; 2], reading: None }
    }

    /// Screens the sample stamped `seconds`. `ahead` has the later samples in order; those within [`LOOKAHEAD_S`] are
    /// used.
    pub(crate) fn screen<'a>(
        &mut self,
        seconds: f64,
        sample: &ImuSample,
        ahead: impl Iterator<Item = &'a (f64, ImuSample)> + Clone,
    ) -> Screened {
        let ahead = ahead.take_while(|(s, _)| *s <= seconds + LOOKAHEAD_S);
        if is_implausible(sample) {
            return Screened::Outlier { may_be_shock: false };
        }
        if self.is_frozen(seconds, sample, ahead.clone()) {
            return Screened::Frozen;
        }
        let usable = ahead.map(|(_, next)| next).filter(|next| !is_implausible(next));
        if let Some(outlier) = self.outlier(sample, usable.clone()) {
            return outlier;
        }
        let clipped = self.limits.clipped(sample, usable);
        self.before = [Some(*sample), self.before[0]];
        Screened::Measured(clipped)
    }

    fn is_frozen<'a>(
        &mut self,
        seconds: f64,
        sample: &ImuSample,
        ahead: impl Iterator<Item = &'a (f64, ImuSample)>,
    ) -> bool {
        let unchanged = self.reading.as_ref().filter(|(last, _)| is_same_reading(last, sample));
        let Some((_, since_s)) = unchanged.copied() else {
            self.reading = Some((*sample, seconds));
            return false;
        };
        let mut repeated = (seconds, 2);
        for (s, _) in ahead.take_while(|(_, next)| is_same_reading(next, sample)) {
            repeated = (*s, repeated.1 + 1);
        }
        // Once a reading counts as frozen, all later repetitions do too.
        let lasts_s = repeated.0 - since_s;
        lasts_s >= FROZEN.0 && (repeated.1 >= FROZEN.1 || seconds - since_s >= FROZEN.0)
    }

    /// The verdict on a sample that differs from the previous measurement and from the median of the next three by much
    /// more than these differ from each other.
    fn outlier<'a>(&self, sample: &ImuSample, ahead: impl Iterator<Item = &'a ImuSample>) -> Option<Screened> {
        let next: Vec<&ImuSample> = ahead.take(3).collect();
        let exceeds = |of: fn(&ImuSample) -> Vector, gate: OutlierGate| match &self.before[0] {
            Some(before) => self.exceeds_neighbours(of, gate, sample, before, &next),
            None => exceeds_successors(of, gate, sample, &next),
        };
        let force = exceeds(|s| s.specific_force_m_per_s2, OUTLIER_ACCEL);
        let rate = exceeds(|s| s.angular_velocity_rad_per_s, OUTLIER_GYRO);
        // A shock changes the velocity within a sample, not the rotational velocity and back.
        let may_be_shock = !rate && self.limits.is_in_accel_range(&sample.specific_force_m_per_s2);
        (force || rate).then_some(Screened::Outlier { may_be_shock })
    }

    fn exceeds_neighbours(
        &self,
        of: fn(&ImuSample) -> Vector,
        gate: OutlierGate,
        sample: &ImuSample,
        before: &ImuSample,
        next: &[&ImuSample],
    ) -> bool {
        let (x, last) = (of(sample), of(before));
        let Some(median) = median(next, of) else { return false };
        let mut usual = (median - last).norm();
        if let Some(earlier) = &self.before[1] {
            usual = usual.max((of(earlier) - last).norm());
        }
        (x - last).norm().min((x - median).norm()) > gate.limit(usual)
    }
}

/// The same for the first sample: only later neighbours exist, and they must agree with each other.
fn exceeds_successors(
    of: fn(&ImuSample) -> Vector,
    gate: OutlierGate,
    sample: &ImuSample,
    next: &[&ImuSample],
) -> bool {
    let Some(median) = median(next, of).filter(|_| next.len() == 3) else { return false };
    let usual = next.iter().map(|other| (of(other) - median).norm()).fold(0.0, f64::max);
    (of(sample) - median).norm() > gate.limit(usual)
}

/// The median of each axis.
fn median(samples: &[&ImuSample], of: fn(&ImuSample) -> Vector) -> Option<Vector> {
    let middle = samples.len().checked_sub(1)? / 2;
    Some(Vector::from_fn(|axis, _| {
        let mut values: Vec<f64> = samples.iter().map(|sample| of(sample)[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        values[middle]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Stamp;

    /// Ten seconds of a head that swings with 5 rad/s at 1.2 Hz, with noise from a linear congruential generator.
    fn samples() -> Vec<(f64, ImuSample)> {
        let mut state = 1_u64;
        let mut noise = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.02
        };
        (0..1000)
            .map(|k| {
                let t = f64::from(k) * 0.01;
                let (sin, cos) = (7.5 * t).sin_cos();
                let gyro = Vector::new(5.0 * cos + noise(), noise(), 0.5 * sin + noise());
                let accel = Vector::new(4.0 * sin + noise(), noise(), 9.8 + cos + noise());
                let stamp = Stamp::from_nanos(k as i64 * 10_000_000);
                (t, ImuSample { stamp, angular_velocity_rad_per_s: gyro, specific_force_m_per_s2: accel })
            })
            .collect()
    }

    fn noise() -> ImuNoise {
        ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 5e-4,
            accel_density_m_per_s2_per_sqrt_hz: 8e-4,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 0.0,
            accel_bias_walk_m_per_s2_per_sqrt_s: 0.0,
            gyro_turn_on_bias_rad_per_s: 0.0,
            accel_turn_on_bias_m_per_s2: 0.0,
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: f64::INFINITY,
            accel_limit_m_per_s2: f64::INFINITY,
        }
    }

    fn screened(samples: &[(f64, ImuSample)]) -> Vec<Screened> {
        let mut screen = Screen::new(&noise());
        (0..samples.len()).map(|k| screen.screen(samples[k].0, &samples[k].1, samples[k + 1..].iter())).collect()
    }

    fn is_outlier(one: &Screened) -> bool {
        matches!(one, Screened::Outlier { .. })
    }

    fn indices(screened: &[Screened], of: impl Fn(&Screened) -> bool) -> Vec<usize> {
        screened.iter().enumerate().filter(|(_, one)| of(one)).map(|(k, _)| k).collect()
    }

    #[test]
    fn a_swinging_head_has_neither_outliers_nor_frozen_nor_clipped_samples() {
        let all = screened(&samples());
        assert!(all.iter().all(|one| *one == Screened::Measured(Clipped::NONE)));
    }

    #[test]
    fn a_single_sample_far_from_all_neighbours_is_an_outlier_at_any_position() {
        for at in [0, 1, 500, 998, 999] {
            for (gyro, accel) in [(10.0, 0.0), (0.0, 1e4), (1e30, 0.0), (f64::NAN, 0.0), (0.0, f64::INFINITY)] {
                let mut samples = samples();
                samples[at].1.angular_velocity_rad_per_s.y += gyro;
                samples[at].1.specific_force_m_per_s2.x += accel;
                let outliers = indices(&screened(&samples), is_outlier);
                // The last sample has no successor: only an implausible value is detected.
                let expected = if at == 999 && gyro == 10.0 { vec![] } else { vec![at] };
                assert_eq!(outliers, expected, "{at}: {gyro}, {accel}");
            }
        }
    }

    #[test]
    fn only_a_specific_force_within_the_range_may_be_a_shock() {
        let limited = ImuNoise { accel_limit_m_per_s2: 49.0, ..noise() };
        for (gyro, accel, expected) in [(0.0, 40.0, true), (10.0, 40.0, false), (10.0, 0.0, false), (0.0, 60.0, false)]
        {
            let mut samples = samples();
            samples[500].1.angular_velocity_rad_per_s.y += gyro;
            samples[500].1.specific_force_m_per_s2.y += accel;
            let mut screen = Screen::new(&limited);
            let screened = (0..=500).map(|k| screen.screen(samples[k].0, &samples[k].1, samples[k + 1..].iter()));
            assert_eq!(
                screened.last(),
                Some(Screened::Outlier { may_be_shock: expected }),
                "{gyro} rad/s, {accel} m/s^2"
            );
        }
    }

    #[test]
    fn a_shock_of_several_samples_is_no_outlier() {
        let mut samples = samples();
        for (k, push) in [(500, 20.0), (501, 60.0), (502, 55.0), (503, 25.0)] {
            samples[k].1.specific_force_m_per_s2.z += push;
        }
        assert!(indices(&screened(&samples), is_outlier).is_empty());
    }

    #[test]
    fn a_reading_that_is_repeated_is_frozen_from_its_first_repetition() {
        let mut samples = samples();
        let reading = samples[500].1;
        samples[501..600].iter_mut().for_each(|(_, sample)| *sample = ImuSample { stamp: sample.stamp, ..reading });
        let frozen = indices(&screened(&samples), |one| *one == Screened::Frozen);
        assert_eq!(frozen, (501..600).collect::<Vec<_>>());
        let mut twice = self::samples();
        twice[501].1 = ImuSample { stamp: twice[501].1.stamp, ..twice[500].1 };
        assert!(
            indices(&screened(&twice), |one| *one == Screened::Frozen).is_empty(),
            "two equal readings may be a coincidence"
        );
    }

    #[test]
    fn a_recurring_flat_top_is_clipping_from_the_first_sample_and_next_to_it() {
        let mut clipped = samples();
        let limit = 250.0_f64.to_radians();
        for (_, sample) in &mut clipped {
            sample.angular_velocity_rad_per_s = sample.angular_velocity_rad_per_s.map(|x| x.clamp(-limit, limit));
        }
        let is_at_limit = |k: usize| clipped[k].1.angular_velocity_rad_per_s.x.abs() >= limit;
        assert!((0..1000).filter(|k| is_at_limit(*k)).count() > 100);
        // The signal is smooth: a neighbour reads more than half of the limit.
        let expected: Vec<usize> =
            (0..1000_usize).filter(|k| (k.saturating_sub(1)..=(k + 1).min(999)).any(is_at_limit)).collect();
        let found = indices(&screened(&clipped), |one| matches!(one, Screened::Measured(c) if c.gyro[0]));
        assert_eq!(found, expected);
    }
}
