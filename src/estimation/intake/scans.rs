//! Lidar input: queues scans, discards frozen ones, and converts them to returns with smoothed times.

use crate::EstimationError;
use crate::scan_geometry::{ScanGeometry, is_in_plane};
use crate::spec::EstimatorSpec;
use crate::stamps::StampFilter;
use crate::surfel::TimedReturn;
use std::collections::VecDeque;
use zsim_base::geometry::Pose;
use zsim_base::measurement::{Calibration, LidarScan};
use zsim_base::signal::Regularity;

/// A scan that repeats the previous one for this many times is frozen: noise changes some range of a working lidar.
const FROZEN_REPEATS: usize = 2;
/// A scan of at least this many returns whose ranges agree to within this, m, is no valid measurement.
const CONSTANT_RANGES: (usize, f32) = (20, 1e-4);

/// Whether a scan repeats the previous ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    New,
    /// The scan equals the previous ones; valid only for a noiseless lidar at rest.
    Repeated,
}

/// Queue of scans, and the returns made of them.
#[derive(Debug)]
pub(super) struct ScanQueue {
    spec: EstimatorSpec,
    imu_from_laser: Pose,
    waiting: VecDeque<(f64, LidarScan, Content)>,
    /// Raw stamp of the last scan used; earlier ones are late.
    used_s: f64,
    pub(super) count: usize,
    /// Number of scans without a return, or with constant ranges.
    pub(super) empty: usize,
    pub(super) late: usize,
    /// Number of scans discarded as repeats.
    pub(super) frozen: usize,
    /// Number of repeats of the newest scan, and the fingerprint of it.
    repeated: (usize, u64),
    scan_geometry: ScanGeometry,
    /// Whether all points so far lie in the x-y plane of the lidar.
    planar: bool,
    filter: Option<StampFilter>,
    /// Returns with smoothed times that belong to later segments.
    returns: VecDeque<TimedReturn>,
}

impl ScanQueue {
    pub(super) fn new(spec: &EstimatorSpec, calibration: &Calibration) -> Self {
        Self {
            spec: spec.clone(),
            imu_from_laser: calibration.head_from_imu.inverse() * calibration.head_from_laser,
            waiting: VecDeque::new(),
            used_s: f64::NEG_INFINITY,
            count: 0,
            empty: 0,
            late: 0,
            frozen: 0,
            repeated: (0, 0),
            scan_geometry: ScanGeometry::default(),
            planar: true,
            filter: None,
            returns: VecDeque::new(),
        }
    }

    /// Inserts a scan in order of time; discards a late scan and one with constant ranges.
    pub(super) fn push(&mut self, seconds: f64, scan: LidarScan) -> Result<(), EstimationError> {
        let finite = |p: &nalgebra::Vector3<f32>| p.iter().copied().all(f32::is_finite);
        if !scan.returns.iter().all(|hit| finite(&hit.point_in_laser)) {
            return Err(EstimationError::NotFinite { sensor: "lidar", stamp_ns: scan.stamp.nanos() });
        }
        self.count += 1;
        self.empty += usize::from(scan.returns.is_empty() || is_constant(&scan));
        self.planar &= scan.returns.iter().all(|hit| is_in_plane(&hit.point_in_laser));
        if seconds <= self.used_s {
            self.late += 1;
        } else if is_constant(&scan) {
            self.frozen += 1;
        } else {
            let content = self.content(&scan);
            let at = self.waiting.partition_point(|(s, ..)| *s <= seconds);
            self.waiting.insert(at, (seconds, scan, content));
        }
        Ok(())
    }

    /// Compares a scan with the previous ones, point by point.
    fn content(&mut self, scan: &LidarScan) -> Content {
        let fingerprint = fingerprint(scan);
        let times = if fingerprint == self.repeated.1 && !scan.returns.is_empty() { self.repeated.0 + 1 } else { 0 };
        self.repeated = (times, fingerprint);
        if times >= FROZEN_REPEATS { Content::Repeated } else { Content::New }
    }

