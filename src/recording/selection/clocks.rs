//! Whether lidar and IMU are stamped by clocks of different epochs, by when their messages were logged.

use super::content::quantile;
use crate::time::{Span, Stamp};

/// Shifts below this are left to the estimator, which finds them better, s.
const LEAST_S: f64 = 0.05;

/// Shifts above this are of another epoch, and hold whatever the log times' jitter is, s.
const EPOCH_S: f64 = 3600.0;

/// Greatest spread of log time minus stamp by which a shift within an hour is believed, s.
const STEADY_S: f64 = 0.05;

/// Fewest messages of each sensor.
const FEWEST: usize = 5;

/// When a sensor's messages were logged, and what their headers are stamped.
#[derive(Debug, Clone, Default)]
pub struct Logged {
    /// Log time and stamp of each.
    pub times: Vec<(Stamp, Stamp)>,
}

/// Log time minus stamp.
struct Lag {
    median_s: f64,
    spread_s: f64,
}

impl Logged {
    /// The lag; `None` where log times say nothing: all the same, or copies of the stamps.
    fn lag(&self) -> Option<Lag> {
        let (first, _) = *self.times.first()?;
        let copied = self.times.iter().all(|(log, stamp)| log == stamp);
        if self.times.len() < FEWEST || copied || self.times.iter().all(|(log, _)| *log == first) {
            return None;
        }
        let lags: Vec<f64> = self.times.iter().map(|(log, stamp)| log.seconds_since(*stamp)).collect();
        let at = |share: f64| quantile(lags.clone(), share);
        Some(Lag { median_s: at(0.5), spread_s: at(0.95) - at(0.05) })
    }
}

/// What is to be added to the stamps of `imu` to bring them to the clock of `lidar`, whose scans last `scan_s`: scans
/// are logged when they are complete. `None` where it is too small, or log times do not show it.
pub fn shift(imu: &Logged, lidar: &Logged, scan_s: f64) -> Option<Span> {
    let (of_imu, of_lidar) = (imu.lag()?, lidar.lag()?);
    let shift_s = of_imu.median_s - (of_lidar.median_s - scan_s);
    if !shift_s.is_finite() || shift_s.abs() < LEAST_S {
        return None;
    }
    if shift_s.abs() > EPOCH_S {
        return Some(Span::from_seconds(shift_s));
    }
    let is_steady = of_imu.spread_s < STEADY_S && of_lidar.spread_s < STEADY_S;
    (is_steady && !is_delay(imu, lidar, shift_s)).then(|| Span::from_seconds(shift_s))
}

/// Whether one sensor was logged later and later stamped by the same clock: then both begin with one stamp, and only
/// their log times differ.
fn is_delay(imu: &Logged, lidar: &Logged, shift_s: f64) -> bool {
    let (Some((imu_log, imu_stamp)), Some((lidar_log, lidar_stamp))) = (imu.times.first(), lidar.times.first()) else {
        return false;
    };
    let (logs_s, stamps_s) = (lidar_log.seconds_since(*imu_log), lidar_stamp.seconds_since(*imu_stamp));
    stamps_s.abs() < 0.3 * shift_s.abs() && (logs_s + shift_s).abs() < 0.3 * shift_s.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages `period_ms` apart, logged from `first_ms` on, with such a lag that jitters by `jitter_ms`.
    fn logged(first_ms: i64, period_ms: i64, lag_ms: i64, jitter_ms: i64) -> Logged {
        let at = |ms: i64| Stamp::from_nanos(1_700_000_000_000_000_000 + ms * 1_000_000);
        let time = |k: i64| {
            let log = first_ms + k * period_ms;
            (at(log), at(log - lag_ms - (k * 7919 % 11) * jitter_ms / 10))
        };
        Logged { times: (0..200).map(time).collect() }
    }

    fn shift_s(imu: &Logged, lidar: &Logged) -> Option<f64> {
        shift(imu, lidar, 0.1).map(Span::seconds)
    }

    #[test]
    fn a_shift_is_found_where_log_times_show_it() {
        let lidar = logged(100, 100, 105, 5);
        // Clocks that agree, and those 30 ms off.
        assert_eq!(shift_s(&logged(0, 10, 2, 3), &lidar), None);
        assert_eq!(shift_s(&logged(0, 10, 30, 3), &lidar), None);
        for lag_ms in [400, -700, 37_000, 3_000_000] {
            let found = shift_s(&logged(0, 10, lag_ms, 3), &lidar).unwrap();
            assert!((found - lag_ms as f64 * 1e-3).abs() < 0.02, "{lag_ms}: {found}");
        }
        // Log times that jitter by more show an epoch, and nothing finer.
        assert_eq!(shift_s(&logged(0, 10, 400, 200), &lidar), None);
        let epoch = shift_s(&logged(0, 10, 1_600_000_000_000, 200), &lidar).unwrap();
        assert!((epoch - 1.6e9).abs() < 0.2);
    }

    #[test]
    fn log_times_that_say_nothing_shift_nothing() {
        let lidar = logged(100, 100, 105, 5);
        assert_eq!(shift_s(&logged(0, 10, 0, 0), &lidar), None);
        let constant = Logged { times: (0..50).map(|k| (Stamp::from_nanos(7), Stamp::from_nanos(k << 40))).collect() };
        assert_eq!(shift_s(&constant, &lidar), None);
        // Stamped by one clock, and logged 3 s late.
        assert_eq!(shift_s(&logged(0, 10, 2, 3), &logged(3100, 100, 3105, 5)), None);
    }
}
