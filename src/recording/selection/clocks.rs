//! Detects different epochs of the lidar's and IMU's clocks from log times.

use crate::quantile::quantile;
use zsim_base::time::{Span, Stamp};

/// Smallest offset that is corrected here, s; the estimator determines smaller ones more accurately.
const MIN_OFFSET_S: f64 = 0.05;

/// Offsets above this are different epochs, s; they are significant for any jitter of the log times.
const EPOCH_S: f64 = 3600.0;

/// Maximum spread of log time minus stamp for which an offset below an hour is significant, s.
const MAX_SPREAD_S: f64 = 0.05;

/// Minimum number of messages of each sensor.
const MIN_MESSAGES: usize = 5;

/// Log times and header stamps of a sensor's messages.
#[derive(Debug, Clone, Default)]
pub struct LogTimes {
    /// Log time and stamp of each message.
    pub pairs: Vec<(Stamp, Stamp)>,
}

/// Delay: log time minus stamp.
struct Delay {
    median_s: f64,
    spread_s: f64,
}

impl LogTimes {
    /// Delay of the messages; `None` if log times carry no information: all equal, or copies of the stamps.
    fn delay(&self) -> Option<Delay> {
        let (first, _) = *self.pairs.first()?;
        let copied = self.pairs.iter().all(|(log, stamp)| log == stamp);
        if self.pairs.len() < MIN_MESSAGES || copied || self.pairs.iter().all(|(log, _)| *log == first) {
            return None;
        }
        let delays: Vec<f64> = self.pairs.iter().map(|(log, stamp)| log.seconds_since(*stamp)).collect();
        let at = |fraction: f64| quantile(delays.clone(), fraction);
        Some(Delay { median_s: at(0.5), spread_s: at(0.95) - at(0.05) })
    }
}

/// Offset to add to the stamps of `imu` to bring them to the clock of `lidar`.
///
/// Scans last `scan_s` and are logged when complete. `None` if the offset is too small, or log times do not show it.
pub fn find_offset(imu: &LogTimes, lidar: &LogTimes, scan_s: f64) -> Option<Span> {
    let (imu_delay, lidar_delay) = (imu.delay()?, lidar.delay()?);
    let offset_s = imu_delay.median_s - (lidar_delay.median_s - scan_s);
    if !offset_s.is_finite() || offset_s.abs() < MIN_OFFSET_S {
        return None;
    }
    if offset_s.abs() > EPOCH_S {
        return Some(Span::from_seconds(offset_s));
    }
    let is_steady = imu_delay.spread_s < MAX_SPREAD_S && lidar_delay.spread_s < MAX_SPREAD_S;
    (is_steady && !is_logging_delay(imu, lidar, offset_s)).then(|| Span::from_seconds(offset_s))
}

/// Whether the offset is a logging delay, not a clock offset: first stamps agree and only log times differ.
fn is_logging_delay(imu: &LogTimes, lidar: &LogTimes, offset_s: f64) -> bool {
    let (Some((imu_log, imu_stamp)), Some((lidar_log, lidar_stamp))) = (imu.pairs.first(), lidar.pairs.first()) else {
        return false;
    };
    let (logs_s, stamps_s) = (lidar_log.seconds_since(*imu_log), lidar_stamp.seconds_since(*imu_stamp));
    stamps_s.abs() < 0.3 * offset_s.abs() && (logs_s + offset_s).abs() < 0.3 * offset_s.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages every `period_ms` from `first_ms` on, with the delay `delay_ms` and a jitter of `jitter_ms`.
    fn logged(first_ms: i64, period_ms: i64, delay_ms: i64, jitter_ms: i64) -> LogTimes {
        let at = |ms: i64| Stamp::from_nanos(1_700_000_000_000_000_000 + ms * 1_000_000);
        let time = |k: i64| {
            let log = first_ms + k * period_ms;
            (at(log), at(log - delay_ms - (k * 7919 % 11) * jitter_ms / 10))
        };
        LogTimes { pairs: (0..200).map(time).collect() }
    }

    fn offset_s(imu: &LogTimes, lidar: &LogTimes) -> Option<f64> {
        find_offset(imu, lidar, 0.1).map(Span::seconds)
    }

    #[test]
    fn a_clock_offset_is_detected_from_log_times() {
        let lidar = logged(100, 100, 105, 5);
        // Clocks that agree, and clocks that differ by 30 ms.
        assert_eq!(offset_s(&logged(0, 10, 2, 3), &lidar), None);
        assert_eq!(offset_s(&logged(0, 10, 30, 3), &lidar), None);
        for delay_ms in [400, -700, 37_000, 3_000_000] {
            let found = offset_s(&logged(0, 10, delay_ms, 3), &lidar).unwrap();
            assert!((found - delay_ms as f64 * 1e-3).abs() < 0.02, "{delay_ms}: {found}");
        }
        // Log times with more jitter reveal different epochs only.
        assert_eq!(offset_s(&logged(0, 10, 400, 200), &lidar), None);
        let epoch = offset_s(&logged(0, 10, 1_600_000_000_000, 200), &lidar).unwrap();
        assert!((epoch - 1.6e9).abs() < 0.2);
    }

    #[test]
    fn uninformative_log_times_yield_no_offset() {
        let lidar = logged(100, 100, 105, 5);
        assert_eq!(offset_s(&logged(0, 10, 0, 0), &lidar), None);
        let constant =
            LogTimes { pairs: (0..50).map(|k| (Stamp::from_nanos(7), Stamp::from_nanos(k << 40))).collect() };
        assert_eq!(offset_s(&constant, &lidar), None);
        // One clock, logged 3 s late.
        assert_eq!(offset_s(&logged(0, 10, 2, 3), &logged(3100, 100, 3105, 5)), None);
    }
}
