//! Takes measurements as they come, and hands out stretches of time in which both sensors have spoken.

use super::inertial::InertialStream;
use super::initial::Noisier;
use super::sight::{Sight, is_in_plane};
use super::spec::EstimatorSpec;
use super::stamps::{Regularity, StampFilter};
use super::strapdown::Interval;
use super::surfel::Beam;
use super::{EstimationError, Warning, WarningKind};
use crate::geometry::Pose;
use crate::measurement::{Calibration, ImuSample, LidarScan, Measurement};
use crate::time::{Span, Stamp};
use std::collections::VecDeque;

/// How much further than a stretch its intervals reach, s: room for the clock offset to change.
pub(super) const MARGIN_S: f64 = 0.05;
/// Disorder of arrivals that is put right, s.
const DISORDER_S: f64 = 0.1;
/// Samples at the end of the IMU's range are told of when they are so many times more than when they were last.
const SATURATED_MORE: usize = 10;
/// A silence of the lidar longer than this is a gap, s.
const LIDAR_GAP_S: f64 = 0.5;

/// A stretch of time: what both sensors said in it.
#[derive(Debug, Default)]
pub(super) struct Stretch {
    /// Where it begins and ends, lidar time, s.
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// Intervals of the IMU that follow those of the stretch before, each with its start, IMU time.
    pub(super) intervals: Vec<(f64, Interval)>,
    /// Beams of the stretch in the order of time.
    pub(super) beams: Vec<Beam>,
    /// Whether the IMU was silent before it, for longer than can be bridged.
    pub(super) after_silence: bool,
}

/// Waiting rooms of both sensors.
#[derive(Debug)]
pub(super) struct Intake {
    spec: EstimatorSpec,
    calibration: Calibration,
    imu_from_laser: Pose,
    origin: Option<Stamp>,
    samples: VecDeque<(f64, ImuSample)>,
    scans: VecDeque<(f64, LidarScan)>,
    /// Raw stamps of the last sample and scan that were used; what comes before is late.
    used_s: (f64, f64),
    counts: (usize, usize),
    /// How the lidar looks about, as far as its first scans have shown.
    sight: Sight,
    /// Whether all points so far lay in the lidar's x-y plane.
    planar: bool,
    late: (usize, usize),
    /// Samples at the end of the IMU's range, and how many there were when that was said last.
    saturated: (usize, usize),
    streams: Option<(InertialStream, StampFilter)>,
    /// Beams already placed in time that belong to the next stretches.
    beams: VecDeque<Beam>,
    next_start_s: f64,
    /// The next stretch is the first after a silence of the IMU.
    after_silence: bool,
    /// The longest silence that is bridged, s.
    bridged_s: f64,
    warnings: Vec<Warning>,
}

impl Intake {
    /// Bridges silences of up to `times` the longest that the settings have bridged.
    pub(super) fn bridge(&mut self, times: f64) {
        self.bridged_s = times * self.spec.inertial.max_gap_s;
    }

    pub(super) fn new(spec: &EstimatorSpec, calibration: &Calibration) -> Self {
        Self {
            spec: spec.clone(),
            calibration: calibration.clone(),
            imu_from_laser: calibration.head_from_imu.inverse() * calibration.head_from_laser,
            origin: None,
            samples: VecDeque::new(),
            scans: VecDeque::new(),
            used_s: (f64::NEG_INFINITY, f64::NEG_INFINITY),
            counts: (0, 0),
            sight: Sight::default(),
            planar: true,
            late: (0, 0),
            saturated: (0, 0),
            streams: None,
            beams: VecDeque::new(),
            next_start_s: 0.0,
            after_silence: false,
            bridged_s: spec.inertial.max_gap_s,
            warnings: Vec::new(),
        }
    }

    /// The stamp of `seconds` on the estimator's axis.
    pub(super) fn stamp(&self, seconds: f64) -> Stamp {
        self.origin.unwrap_or_default() + Span::from_seconds(seconds)
    }

