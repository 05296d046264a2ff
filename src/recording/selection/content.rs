//! Detects the content of an IMU topic from the first samples.
//!
//! The content is acceleration, angular velocity or both, the unit of acceleration, and whether gravity is included.

use crate::message::imu::ForceUnit;
use crate::quantile::quantile;
use zsim_base::measurement::{ImuSample, ONE_G_RANGE};

/// Minimum number of samples for a decision.
const MIN_SAMPLES: usize = 20;

/// A quantity is absent if less than this fraction of the messages has it.
const MIN_FRACTION: f64 = 0.05;

/// Minimum duration that proves the absence of gravity, s: a free fall of 10 s would be 490 m.
const MIN_DURATION_S: f64 = 10.0;

/// Averaging time of the specific force, s.
const AVERAGING_S: f64 = 1.0;

/// Median norm above which the unit is certainly m/s^2.
const MIN_CERTAIN_M_PER_S2: f64 = 4.0;

/// Quantities that the messages of an IMU topic contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Acceleration and angular velocity in each message.
    Both,
    /// Angular velocity only; acceleration is zero.
    RateOnly,
    /// Acceleration only; angular velocity is zero.
    ForceOnly,
    /// Acceleration in some messages, angular velocity in others.
    Alternating,
    /// Neither of them.
    Neither,
}

impl Content {
    /// Detects the content from `samples`.
    pub fn detect(samples: &[ImuSample]) -> Self {
        if samples.len() < MIN_SAMPLES {
            return Self::Both;
        }
        let has_force = |sample: &&ImuSample| sample.specific_force_m_per_s2.iter().any(|x| *x != 0.0);
        let has_rate = |sample: &&ImuSample| sample.angular_velocity_rad_per_s.iter().any(|x| *x != 0.0);
        let fraction = |count: usize| count as f64 / samples.len() as f64;
        let force = fraction(samples.iter().filter(has_force).count());
        let rate = fraction(samples.iter().filter(has_rate).count());
        let both = fraction(samples.iter().filter(|s| has_force(s) && has_rate(s)).count());
        match (force < MIN_FRACTION, rate < MIN_FRACTION) {
            (true, true) => Self::Neither,
            (true, false) => Self::RateOnly,
            // A noise-free sensor at rest has zero angular velocity and constant specific force.
            (false, true) if is_constant(samples) => Self::Both,
            (false, true) => Self::ForceOnly,
            (false, false) if both < MIN_FRACTION => Self::Alternating,
            (false, false) => Self::Both,
        }
    }
}

fn is_constant(samples: &[ImuSample]) -> bool {
    samples.windows(2).all(|pair| pair[0].specific_force_m_per_s2 == pair[1].specific_force_m_per_s2)
}

/// Detects the unit of specific force; `None` if gravity is not included.
///
/// With gravity, the average over a second has nearly the norm of a single sample and is never small: about 9.8 in
/// m/s^2, about 1 in g. Without gravity it is the change of velocity in a second. Samples of less than 10 s may be a
/// free fall and do not prove the absence of gravity.
pub fn detect_unit(samples: &[ImuSample]) -> Option<ForceUnit> {
    let norms: Vec<f64> = samples.iter().map(|sample| sample.specific_force_m_per_s2.norm()).collect();
    let median = quantile(norms.clone(), 0.5);
    let unit_by_norm = if ONE_G_RANGE.contains(&median) { ForceUnit::StandardGravity } else { ForceUnit::default() };
    let duration_s = samples.first().zip(samples.last()).map_or(0.0, |(a, b)| b.stamp.seconds_since(a.stamp));
    if median >= MIN_CERTAIN_M_PER_S2 || duration_s < MIN_DURATION_S {
        return Some(unit_by_norm);
    }
    let second_averages = second_averages(samples);
    let average_quantile = |fraction: f64| quantile(second_averages.clone(), fraction);
    let is_steady = average_quantile(0.1) >= 0.5 * average_quantile(0.5) && average_quantile(0.5) >= 0.5 * median;
    // Fast rotation averages gravity out but preserves the norm of single samples.
    let has_one_norm = quantile(norms, 0.1) >= 0.7 * median;
    ((is_steady || has_one_norm) && median >= *ONE_G_RANGE.start()).then_some(unit_by_norm)
}

