//! What an IMU topic carries, by its first samples: acceleration, angular velocity or both, in which unit, and with
//! gravity or without.

use crate::measurement::ImuSample;
use crate::recording::message::imu::ForceUnit;

/// Fewest samples that show what a topic carries.
const FEWEST: usize = 20;

/// A part that so many of a topic's messages lack is not carried.
const HARDLY_EVER: f64 = 0.05;

/// Shortest time that shows the absence of gravity, s: a free fall of this length is 490 m.
const NO_FALL_S: f64 = 10.0;

/// Time over which specific force is averaged, s.
const WINDOW_S: f64 = 1.0;

/// Norms of what is certainly in m/s^2, and of what may be in units of gravity.
const SURELY_M_PER_S2: f64 = 4.0;
const ONE_G: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// What the messages of an IMU topic carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Acceleration and angular velocity in each.
    Both,
    /// Angular velocity in each, and zeros for acceleration.
    RateOnly,
    /// Acceleration in each, and zeros for angular velocity.
    ForceOnly,
    /// Acceleration in some, angular velocity in others.
    Alternating,
    /// Neither.
    Neither,
}

impl Content {
    /// What `samples` show.
    pub fn of(samples: &[ImuSample]) -> Self {
        if samples.len() < FEWEST {
            return Self::Both;
        }
        let has_force = |sample: &&ImuSample| sample.specific_force_m_per_s2.iter().any(|x| *x != 0.0);
        let has_rate = |sample: &&ImuSample| sample.angular_velocity_rad_per_s.iter().any(|x| *x != 0.0);
        let share = |count: usize| count as f64 / samples.len() as f64;
        let force = share(samples.iter().filter(has_force).count());
        let rate = share(samples.iter().filter(has_rate).count());
        let both = share(samples.iter().filter(|s| has_force(s) && has_rate(s)).count());
        match (force < HARDLY_EVER, rate < HARDLY_EVER) {
            (true, true) => Self::Neither,
            (true, false) => Self::RateOnly,
            // Without noise and at rest, angular velocity is zero and specific force does not change.
            (false, true) if is_constant(samples) => Self::Both,
            (false, true) => Self::ForceOnly,
            (false, false) if both < HARDLY_EVER => Self::Alternating,
            (false, false) => Self::Both,
        }
    }
}

fn is_constant(samples: &[ImuSample]) -> bool {
    samples.windows(2).all(|pair| pair[0].specific_force_m_per_s2 == pair[1].specific_force_m_per_s2)
}

/// The value below which a `share` of `values` is.
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let at = (share * values.len().saturating_sub(1) as f64).round() as usize;
    values.get(at).copied().unwrap_or_default()
}

/// The unit of the specific forces of `samples`; `None` where gravity is not in them.
///
/// With gravity the average over a second is nearly as long as a single sample, and never short: in m/s^2 about 9.8, in
/// units of gravity about 1. Without, it is the change of velocity in a second. Samples of less than 10 s may be of a
/// fall, and show no absence of gravity.
pub fn unit_of_force(samples: &[ImuSample]) -> Option<ForceUnit> {
    let norms: Vec<f64> = samples.iter().map(|sample| sample.specific_force_m_per_s2.norm()).collect();
    let median = quantile(norms.clone(), 0.5);
    let if_in_g = if ONE_G.contains(&median) { ForceUnit::StandardGravity } else { ForceUnit::default() };
    let lasts_s = samples.first().zip(samples.last()).map_or(0.0, |(a, b)| b.stamp.seconds_since(a.stamp));
    if median >= SURELY_M_PER_S2 || lasts_s < NO_FALL_S {
        return Some(if_in_g);
    }
    let averages = averages(samples);
    let of_averages = |share: f64| quantile(averages.clone(), share);
    let is_steady = of_averages(0.1) >= 0.5 * of_averages(0.5) && of_averages(0.5) >= 0.5 * median;
    // A fast turn averages gravity out, but leaves its norm.
    let has_one_norm = quantile(norms, 0.1) >= 0.7 * median;
    ((is_steady || has_one_norm) && median >= *ONE_G.start()).then_some(if_in_g)
}