    /// The stamp from which the estimator's seconds count.
    pub(super) fn origin(&self) -> Stamp {
        self.origin.unwrap_or_default()
    }

    /// The IMU's period, once known, s.
    pub(super) fn imu_period_s(&self) -> Option<f64> {
        self.streams.as_ref().map(|(imu, _)| imu.period_s())
    }

    pub(super) fn take_warnings(&mut self) -> Vec<Warning> {
        std::mem::take(&mut self.warnings)
    }

    /// The IMU is so many times noisier than it was told.
    pub(super) fn make_noisier(&mut self, noisier: Noisier) {
        if let Some((imu, _)) = &mut self.streams {
            imu.make_noisier(noisier);
        }
    }

    /// Whether the lidar scans in one plane, as far as its scans have shown.
    pub(super) fn is_planar(&self) -> bool {
        self.planar
    }

    /// How the lidar looks about, as far as its first scans have shown.
    pub(super) fn sight(&self) -> Sight {
        self.sight
    }

    /// How many IMU samples and lidar scans came.
    pub(super) fn counts(&self) -> (usize, usize) {
        self.counts
    }

    /// Takes a measurement into its waiting room, in the order of its sensor's stamps.
    pub(super) fn take(&mut self, measurement: Measurement) -> Result<(), EstimationError> {
        match measurement {
            Measurement::Imu(sample) => self.take_sample(sample),
            Measurement::Lidar(scan) => self.take_scan(scan),
        }
    }

    fn take_sample(&mut self, sample: ImuSample) -> Result<(), EstimationError> {
        let numbers = sample.angular_velocity_rad_per_s.iter().chain(sample.specific_force_m_per_s2.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(EstimationError::NotFinite { sensor: "IMU", stamp_ns: sample.stamp.nanos() });
        }
        self.counts.0 += 1;
        let seconds = sample.stamp.seconds_since(*self.origin.get_or_insert(sample.stamp));
        if seconds <= self.used_s.0 {
            self.late.0 += 1;
        } else {
            let at = self.samples.partition_point(|(s, _)| *s <= seconds);
            self.samples.insert(at, (seconds, sample));
        }
        Ok(())
    }

    fn take_scan(&mut self, scan: LidarScan) -> Result<(), EstimationError> {
        let finite = |p: &nalgebra::Vector3<f32>| p.iter().copied().all(f32::is_finite);
        if !scan.returns.iter().all(|hit| finite(&hit.point_in_laser)) {
            return Err(EstimationError::NotFinite { sensor: "lidar", stamp_ns: scan.stamp.nanos() });
        }
        self.counts.1 += 1;
        self.planar &= scan.returns.iter().all(|hit| is_in_plane(&hit.point_in_laser));
        let seconds = scan.stamp.seconds_since(*self.origin.get_or_insert(scan.stamp));
        if seconds <= self.used_s.1 {
            self.late.1 += 1;
        } else {
            let at = self.scans.partition_point(|(s, _)| *s <= seconds);
            self.scans.insert(at, (seconds, scan));
        }
        Ok(())
    }

