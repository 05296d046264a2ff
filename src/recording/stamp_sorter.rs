//! Sorts the measurements of two sensors by stamp, independent of log times.

use std::collections::VecDeque;
use zsim_base::measurement::Measurement;
use zsim_base::time::Stamp;

/// Maximum disorder within one sensor that is corrected, s.
const MAX_DISORDER_S: f64 = 0.5;
/// Maximum waiting time for the other sensor, s: drivers log late, some more than others.
const MAX_WAIT_S: f64 = 30.0;

/// Queue of measurements not yet returned: a few hundred milliseconds, unless one sensor is logged late.
#[derive(Debug, Default)]
pub(super) struct StampSorter {
    imu: VecDeque<Measurement>,
    lidar: VecDeque<Measurement>,
}

impl StampSorter {
    pub(super) fn put(&mut self, measurement: Measurement) {
        let queue = if matches!(measurement, Measurement::Imu(_)) { &mut self.imu } else { &mut self.lidar };
        let at = queue.iter().rposition(|before| stamp(before) <= stamp(&measurement)).map_or(0, |k| k + 1);
        queue.insert(at, measurement);
    }

    /// Returns the next measurement if no earlier one can follow; with `last`, whenever there is one.
    pub(super) fn take(&mut self, last: bool) -> Option<Measurement> {
        let waiting = [span_s(&self.imu), span_s(&self.lidar)];
        let is_settled = waiting.iter().all(|s| *s >= MAX_DISORDER_S) || waiting.iter().any(|s| *s >= MAX_WAIT_S);
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

/// Time from the first to the last measurement, s.
fn span_s(queue: &VecDeque<Measurement>) -> f64 {
    queue.back().zip(queue.front()).map_or(0.0, |(last, first)| stamp(last).seconds_since(stamp(first)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;
    use zsim_base::measurement::{ImuSample, LidarScan};
    use zsim_base::time::Span;

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

    /// Stamps in the order of output, and the largest length of the queue.
    fn ordered(input: impl IntoIterator<Item = Measurement>) -> (Vec<Stamp>, usize) {
        let (mut sorter, mut out, mut most) = (StampSorter::default(), Vec::new(), 0);
        for measurement in input {
            sorter.put(measurement);
            most = most.max(sorter.imu.len() + sorter.lidar.len());
            out.extend(std::iter::from_fn(|| sorter.take(false)).map(|m| stamp(&m)));
        }
        out.extend(std::iter::from_fn(|| sorter.take(true)).map(|m| stamp(&m)));
        (out, most)
    }

    #[test]
    fn a_lidar_that_is_logged_3_s_late_is_sorted_in() {
        // 100 Hz and 40 Hz for 20 s, in order of log time.
        let mut input: Vec<(i64, Measurement)> = (0..2000).map(|k| (10 * k, sample(10 * k))).collect();
        input.extend((0..800).map(|k| (25 * k + 3000, scan(25 * k))));
        input.sort_by_key(|(logged, _)| *logged);
        let (out, most) = ordered(input.into_iter().map(|(_, measurement)| measurement));
        assert_eq!(out.len(), 2800);
        assert!(out.is_sorted());
        assert!(most < 600, "{most} in the queue");
    }

    #[test]
    fn disorder_within_a_sensor_is_corrected() {
        let shuffled = |k: i64| 10 * (k / 30 * 30 + (k % 30) * 7 % 30);
        let samples = (0..900).map(|k| sample(shuffled(k)));
        let scans = (0..360).map(|k| scan(25 * k));
        let (out, _) = ordered(scans.chain(samples));
        assert_eq!(out.len(), 1260);
        assert!(out.is_sorted());
    }

    #[test]
    fn a_sensor_that_stops_does_not_block_the_other() {
        let samples = (0..60_000).map(|k| sample(10 * k));
        let (out, most) = ordered([scan(0)].into_iter().chain(samples));
        assert_eq!(out.len(), 60_001);
        assert!(most < 3100, "{most} in the queue");
    }
}
