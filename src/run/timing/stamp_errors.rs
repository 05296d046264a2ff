//! Timing errors, added to the stamps of a recording before estimation.

use super::Disturbance;
use crate::true_clock::TrueClock;
use rand_distr::{Distribution, StandardNormal};
use zsim_base::measurement::Measurement;
use zsim_base::random::Seed;
use zsim_base::time::{Span, Stamp};
use zsim_recording::RecordingError;

/// Stamps with timing errors, as the estimator receives them.
#[derive(Debug, Clone)]
pub(super) struct DisturbedStamps<'a> {
    /// True offset of the clocks, which is removed.
    clock: &'a TrueClock,
    /// Latency that is added to the IMU's stamps, s.
    latency_s: f64,
    /// Stamps of the lidar's scans with noise, in order of arrival.
    scan_stamps: Vec<Stamp>,
}

impl<'a> DisturbedStamps<'a> {
    /// Applies `disturbance` to otherwise synchronised clocks.
    ///
    /// Noise does not change the order of scans, as a driver publishes them with increasing stamps: scan `k` gets the
    /// `k`-th smallest noisy stamp, as in [`Stamper`](zsim_sensors::Stamper). The same random numbers, scaled, are used
    /// for every standard deviation.
    pub(super) fn new(disturbance: Disturbance, clock: &'a TrueClock, scan_stamps: &[Stamp], seed: Seed) -> Self {
        let mut draws = seed.stream("latency/noise");
        let noise_s = disturbance.noise_ms * 1e-3;
        let noisy = |stamp: &Stamp| {
            let z: f64 = StandardNormal.sample(&mut draws);
            *stamp + Span::from_seconds(noise_s * z)
        };
        let mut scan_stamps: Vec<Stamp> = scan_stamps.iter().map(noisy).collect();
        scan_stamps.sort();
        Self { clock, latency_s: disturbance.latency_ms * 1e-3, scan_stamps }
    }

    /// Stamps of the scans, in order of arrival.
    pub(super) fn scan_stamps(&self) -> &[Stamp] {
        &self.scan_stamps
    }

    /// Replaces the stamps of measurements.
    pub(super) fn apply(
        &self,
        measurements: impl Iterator<Item = Result<Measurement, RecordingError>>,
    ) -> impl Iterator<Item = Result<Measurement, RecordingError>> {
        let mut scans = self.scan_stamps.iter();
        measurements.map(move |measurement| {
            Ok(match measurement? {
                Measurement::Imu(mut sample) => {
                    sample.stamp = self.clock.on_lidar_clock(sample.stamp) + Span::from_seconds(self.latency_s);
                    Measurement::Imu(sample)
                }
                Measurement::Lidar(mut scan) => {
                    scan.stamp = scans.next().copied().unwrap_or(scan.stamp);
                    Measurement::Lidar(scan)
                }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;
    use zsim_base::measurement::{ImuSample, LidarScan};

    fn at(us: i64) -> Stamp {
        Stamp::from_nanos(us * 1000)
    }

    fn imu(us: i64) -> Measurement {
        let zero = Vector::zeros();
        Measurement::Imu(ImuSample { stamp: at(us), angular_velocity_rad_per_s: zero, specific_force_m_per_s2: zero })
    }

    fn stamps(timing: &DisturbedStamps<'_>, measurements: Vec<Measurement>) -> Vec<Stamp> {
        let stamp = |m: Result<Measurement, RecordingError>| match m.unwrap() {
            Measurement::Imu(sample) => sample.stamp,
            Measurement::Lidar(scan) => scan.stamp,
        };
        timing.apply(measurements.into_iter().map(Ok)).map(stamp).collect()
    }

    #[test]
    fn a_latency_replaces_the_true_clock_offset() {
        // The IMU's clock is ahead by 3 ms at 0 s and by 5 ms at 2 s: a sample at lidar time 1 s has the stamp 1.004 s.
        let clock = TrueClock::from_offsets(vec![(at(0), 3e-3), (at(2_000_000), 5e-3)]);
        let latency = Disturbance { latency_ms: -2.0, noise_ms: 0.0 };
        let timing = DisturbedStamps::new(latency, &clock, &[at(1_000_000)], Seed(1));
        let scan = Measurement::Lidar(LidarScan {
            stamp: at(1_000_000),
            stamped_after: Span::ZERO,
            returns: Vec::new(),
            planar: None,
        });
        let disturbed = stamps(&timing, vec![imu(1_004_000), scan]);
        // The offset is evaluated at the stamp 1.004 s, where it is 4 us larger: 4 ms + 4 us are removed.
        assert!((disturbed[0] - at(998_000)).seconds().abs() < 5e-6, "{:?}", disturbed[0]);
        assert_eq!(disturbed[1], at(1_000_000));
    }

    #[test]
    fn noise_has_the_given_standard_deviation_and_preserves_the_order() {
        let scans: Vec<Stamp> = (0..10_000).map(|k| at(k * 25_000)).collect();
        let clock = TrueClock::default();
        let noise = |noise_ms| {
            DisturbedStamps::new(Disturbance { latency_ms: 0.0, noise_ms }, &clock, &scans, Seed(1)).scan_stamps
        };
        let errors: Vec<f64> = noise(2.0).iter().zip(&scans).map(|(a, b)| a.seconds_since(*b)).collect();
        let sigma = (errors.iter().map(|e| e * e).sum::<f64>() / 1e4).sqrt();
        // The standard error of a standard deviation is 2 ms / sqrt(2 n). With 2 ms of noise and a period of 25 ms,
        // the order of two stamps changes with a probability below 1e-6.
        assert!((sigma - 2e-3).abs() < 4.0 * 2e-3 / 141.0, "{sigma}");
        assert!(noise(10.0).windows(2).all(|pair| pair[0] <= pair[1]));
        assert_eq!(noise(0.0), scans);
    }
}