    /// The next stretch, when both sensors have passed its end, or one is silent for too long to wait; with `last`, of
    /// whatever is left.
    pub(super) fn next_stretch(&mut self, last: bool) -> Option<Stretch> {
        if self.streams.is_none() {
            self.start(last)?;
        }
        let start_s = self.next_start_s;
        let imu_end_s = self.samples.back().map_or(f64::NEG_INFINITY, |(s, _)| *s) - MARGIN_S;
        let mut end_s = start_s + self.spec.step_s;
        if !self.is_covered(end_s, imu_end_s) {
            // At the end of the recording the last stretch may be shorter, but not without any IMU.
            end_s = end_s.min(imu_end_s);
            if !last || end_s - start_s < 0.25 * self.spec.step_s {
                return None;
            }
        }
        let mut stretch = Stretch { start_s, end_s, after_silence: self.after_silence, ..Stretch::default() };
        self.after_silence = false;
        let silent_until_s = self.use_samples(end_s, &mut stretch);
        if silent_until_s.is_some() {
            end_s = end_s.min(self.used_s.0 - MARGIN_S);
            stretch.end_s = end_s;
        }
        self.use_scans(end_s);
        while self.beams.front().is_some_and(|beam| beam.tau_s < end_s) {
            stretch.beams.extend(self.beams.pop_front());
        }
        self.warn_of_silence(&stretch);
        self.next_start_s = end_s;
        if let Some(until_s) = silent_until_s {
            self.begin_again_at(until_s);
            if stretch.end_s <= stretch.start_s {
                return self.next_stretch(last);
            }
        }
        (!stretch.intervals.is_empty()).then_some(stretch)
    }

    /// After a silence of the IMU until `until_s`: scans of the silence are of no use, and intervals do not reach
    /// across.
    fn begin_again_at(&mut self, until_s: f64) {
        self.next_start_s = until_s + MARGIN_S;
        // The next sample follows at once, and what is older stays late.
        self.used_s.0 = until_s - 1e-9;
        self.after_silence = true;
        self.scans.retain(|(seconds, _)| *seconds >= until_s);
        self.beams.clear();
        if let Some((imu, _)) = self.streams.as_mut() {
            imu.begin_again();
        }
    }

    /// Whether both sensors have passed `end_s`, or waiting for the lidar has become pointless.
    fn is_covered(&self, end_s: f64, imu_end_s: f64) -> bool {
        let lidar_end_s = self.scans.back().map_or(f64::NEG_INFINITY, |(s, _)| *s);
        let both = imu_end_s > end_s + DISORDER_S && lidar_end_s > end_s + DISORDER_S;
        both || imu_end_s > end_s + LIDAR_GAP_S + 2.0 * DISORDER_S
    }

    /// Learns the sensors' periods, and where the stretches begin.
    fn start(&mut self, last: bool) -> Option<()> {
        let (first_sample, first_scan) = (self.samples.front()?.0, self.scans.front()?.0);
        let start_s = first_sample.max(first_scan);
        let enough_s = start_s + self.spec.inertial.rest_s + self.spec.step_s;
        let both_s = self.samples.back()?.0.min(self.scans.back()?.0);
        if both_s < enough_s + DISORDER_S && !(last && both_s > start_s + 2.0 * self.spec.step_s) {
            return None;
        }
        // What came by now beyond the needed does not count, so that the order of arrivals does not.
        let stamps: Vec<f64> = self.samples.iter().map(|(s, _)| *s).filter(|s| *s <= enough_s).collect();
        let first_scans = || self.scans.iter().filter(|(s, _)| *s <= enough_s);
        let scan_stamps: Vec<f64> = first_scans().map(|(s, scan)| s + scan.stamped_after.seconds()).collect();
        let scanning = Regularity::of(&scan_stamps)?;
        self.sight = Sight::of(first_scans().map(|(_, scan)| scan), enough_s - first_scan, scanning.period_s);
        let jitter_s = self.spec.clock.jitter_s;
        let imu = StampFilter::new(Regularity::of(&stamps)?, jitter_s);
        let lidar = StampFilter::new(scanning, jitter_s);
        // The IMU must cover the first beam whatever the clock offset.
        self.next_start_s = start_s + MARGIN_S;
        self.streams = Some((InertialStream::new(imu, self.calibration.imu, self.spec.inertial.clone()), lidar));
        Some(())
    }

