//! Measurements of two sensors in the order of their stamps, whenever they were logged.

use crate::measurement::Measurement;
use crate::time::Stamp;
use std::collections::VecDeque;

/// Disorder among the messages of a sensor that is put right, s.
const DISORDER_S: f64 = 0.5;
/// While one sensor goes on so long, the other is waited for, s: drivers log late, one more than the other.
const PATIENCE_S: f64 = 30.0;

/// What was read and waits for its turn: a few hundred milliseconds, unless one sensor is logged late.
#[derive(Debug, Default)]
pub(super) struct InOrder {
    imu: VecDeque<Measurement>,
    lidar: VecDeque<Measurement>,
}

impl InOrder {
    pub(super) fn put(&mut self, measurement: Measurement) {
        let queue = if matches!(measurement, Measurement::Imu(_)) { &mut self.imu } else { &mut self.lidar };
        let at = queue.iter().rposition(|before| stamp(before) <= stamp(&measurement)).map_or(0, |k| k + 1);
        queue.insert(at, measurement);
    }

    /// The next in order, if nothing earlier can be expected; with `last`, if there is one.
    pub(super) fn take(&mut self, last: bool) -> Option<Measurement> {
        let waiting = [span_s(&self.imu), span_s(&self.lidar)];
        let is_settled = waiting.iter().all(|s| *s >= DISORDER_S) || waiting.iter().any(|s| *s >= PATIENCE_S);
        if !is_settled && !last {
            return None;
        }
        let first = |queue: &VecDeque<Measurement>| queue.front().map(stamp);
        match (first(&self.imu), first(&self.lidar)) {
            (Some(imu), Some(lidar)) if lidar < imu => self.lidar.pop_front(),
            (Some(_), _) => self.imu.pop_front(),
            (None, _) => self.lidar.pop_front(),
        }
    }
}

fn stamp(measurement: &Measurement) -> Stamp {
    match measurement {
        Measurement::Imu(sample) => sample.stamp,
        Measurement::Lidar(scan) => scan.stamp,
    }
}

/// From the first to the last, s.
fn span_s(queue: &VecDeque<Measurement>) -> f64 {
    queue.back().zip(queue.front()).map_or(0.0, |(last, first)| stamp(last).seconds_since(stamp(first)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;
    use crate::measurement::{ImuSample, LidarScan};
    use crate::time::Span;

    fn at(ms: i64) -> Stamp {
        Stamp::from_nanos(ms * 1_000_000)
    }

    fn sample(ms: i64) -> Measurement {
        let still = Vector::zeros();
        let sample = ImuSample { stamp: at(ms), angular_velocity_rad_per_s: still, specific_force_m_per_s2: still };
        Measurement::Imu(sample)
    }

    fn scan(ms: i64) -> Measurement {
        Measurement::Lidar(LidarScan { stamp: at(ms), stamped_after: Span::ZERO, returns: Vec::new(), planar: None })
    }

    /// What comes out of what comes in, and the most that waited.
    fn ordered(coming: impl IntoIterator<Item = Measurement>) -> (Vec<Stamp>, usize) {
        let (mut order, mut out, mut most) = (InOrder::default(), Vec::new(), 0);
        for measurement in coming {
            order.put(measurement);
            most = most.max(order.imu.len() + order.lidar.len());
            out.extend(std::iter::from_fn(|| order.take(false)).map(|m| stamp(&m)));
        }
        out.extend(std::iter::from_fn(|| order.take(true)).map(|m| stamp(&m)));
        (out, most)
    }

    #[test]
    fn a_lidar_that_is_logged_3_s_late_comes_in_its_turn() {
        // 100 Hz and 40 Hz over 20 s, by when they were logged.
        let mut coming: Vec<(i64, Measurement)> = (0..2000).map(|k| (10 * k, sample(10 * k))).collect();
        coming.extend((0..800).map(|k| (25 * k + 3000, scan(25 * k))));
        coming.sort_by_key(|(logged, _)| *logged);
        let (out, most) = ordered(coming.into_iter().map(|(_, measurement)| measurement));
        assert_eq!(out.len(), 2800);
        assert!(out.is_sorted());
        assert!(most < 600, "{most} waited at once");
    }

    #[test]
    fn disorder_within_a_sensor_is_put_right() {
        let shuffled = |k: i64| 10 * (k / 30 * 30 + (k % 30) * 7 % 30);
        let samples = (0..900).map(|k| sample(shuffled(k)));
        let scans = (0..360).map(|k| scan(25 * k));
        let (out, _) = ordered(scans.chain(samples));
        assert_eq!(out.len(), 1260);
        assert!(out.is_sorted());
    }

    #[test]
    fn a_sensor_that_fell_silent_is_not_waited_for_for_ever() {
        let samples = (0..60_000).map(|k| sample(10 * k));
        let (out, most) = ordered([scan(0)].into_iter().chain(samples));
        assert_eq!(out.len(), 60_001);
        assert!(most < 3100, "{most} waited at once");
    }
}
