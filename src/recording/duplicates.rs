//! Removes duplicate messages: merged bags, and drivers that publish a scan twice.

use zsim_base::measurement::{ImuSample, LidarScan, Measurement};
use zsim_base::time::Stamp;

/// Minimum number of returns of a scan for equality to be significant.
const MIN_RETURNS: usize = 100;

/// IMU signals above which the head moves, so that two equal scans are duplicates, rad/s and m/s^2.
const MIN_MOTION_RAD_PER_S: f64 = 0.1;
const MIN_MOTION_M_PER_S2: f64 = 0.5;

/// Detects duplicates in measurements that are sorted by stamp.
#[derive(Debug, Default)]
pub(super) struct DuplicateFilter {
    sample: Option<ImuSample>,
    scan: Option<Fingerprint>,
    /// First sample after the scan.
    at_scan: Option<ImuSample>,
    has_moved: bool,
    /// Number of duplicate scans.
    pub scans: u64,
    /// Number of duplicate samples.
    pub samples: u64,
}

/// Identity of a scan.
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

impl DuplicateFilter {
    /// Whether a measurement is not a duplicate.
    ///
    /// A scan is a duplicate if its stamp equals the previous scan's, or if its points do and the IMU moved in between:
    /// at rest and without noise, distinct scans may have equal points.
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
        self.has_moved |=
            sample.angular_velocity_rad_per_s.norm() > MIN_MOTION_RAD_PER_S || change > MIN_MOTION_M_PER_S2;
        self.sample = Some(*sample);
        true
    }

    fn is_new_scan(&mut self, scan: Fingerprint) -> bool {
        let is_duplicate = self.scan.is_some_and(|before| {
            let same_points = before.returns == scan.returns && before.checksum == scan.checksum;
            before.header == scan.header || (same_points && scan.returns >= MIN_RETURNS && self.has_moved)
        });
        if is_duplicate {
            self.scans += 1;
            return false;
        }
        (self.scan, self.at_scan, self.has_moved) = (Some(scan), None, false);
        true
    }
}