    /// Uses the samples up to a little after `end_s`; stops where the IMU fell silent for too long, and tells until
    /// when.
    fn use_samples(&mut self, end_s: f64, stretch: &mut Stretch) -> Option<f64> {
        let (imu, _) = self.streams.as_mut()?;
        let mut silent_until_s = None;
        while let Some((seconds, sample)) = self.samples.pop_front() {
            let gap_s = seconds - self.used_s.0;
            if gap_s.is_finite() && gap_s > self.bridged_s {
                let stamp = self.origin.unwrap_or_default() + Span::from_seconds(self.used_s.0);
                self.warnings.push(Warning { stamp, kind: WarningKind::BeganAgain { seconds: gap_s } });
                self.samples.push_front((seconds, sample));
                silent_until_s = Some(seconds);
                break;
            }
            if gap_s.is_finite() && gap_s > 4.5 * imu.period_s() {
                let stamp = self.origin.unwrap_or_default() + Span::from_seconds(self.used_s.0);
                self.warnings.push(Warning { stamp, kind: WarningKind::ImuGap { seconds: gap_s } });
            }
            self.used_s.0 = seconds;
            imu.push(seconds, &sample, &mut stretch.intervals);
            if seconds > end_s + MARGIN_S {
                break;
            }
        }
        self.saturated.0 += imu.take_saturated();
        if self.saturated.0 >= (SATURATED_MORE * self.saturated.1).max(1) {
            self.warn_of_saturation(end_s);
        }
        silent_until_s
    }

    fn use_scans(&mut self, end_s: f64) {
        let Some((_, lidar)) = self.streams.as_mut() else { return };
        while self.scans.front().is_some_and(|(seconds, _)| *seconds < end_s) {
            let Some((seconds, scan)) = self.scans.pop_front() else { return };
            self.used_s.1 = seconds;
            let after_s = scan.stamped_after.seconds();
            let start_s = lidar.smooth(seconds + after_s) - after_s;
            let (least, most) = (self.spec.surfels.min_range_m, self.spec.surfels.max_range_m);
            for hit in &scan.returns {
                let point = hit.point_in_laser.cast::<f64>();
                let range = point.norm();
                if (least..=most).contains(&range) {
                    let in_imu = self.imu_from_laser.rotation * point + self.imu_from_laser.translation.vector;
                    let tau_s = start_s + hit.offset.seconds();
                    self.beams.push_back(Beam { tau_s, point_in_imu: in_imu.cast(), range_m: range as f32 });
                }
            }
        }
    }

    fn warn_of_saturation(&mut self, at_s: f64) {
        let samples = self.saturated.0;
        self.saturated.1 = samples;
        self.warnings.push(Warning { stamp: self.stamp(at_s), kind: WarningKind::Saturated { samples } });
    }

    fn warn_of_silence(&mut self, stretch: &Stretch) {
        let seconds = stretch.end_s - self.used_s.1;
        if stretch.beams.is_empty() && seconds > LIDAR_GAP_S {
            let stamp = self.stamp(stretch.start_s);
            self.warnings.push(Warning { stamp, kind: WarningKind::LidarGap { seconds } });
        }
    }

    /// What is to be said when nothing more comes.
    pub(super) fn close(&mut self) {
        if self.saturated.0 > self.saturated.1 {
            self.warn_of_saturation(self.next_start_s);
        }
        let stamp = self.stamp(self.next_start_s);
        for (what, count) in [("IMU samples", self.late.0), ("lidar scans", self.late.1)] {
            if count > 0 {
                self.warnings.push(Warning { stamp, kind: WarningKind::LeftOut { what, count } });
            }
        }
    }

    /// The time that both sensors cover, s.
    pub(super) fn common_s(&self) -> f64 {
        let span = |first: Option<f64>, last: Option<f64>| Some((first?, last?));
        let imu = span(self.samples.front().map(|s| s.0), self.samples.back().map(|s| s.0));
        let lidar = span(self.scans.front().map(|s| s.0), self.scans.back().map(|s| s.0));
        let common = imu.zip(lidar).map(|(imu, lidar)| imu.1.min(lidar.1) - imu.0.max(lidar.0));
        common.unwrap_or(0.0).max(0.0)
    }
}
