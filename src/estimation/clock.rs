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

    /// The same clock, told from another instant.
    pub(super) fn told_from(&self, at_s: f64) -> Self {
        Self { offset_s: self.offset_at(at_s), rate: self.rate, at_s }
    }
}
