/// The drift between the clocks is extrapolated for at most so long, s: a longer gap is a clock that was set, or a
/// pause in which it may have been, and a rate known to 20 ppm would be off by 1.7 s after a day.
const EXTRAPOLATED_S: f64 = 60.0;

/// How the IMU's clock stands against the lidar's: `u = tau + l(tau)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    /// How much later the IMU stamps the instant `at_s`, s.
    pub(super) offset_s: f64,
    /// How fast that grows, s/s.
    pub(super) rate: f64,
    /// The instant of `offset_s`, lidar time, s.
    pub(super) at_s: f64,
}

impl Clock {
    /// How much later the IMU stamps the instant `tau_s` of lidar time.
    pub(super) fn offset_at(&self, tau_s: f64) -> f64 {
        self.offset_s + self.rate * (tau_s - self.at_s)
    }

    /// What the IMU's clock says at `tau_s` of lidar time.
    pub(super) fn imu_s(&self, tau_s: f64) -> f64 {
        tau_s + self.offset_at(tau_s)
    }

    /// The same clock after a gap from `from_s` to `to_s`.
    pub(super) fn after_gap(&self, (from_s, to_s): (f64, f64)) -> Self {
        let drifted_s = (to_s - from_s).min(EXTRAPOLATED_S);
        Self { offset_s: self.offset_at(from_s + drifted_s), rate: self.rate, at_s: to_s }
    }

    /// The same clock, told from another instant.
    pub(super) fn with_reference_at(&self, at_s: f64) -> Self {
        Self { offset_s: self.offset_at(at_s), rate: self.rate, at_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_a_day_the_offset_has_drifted_for_a_minute_and_after_a_second_for_a_second() {
        let clock = Clock { offset_s: 0.003, rate: 1e-4, at_s: 10.0 };
        let day = clock.after_gap((15.0, 86_415.0));
        assert!((day.offset_at(86_415.0) - (0.0035 + 1e-4 * EXTRAPOLATED_S)).abs() < 1e-12, "{day:?}");
        let second = clock.after_gap((15.0, 16.0));
        assert!((second.offset_at(16.0) - clock.offset_at(16.0)).abs() < 1e-12, "{second:?}");
    }
}
