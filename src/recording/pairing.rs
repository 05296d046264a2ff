//! Samples of an IMU whose angular velocities and accelerations come in separate messages.

use crate::geometry::Vector;
use crate::measurement::ImuSample;
use crate::time::{Span, Stamp};
use std::collections::VecDeque;

/// Most messages of a kind that wait for the other kind.
const MOST_WAITING: usize = 20_000;

/// Pairs each angular velocity with the nearest acceleration.
#[derive(Debug, Default)]
pub(super) struct Pairing {
    rates: VecDeque<(Stamp, Vector)>,
    forces: VecDeque<(Stamp, Vector)>,
}

impl Pairing {
    /// Takes an angular velocity, rad/s.
    pub fn put_rate(&mut self, stamp: Stamp, rate: Vector) {
        put(&mut self.rates, stamp, rate);
    }

    /// Takes an acceleration, m/s^2.
    pub fn put_force(&mut self, stamp: Stamp, force: Vector) {
        put(&mut self.forces, stamp, force);
    }

    /// The next pair whose stamps are at most `apart`; what has no partner is left out. At the end, with `last`, no
    /// later acceleration is waited for.
    pub fn take(&mut self, apart: Span, last: bool) -> Option<ImuSample> {
        while let Some((stamp, rate)) = self.rates.front().copied() {
            let later = self.forces.partition_point(|(force, _)| *force < stamp);
            let waits = later == self.forces.len() && self.rates.len() < MOST_WAITING;
            if waits && !last {
                return None;
            }
            self.rates.pop_front();
            let around = [later.checked_sub(1), Some(later)].into_iter().flatten();
            let distance = |force: &Stamp| (*force - stamp).nanos().unsigned_abs();
            let nearest = around.filter_map(|k| self.forces.get(k).copied()).min_by_key(|(force, _)| distance(force));
            // The one before may be the nearest of the next angular velocity too.
            self.forces.drain(..later.saturating_sub(1));
            if let Some((_, force)) = nearest.filter(|(force, _)| distance(force) <= apart.nanos().unsigned_abs()) {
                return Some(ImuSample { stamp, angular_velocity_rad_per_s: rate, specific_force_m_per_s2: force });
            }
        }
        None
    }
}

/// Puts a message in the order of stamps; the oldest goes where too many wait.
fn put(queue: &mut VecDeque<(Stamp, Vector)>, stamp: Stamp, value: Vector) {
    let at = queue.iter().rposition(|(before, _)| *before <= stamp).map_or(0, |k| k + 1);
    queue.insert(at, (stamp, value));
    if queue.len() > MOST_WAITING {
        queue.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_acceleration_within_half_a_period_is_taken() {
        let at = |ms: i64| Stamp::from_nanos(ms * 1_000_000);
        let mut pairing = Pairing::default();
        // Angular velocities at 200 Hz, accelerations at 100 Hz, 1 ms later, but for those of 50 to 100 ms.
        let mut pairs = Vec::new();
        for ms in 0..200 {
            if ms % 5 == 0 {
                pairing.put_rate(at(ms), Vector::new(ms as f64, 0.0, 0.0));
            }
            if ms % 10 == 1 && !(50..100).contains(&ms) {
                pairing.put_force(at(ms), Vector::new(0.0, ms as f64, 0.0));
            }
            pairs.extend(std::iter::from_fn(|| pairing.take(Span::from_nanos(5_000_000), false)));
        }
        pairs.extend(std::iter::from_fn(|| pairing.take(Span::from_nanos(5_000_000), true)));
        let of = |sample: &ImuSample| (sample.angular_velocity_rad_per_s.x, sample.specific_force_m_per_s2.y);
        let found: Vec<_> = pairs.iter().map(of).collect();
        assert_eq!(found[..5], [(0.0, 1.0), (5.0, 1.0), (10.0, 11.0), (15.0, 11.0), (20.0, 21.0)]);
        assert!(found.iter().all(|(rate, force)| (rate - force).abs() <= 5.0));
        // Without partners: 50 to 95 ms, where the nearest are 9 ms and more apart, or 6 ms; 40 in all.
        assert_eq!(found.len(), 40 - 10);
        assert!(pairs.iter().all(|sample| !(50..96).contains(&(sample.stamp.nanos() / 1_000_000))));
    }
}
