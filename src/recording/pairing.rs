//! Combines angular velocities and accelerations from separate messages into IMU samples.

use std::collections::VecDeque;
use zsim_base::geometry::Vector;
use zsim_base::measurement::ImuSample;
use zsim_base::time::{Span, Stamp};

/// Maximum number of queued messages of each kind: bounds the memory if the other kind stops.
const MAX_QUEUE: usize = 20_000;

/// Pairs each angular velocity with the nearest acceleration.
#[derive(Debug, Default)]
pub(super) struct ImuPairing {
    rates: VecDeque<(Stamp, Vector)>,
    forces: VecDeque<(Stamp, Vector)>,
}

impl ImuPairing {
    /// Adds an angular velocity, rad/s.
    pub fn put_rate(&mut self, stamp: Stamp, rate: Vector) {
        put(&mut self.rates, stamp, rate);
    }

    /// Adds an acceleration, m/s^2.
    pub fn put_force(&mut self, stamp: Stamp, force: Vector) {
        put(&mut self.forces, stamp, force);
    }

    /// Returns the next pair whose stamps differ by at most `max_separation`.
    ///
    /// Unpaired messages are dropped. With `last`, at the end of the recording, no later acceleration is expected.
    pub fn take(&mut self, max_separation: Span, last: bool) -> Option<ImuSample> {
        while let Some((stamp, rate)) = self.rates.front().copied() {
            let later = self.forces.partition_point(|(force, _)| *force < stamp);
            let awaits_later = later == self.forces.len() && self.rates.len() < MAX_QUEUE;
            if awaits_later && !last {
                return None;
            }
            self.rates.pop_front();
            let around = [later.checked_sub(1), Some(later)].into_iter().flatten();
            let distance = |force: &Stamp| (*force - stamp).nanos().unsigned_abs();
            let nearest = around.filter_map(|k| self.forces.get(k).copied()).min_by_key(|(force, _)| distance(force));
            // The previous acceleration may also be the nearest one of the next angular velocity.
            self.forces.drain(..later.saturating_sub(1));
            if let Some((_, force)) =
                nearest.filter(|(force, _)| distance(force) <= max_separation.nanos().unsigned_abs())
            {
                return Some(ImuSample { stamp, angular_velocity_rad_per_s: rate, specific_force_m_per_s2: force });
            }
        }
        None
    }
}

/// Inserts a message in order of stamps; drops the oldest one if the queue is full.
fn put(queue: &mut VecDeque<(Stamp, Vector)>, stamp: Stamp, value: Vector) {
    let at = queue.iter().rposition(|(before, _)| *before <= stamp).map_or(0, |k| k + 1);
    queue.insert(at, (stamp, value));
    if queue.len() > MAX_QUEUE {
        queue.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rate_is_paired_with_the_nearest_acceleration_within_half_a_period() {
        let at = |ms: i64| Stamp::from_nanos(ms * 1_000_000);
        let mut pairing = ImuPairing::default();
        // Angular velocities at 200 Hz, accelerations at 100 Hz and 1 ms later, with a gap from 50 to 100 ms.
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
        let values = |sample: &ImuSample| (sample.angular_velocity_rad_per_s.x, sample.specific_force_m_per_s2.y);
        let found: Vec<_> = pairs.iter().map(values).collect();
        assert_eq!(found[..5], [(0.0, 1.0), (5.0, 1.0), (10.0, 11.0), (15.0, 11.0), (20.0, 21.0)]);
        assert!(found.iter().all(|(rate, force)| (rate - force).abs() <= 5.0));
        // No partner from 50 to 95 ms, where the nearest acceleration is more than 5 ms away; 40 angular velocities in
        // total.
        assert_eq!(found.len(), 40 - 10);
        assert!(pairs.iter().all(|sample| !(50..96).contains(&(sample.stamp.nanos() / 1_000_000))));
    }
}