/// Norm of the average specific force of each second.
fn second_averages(samples: &[ImuSample]) -> Vec<f64> {
    let (mut second_averages, mut rest) = (Vec::new(), samples);
    while let Some(first) = rest.first() {
        let count =
            rest.iter().take_while(|s| (0.0..AVERAGING_S).contains(&s.stamp.seconds_since(first.stamp))).count();
        let (window, later) = rest.split_at(count.max(1));
        let sum: zsim_base::geometry::Vector = window.iter().map(|sample| sample.specific_force_m_per_s2).sum();
        second_averages.push((sum / window.len() as f64).norm());
        rest = later;
    }
    second_averages
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;
    use zsim_base::time::Stamp;

    /// 12 s at 100 Hz; the arguments are functions of the time in s.
    fn samples(force: impl Fn(f64) -> Vector, rate: impl Fn(f64) -> Vector) -> Vec<ImuSample> {
        let sample = |k: i64| ImuSample {
            stamp: Stamp::from_nanos(k * 10_000_000),
            specific_force_m_per_s2: force(k as f64 * 0.01),
            angular_velocity_rad_per_s: rate(k as f64 * 0.01),
        };
        (0..1200).map(sample).collect()
    }

    /// Motion of a hand-held sensor: 1.5 m/s^2 at about 1.3 Hz and 0.7 Hz.
    fn shaken(t: f64) -> Vector {
        Vector::new(1.5 * (8.2 * t).sin(), 1.2 * (4.4 * t).cos(), 0.8 * (6.1 * t + 1.0).sin())
    }

    fn unit(force: impl Fn(f64) -> Vector) -> Option<ForceUnit> {
        detect_unit(&samples(force, |_| Vector::zeros()))
    }

    #[test]
    fn missing_gravity_and_the_unit_are_detected() {
        let gravity = Vector::new(0.0, 0.0, 9.8);
        assert_eq!(unit(|t| shaken(t) + gravity), Some(ForceUnit::MetresPerSecondSquared));
        assert_eq!(unit(|t| (shaken(t) + gravity) / 9.8), Some(ForceUnit::StandardGravity));
        // The median is about 1.5 m/s^2, so the norm alone could also be in g.
        assert_eq!(unit(shaken), None);
        // At rest without gravity: noise.
        assert_eq!(unit(|t| shaken(t * 777.0) * 0.01), None);
        // A car that brakes and accelerates for seconds.
        assert_eq!(unit(|t| Vector::new(2.5 * (1.0 * t).sin(), 0.1, 0.05)), None);
        // Two revolutions per second about a horizontal axis, in g.
        let turned = |t: f64| Vector::new((12.6 * t).sin(), 0.0, (12.6 * t).cos());
        assert_eq!(unit(turned), Some(ForceUnit::StandardGravity));
        // A free fall of 3 s.
        let fall = samples(|t| shaken(t) * 0.01, |_| Vector::zeros());
        assert!(detect_unit(&fall[..300]).is_some());
    }

    #[test]
    fn zeros_are_not_measurements() {
        let (zero, some) = (Vector::zeros(), Vector::new(0.1, 0.0, 0.0));
        assert_eq!(Content::detect(&samples(shaken, |_| some)), Content::Both);
        assert_eq!(Content::detect(&samples(shaken, |_| zero)), Content::ForceOnly);
        assert_eq!(Content::detect(&samples(|_| zero, |_| some)), Content::RateOnly);
        assert_eq!(Content::detect(&samples(|_| zero, |_| zero)), Content::Neither);
        assert_eq!(Content::detect(&samples(|_| some, |_| zero)), Content::Both);
        let odd = |t: f64| (t * 100.0).round() as i64 % 2 == 1;
        let alternating = samples(|t| if odd(t) { some } else { zero }, |t| if odd(t) { zero } else { some });
        assert_eq!(Content::detect(&alternating), Content::Alternating);
    }
}