    /// First and last stamp in the queue, s.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        Some((self.waiting.front()?.0, self.waiting.back()?.0))
    }

    /// The newest queued stamp, s; minus infinity if the queue is empty.
    pub(super) fn newest_s(&self) -> f64 {
        self.waiting.back().map_or(f64::NEG_INFINITY, |(seconds, ..)| *seconds)
    }

    /// Stamp of the last scan that was used, s.
    pub(super) fn used_s(&self) -> f64 {
        self.used_s
    }

    /// Whether all scans so far lie in one plane of the lidar frame.
    pub(super) fn is_planar(&self) -> bool {
        self.planar
    }

    /// The scanning geometry of the lidar, according to the first scans.
    pub(super) fn scan_geometry(&self) -> ScanGeometry {
        self.scan_geometry
    }

    /// Estimates the scan period and the scanning geometry from the scans up to `enough_s`.
    pub(super) fn start(&mut self, first_scan: f64, enough_s: f64) -> Option<()> {
        let first_scans = || self.waiting.iter().filter(|(s, ..)| *s <= enough_s);
        let stamps: Vec<f64> = first_scans().map(|(s, scan, _)| s + scan.stamped_after.seconds()).collect();
        let scanning = Regularity::of(&stamps)?;
        self.scan_geometry =
            ScanGeometry::measure(first_scans().map(|(_, scan, _)| scan), enough_s - first_scan, scanning.period_s);
        self.filter = Some(StampFilter::new(scanning, self.spec.clock.jitter_s));
        Some(())
    }

    /// Removes and returns the returns before `end_s`, lidar time; discards repeated scans if the head moves.
    pub(super) fn take_until(&mut self, end_s: f64, moving: bool) -> Vec<TimedReturn> {
        self.convert_until(end_s, moving);
        let before = self.returns.iter().take_while(|one| one.tau_s < end_s).count();
        self.returns.drain(..before).collect()
    }

    fn convert_until(&mut self, end_s: f64, moving: bool) {
        let Some(filter) = self.filter.as_mut() else { return };
        let (least, most) = (self.spec.surfels.min_range_m, self.spec.surfels.max_range_m);
        while self.waiting.front().is_some_and(|(seconds, ..)| *seconds < end_s) {
            let Some((seconds, scan, content)) = self.waiting.pop_front() else { return };
            if moving && content == Content::Repeated {
                self.frozen += 1;
                continue;
            }
            self.used_s = seconds;
            let after_s = scan.stamped_after.seconds();
            let later_s = self.waiting.iter().map(|(later_s, scan, _)| later_s + scan.stamped_after.seconds());
            let start_s = filter.smooth(seconds + after_s, later_s) - after_s;
            for hit in &scan.returns {
                let point = hit.point_in_laser.cast::<f64>();
                let range = point.norm();
                if (least..=most).contains(&range) {
                    let in_imu = self.imu_from_laser.rotation * point + self.imu_from_laser.translation.vector;
                    let tau_s = start_s + hit.offset.seconds();
                    let (point_in_imu, range_m, weakness) = (in_imu.cast(), range as f32, weakness(hit.intensity));
                    self.returns.push_back(TimedReturn { tau_s, point_in_imu, range_m, weakness });
                }
            }
        }
    }

    /// Removes scans and returns before `seconds`.
    pub(super) fn forget_before(&mut self, seconds: f64) {
        let early = self.waiting.iter().take_while(|(s, ..)| *s < seconds).count();
        self.waiting.drain(..early);
        let early = self.returns.iter().take_while(|one| one.tau_s < seconds).count();
        self.returns.drain(..early);
    }
}

/// Inverse square of an intensity; 0 if it is not reported.
fn weakness(intensity: f32) -> f32 {
    let weakness = intensity.powi(-2);
    if intensity > 0.0 && weakness.is_finite() { weakness } else { 0.0 }
}

/// Hash of a scan: FNV-1a over the bits of all points.
fn fingerprint(scan: &LidarScan) -> u64 {
    let bits = scan.returns.iter().flat_map(|hit| hit.point_in_laser.iter().map(|x| x.to_bits()));
    bits.fold(0xcbf2_9ce4_8422_2325, |hash, word| (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3))
}

/// Whether all returns have the same range.
fn is_constant(scan: &LidarScan) -> bool {
    let Some(first) = scan.returns.first().map(|hit| hit.point_in_laser.norm()) else { return false };
    scan.returns.len() >= CONSTANT_RANGES.0
        && scan.returns.iter().all(|hit| (hit.point_in_laser.norm() - first).abs() <= CONSTANT_RANGES.1)
}
