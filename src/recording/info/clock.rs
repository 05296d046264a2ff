//! Incremental line fit of one clock to another.

use serde::Serialize;
use zsim_base::time::Stamp;

/// Minimum number of messages for a fit: two parameters and one residual.
const MIN_MESSAGES: u64 = 3;

/// Fit of stamps to log times: `stamp - log = offset + drift (log - first log) + jitter`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClockStatistics {
    /// Offset at the first message, s; positive if stamps are ahead.
    pub offset_s: f64,
    /// Drift, parts per million; positive if the clock of the stamps is fast.
    pub drift_ppm: f64,
    /// Standard deviation of the residuals, s.
    pub jitter_s: f64,
}

/// Means and co-moments of log time and of stamp minus log time, updated incrementally (Welford 1962).
#[derive(Debug, Clone)]
pub struct ClockFit {
    log_0: Stamp,
    ahead_0_ns: i64,
    count: u64,
    mean_log_s: f64,
    mean_ahead_s: f64,
    log_log: f64,
    log_ahead: f64,
    ahead_ahead: f64,
}

impl ClockFit {
    /// Starts a fit relative to a first pair, so that the numbers remain small.
    pub fn starting(log: Stamp, stamp: Stamp) -> Self {
        Self {
            log_0: log,
            ahead_0_ns: (stamp - log).nanos(),
            count: 0,
            mean_log_s: 0.0,
            mean_ahead_s: 0.0,
            log_log: 0.0,
            log_ahead: 0.0,
            ahead_ahead: 0.0,
        }
    }

    /// Adds a pair.
    pub fn add(&mut self, log: Stamp, stamp: Stamp) {
        let x = log.seconds_since(self.log_0);
        let y = (stamp - log).nanos().saturating_sub(self.ahead_0_ns) as f64 * 1e-9;
        self.count += 1;
        let n = self.count as f64;
        let (dx, dy) = (x - self.mean_log_s, y - self.mean_ahead_s);
        self.mean_log_s += dx / n;
        self.mean_ahead_s += dy / n;
        self.log_log += dx * (x - self.mean_log_s);
        self.log_ahead += dx * (y - self.mean_ahead_s);
        self.ahead_ahead += dy * (y - self.mean_ahead_s);
    }

    /// Fitted line; `None` with fewer than three pairs, or if all have one log time.
    pub fn statistics(&self) -> Option<ClockStatistics> {
        if self.count < MIN_MESSAGES || self.log_log <= 0.0 {
            return None;
        }
        let drift = self.log_ahead / self.log_log;
        let residual = (self.ahead_ahead - drift * self.log_ahead).max(0.0) / (self.count - 2) as f64;
        Some(ClockStatistics {
            offset_s: self.ahead_0_ns as f64 * 1e-9 + self.mean_ahead_s - drift * self.mean_log_s,
            drift_ppm: drift * 1e6,
            jitter_s: residual.sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_fit_recovers_a_known_clock() {
        // 3 ms ahead, 17 ppm fast, alternately 100 us early and late: sigma 100 us.
        let pair = |k: i64| {
            let log = Stamp::from_nanos(1_349_049_600_000_000_000 + k * 25_000_000);
            let t_ns = (k * 25_000_000) as f64;
            let jitter = if k % 2 == 0 { 100_000 } else { -100_000 };
            (log, Stamp::from_nanos(log.nanos() + 3_000_000 + (t_ns * 17e-6).round() as i64 + jitter))
        };
        let (log, stamp) = pair(0);
        let mut fit = ClockFit::starting(log, stamp);
        (0..4000).map(pair).for_each(|(log, stamp)| fit.add(log, stamp));
        let found = fit.statistics().unwrap();
        assert_relative_eq!(found.offset_s, 3e-3, epsilon = 1e-6);
        assert_relative_eq!(found.drift_ppm, 17.0, epsilon = 0.01);
        assert_relative_eq!(found.jitter_s, 1e-4, epsilon = 1e-6);
    }
}
