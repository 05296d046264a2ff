//! Messages that come twice: bags that were merged, drivers that publish a scan again.

use crate::measurement::{ImuSample, LidarScan, Measurement};
use crate::time::Stamp;

/// Fewest returns whose equality is no chance.
const FEWEST_RETURNS: usize = 100;

/// Beyond these the IMU moves, and a scan that is the one before is no new one: rad/s and m/s^2.
const MOVING_RAD_PER_S: f64 = 0.1;
const MOVING_M_PER_S2: f64 = 0.5;

/// Recognises what came before, in measurements that are in the order of their stamps.
#[derive(Debug, Default)]
pub(super) struct Repeats {
    sample: Option<ImuSample>,
    scan: Option<Fingerprint>,
    /// The first sample after the scan.
    at_scan: Option<ImuSample>,
    has_moved: bool,
    /// Scans that came before.
    pub scans: u64,
    /// Samples that came before.
    pub samples: u64,
}

/// What a scan is recognised by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fingerprint {
    header: Stamp,
    returns: usize,
    checksum: u32,
}

impl Fingerprint {
    fn of(scan: &LidarScan) -> Self {
        let mut hasher = crc32fast::Hasher::new();
        for point in &scan.returns {
            let p = &point.point_in_laser;
            [p.x, p.y, p.z].iter().for_each(|c| hasher.update(&c.to_le_bytes()));
            hasher.update(&point.offset.nanos().to_le_bytes());
        }
        let header = scan.stamp + scan.stamped_after;
        Self { header, returns: scan.returns.len(), checksum: hasher.finalize() }
    }
}

impl Repeats {
    /// Whether a measurement is new. A scan is not when its stamp is that of the one before, or its points are and the
    /// IMU moved meanwhile: at rest, and without noise, scans may be equal.
    pub fn is_new(&mut self, measurement: &Measurement) -> bool {
        match measurement {
            Measurement::Imu(sample) => self.is_new_sample(sample),
            Measurement::Lidar(scan) => self.is_new_scan(Fingerprint::of(scan)),
        }
    }

    fn is_new_sample(&mut self, sample: &ImuSample) -> bool {
        if self.sample.as_ref() == Some(sample) {
            self.samples += 1;
            return false;
        }
        let first = *self.at_scan.get_or_insert(*sample);
        let change = (sample.specific_force_m_per_s2 - first.specific_force_m_per_s2).norm();
        self.has_moved |= sample.angular_velocity_rad_per_s.norm() > MOVING_RAD_PER_S || change > MOVING_M_PER_S2;
        self.sample = Some(*sample);
        true
    }

    fn is_new_scan(&mut self, scan: Fingerprint) -> bool {
        let is_repeated = self.scan.is_some_and(|before| {
            let same_points = before.returns == scan.returns && before.checksum == scan.checksum;
            before.header == scan.header || (same_points && scan.returns >= FEWEST_RETURNS && self.has_moved)
        });
        if is_repeated {
            self.scans += 1;
            return false;
        }
        (self.scan, self.at_scan, self.has_moved) = (Some(scan), None, false);
        true
    }
}