/// Norms of the averages of specific force over each second.
fn averages(samples: &[ImuSample]) -> Vec<f64> {
    let (mut averages, mut rest) = (Vec::new(), samples);
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|s| (0.0..WINDOW_S).contains(&s.stamp.seconds_since(first.stamp))).count();
        let (window, later) = rest.split_at(count.max(1));
        let sum: crate::geometry::Vector = window.iter().map(|sample| sample.specific_force_m_per_s2).sum();
        averages.push((sum / window.len() as f64).norm());
        rest = later;
    }
    averages
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;
    use crate::time::Stamp;

    /// 12 s at 100 Hz, by the time in s.
    fn samples(force: impl Fn(f64) -> Vector, rate: impl Fn(f64) -> Vector) -> Vec<ImuSample> {
        let sample = |k: i64| ImuSample {
            stamp: Stamp::from_nanos(k * 10_000_000),
            specific_force_m_per_s2: force(k as f64 * 0.01),
            angular_velocity_rad_per_s: rate(k as f64 * 0.01),
        };
        (0..1200).map(sample).collect()
    }

    /// Swinging by hand: 1.5 m/s^2 about 1.3 Hz and 0.7 Hz.
    fn shaken(t: f64) -> Vector {
        Vector::new(1.5 * (8.2 * t).sin(), 1.2 * (4.4 * t).cos(), 0.8 * (6.1 * t + 1.0).sin())
    }

    fn unit(force: impl Fn(f64) -> Vector) -> Option<ForceUnit> {
        unit_of_force(&samples(force, |_| Vector::zeros()))
    }

    #[test]
    fn gravity_is_missed_and_its_unit_found() {
        let gravity = Vector::new(0.0, 0.0, 9.8);
        assert_eq!(unit(|t| shaken(t) + gravity), Some(ForceUnit::MetresPerSecondSquared));
        assert_eq!(unit(|t| (shaken(t) + gravity) / 9.8), Some(ForceUnit::StandardGravity));
        // About 1.5 m/s^2 in the median, so that its norm does not tell it from units of gravity.
        assert_eq!(unit(shaken), None);
        // At rest without gravity: noise.
        assert_eq!(unit(|t| shaken(t * 777.0) * 0.01), None);
        // A car that brakes and speeds up for seconds.
        assert_eq!(unit(|t| Vector::new(2.5 * (1.0 * t).sin(), 0.1, 0.05)), None);
        // Turned twice a second about a level axis, in units of gravity.
        let turned = |t: f64| Vector::new((12.6 * t).sin(), 0.0, (12.6 * t).cos());
        assert_eq!(unit(turned), Some(ForceUnit::StandardGravity));
        // A fall of 3 s.
        let fall = samples(|t| shaken(t) * 0.01, |_| Vector::zeros());
        assert!(unit_of_force(&fall[..300]).is_some());
    }

    #[test]
    fn zeros_are_not_taken_for_measurements() {
        let (zero, some) = (Vector::zeros(), Vector::new(0.1, 0.0, 0.0));
        assert_eq!(Content::of(&samples(shaken, |_| some)), Content::Both);
        assert_eq!(Content::of(&samples(shaken, |_| zero)), Content::ForceOnly);
        assert_eq!(Content::of(&samples(|_| zero, |_| some)), Content::RateOnly);
        assert_eq!(Content::of(&samples(|_| zero, |_| zero)), Content::Neither);
        assert_eq!(Content::of(&samples(|_| some, |_| zero)), Content::Both);
        let odd = |t: f64| (t * 100.0).round() as i64 % 2 == 1;
        let alternating = samples(|t| if odd(t) { some } else { zero }, |t| if odd(t) { zero } else { some });
        assert_eq!(Content::of(&alternating), Content::Alternating);
    }
}
