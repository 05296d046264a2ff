//! Smoothing of a regular sensor's stamps.
//!
//! A sensor that samples at a steady rate but is stamped with jitter (by a host, over a bus) says more about its times by
//! counting than by any single stamp. A Kalman filter over (time of the last sample, period) follows the count: with jitter
//! `s` and a rate that wanders slowly, the smoothed stamps are good to a few hundredths of `s` within a minute.

/// Wander of a sensor's rate, relative, per square root of a second: 0.2 ppm, a quartz in a room.
const RATE_WALK_PER_SQRT_S: f64 = 2e-7;
/// So many stamps in a row far from the count mean that the count is wrong.
const STRIKES: usize = 5;

/// Follows the stamps of a regular sensor. Seconds on the sensor's own clock.
#[derive(Debug, Clone)]
pub(super) struct StampFilter {
    last_s: f64,
    period_s: f64,
    covariance: [f64; 3],
    jitter2: f64,
    strikes: usize,
    started: bool,
    off: bool,
}

impl StampFilter {
    /// A filter for a sensor of about `period_s`; `jitter_s = 0` passes every stamp as it is.
    pub(super) fn new(period_s: f64, jitter_s: f64) -> Self {
        Self {
            last_s: 0.0,
            period_s,
            covariance: [jitter_s * jitter_s, 0.0, (0.01 * period_s).powi(2)],
            jitter2: jitter_s * jitter_s,
            strikes: 0,
            started: false,
            off: jitter_s <= 0.0,
        }
    }

    /// The sensor's period as far as known, s.
    pub(super) fn period_s(&self) -> f64 {
        self.period_s
    }

    /// When the next sample, stamped `raw_s`, was really taken.
    pub(super) fn smooth(&mut self, raw_s: f64) -> f64 {
        if self.off || !self.started {
            self.started = true;
            self.last_s = raw_s;
            return raw_s;
        }
        let since = raw_s - self.last_s;
        // One period unless the stamp is far off: a late stamp must not be taken for a lost sample.
        let tolerance = (0.5 * self.period_s).max(4.0 * self.jitter2.sqrt());
        let periods =
            if (since - self.period_s).abs() < tolerance { 1.0 } else { (since / self.period_s).round().max(0.0) };
        self.predict(periods);
        let innovation = raw_s - self.last_s;
        if innovation.abs() > tolerance {
            self.strikes += 1;
            if self.strikes >= STRIKES || innovation.abs() > 20.0 * tolerance {
                self.strikes = 0;
                self.last_s = raw_s;
                self.covariance[0] = self.jitter2;
                self.covariance[1] = 0.0;
            }
            return self.last_s;
        }
        self.strikes = 0;
        self.correct(innovation);
        self.last_s
    }

    fn predict(&mut self, periods: f64) {
        let [xx, xp, pp] = self.covariance;
        self.last_s += periods * self.period_s;
        let walk = (RATE_WALK_PER_SQRT_S * self.period_s).powi(2) * periods * self.period_s;
        self.covariance = [xx + 2.0 * periods * xp + periods * periods * pp, xp + periods * pp, pp + walk];
    }

    fn correct(&mut self, innovation: f64) {
        // The jitter is measured as it comes; never believed below 10 us.
        self.jitter2 += 0.01 * (innovation * innovation - self.jitter2);
        let [xx, xp, pp] = self.covariance;
        let total = xx + self.jitter2.max(1e-10);
        let (gain_x, gain_p) = (xx / total, xp / total);
        self.last_s += gain_x * innovation;
        self.period_s += gain_p * innovation;
        self.covariance = [xx * (1.0 - gain_x), xp * (1.0 - gain_x), pp - gain_p * xp];
    }
}

/// The period of a regular sensor from its first stamps, in order: the median interval gives each stamp its count, a line
/// through stamps over counts the period. `None` for fewer than three stamps, or for stamps that do not advance.
pub(super) fn period_of(stamps_s: &[f64]) -> Option<f64> {
    let first = *stamps_s.first()?;
    let mut intervals: Vec<f64> = stamps_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|dt| *dt > 0.0).collect();
    if intervals.len() < 2 {
        return None;
    }
    intervals.sort_by(f64::total_cmp);
    let median = intervals[intervals.len() / 2];
    let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut count, mut before) = (0.0, first);
    for stamp in stamps_s {
        count += ((stamp - before) / median).round().max(if n > 0.0 { 1.0 } else { 0.0 });
        before = *stamp;
        let y = stamp - first;
        (n, sx, sy, sxx, sxy) = (n + 1.0, sx + count, sy + y, sxx + count * count, sxy + count * y);
    }
    let determinant = n * sxx - sx * sx;
    let slope = (n * sxy - sx * sy) / determinant;
    (determinant > 0.0 && slope > 0.0).then_some(slope)
}
