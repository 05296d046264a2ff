//! Errors of timing, put on a recording's stamps on their way to the estimator.

use super::Disturbance;
use crate::measurement::Measurement;
use crate::random::Seed;
use crate::recording::RecordingError;
use crate::study::true_clock::TrueClock;
use crate::time::{Span, Stamp};
use rand_distr::{Distribution, StandardNormal};

/// The stamps that the estimator is to see.
#[derive(Debug, Clone)]
pub(super) struct Timing<'a> {
    /// The clocks' true offset, which is taken away.
    clock: &'a TrueClock,
    /// Put on the IMU's stamps instead.
    latency_s: f64,
    /// The stamps of the lidar's scans, in the order in which they come.
    scan_stamps: Vec<Stamp>,
}

impl<'a> Timing<'a> {
    /// A disturbance of clocks that run alike but for it.
    ///
    /// Noise changes stamps, never the order of scans: a driver passes them on as they were taken, with stamps that
    /// increase. So scan `k` gets the `k`-th smallest of the noisy stamps, as [`Stamper`](crate::sensors::Stamper) has
    /// it. One draw of numbers, scaled, serves every standard deviation.
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

    /// The stamps of the scans, in the order in which they come.
    pub(super) fn scan_stamps(&self) -> &[Stamp] {
        &self.scan_stamps
    }

    /// The measurements with these stamps.
    pub(super) fn put_on(
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
    use crate::geometry::Vector;
    use crate::measurement::{ImuSample, LidarScan};

    fn at(us: i64) -> Stamp {
        Stamp::from_nanos(us * 1000)
    }

    fn imu(us: i64) -> Measurement {
        let zero = Vector::zeros();
        Measurement::Imu(ImuSample { stamp: at(us), angular_velocity_rad_per_s: zero, specific_force_m_per_s2: zero })
    }

    fn stamps(timing: &Timing<'_>, measurements: Vec<Measurement>) -> Vec<Stamp> {
        let stamp = |m: Result<Measurement, RecordingError>| match m.unwrap() {
            Measurement::Imu(sample) => sample.stamp,
            Measurement::Lidar(scan) => scan.stamp,
        };
        timing.put_on(measurements.into_iter().map(Ok)).map(stamp).collect()
    }

    #[test]
    fn a_latency_stands_in_place_of_the_clocks_own_offset() {
        // The IMU's clock is 3 ms ahead at 0 and 5 ms at 2 s: a sample at 1 s of the lidar's clock is stamped 1.004 s.
        let clock = TrueClock::from_offsets(vec![(at(0), 3e-3), (at(2_000_000), 5e-3)]);
        let latency = Disturbance { latency_ms: -2.0, noise_ms: 0.0 };
        let timing = Timing::new(latency, &clock, &[at(1_000_000)], Seed(1));
        let scan = Measurement::Lidar(LidarScan {
            stamp: at(1_000_000),
            stamped_after: Span::ZERO,
            returns: Vec::new(),
            planar: None,
        });
        let seen = stamps(&timing, vec![imu(1_004_000), scan]);
        // 1.004 s is 4 us of drift late for the offset: 4 ms + 4 us are taken away.
        assert!((seen[0] - at(998_000)).seconds().abs() < 5e-6, "{:?}", seen[0]);
        assert_eq!(seen[1], at(1_000_000));
    }

    #[test]
    fn noise_has_its_standard_deviation_and_keeps_the_order() {
        let scans: Vec<Stamp> = (0..10_000).map(|k| at(k * 25_000)).collect();
        let clock = TrueClock::default();
        let noise =
            |noise_ms| Timing::new(Disturbance { latency_ms: 0.0, noise_ms }, &clock, &scans, Seed(1)).scan_stamps;
        let errors: Vec<f64> = noise(2.0).iter().zip(&scans).map(|(a, b)| a.seconds_since(*b)).collect();
        let sigma = (errors.iter().map(|e| e * e).sum::<f64>() / 1e4).sqrt();
        // Standard error of a standard deviation: 2 ms / sqrt(2 n); exchanges are rarer than one in a million at 2 of
        // 25 ms.
        assert!((sigma - 2e-3).abs() < 4.0 * 2e-3 / 141.0, "{sigma}");
        assert!(noise(10.0).windows(2).all(|pair| pair[0] <= pair[1]));
        assert_eq!(noise(0.0), scans);
    }
}
