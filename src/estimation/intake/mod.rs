//! Queues measurements as they arrive, and outputs time segments that both sensors cover.

mod samples;
mod scans;

use self::samples::{Reached, SampleQueue};
use self::scans::ScanQueue;
use super::inertial::InertialStream;
use super::initial::Noisier;
use super::sight::Sight;
use super::spec::EstimatorSpec;
use super::stamps::StampFilter;
use super::strapdown::Interval;
use super::surfel::Beam;
use super::{EstimationError, LeftOut, Warning, WarningKind};
use crate::measurement::{Calibration, Measurement};
use crate::signal::Regularity;
use crate::time::{Span, Stamp};

/// Margin of the intervals on both sides of a segment, s: room for the clock offset to change.
pub(super) const MARGIN_S: f64 = 0.05;
/// Disorder of arrivals that is put right, s.
const DISORDER_S: f64 = 0.1;
/// Clipped samples are reported a second time when the count has grown by this factor.
const CLIPPED_MORE: usize = 10;
/// A silence of the lidar longer than this is a gap, s.
const LIDAR_GAP_S: f64 = 0.5;
/// Without lidar data for longer than this, the estimate stops and restarts with the next scan, s.
const LIDAR_AWAY_S: f64 = 3.0;
/// A head that turns faster than this on average does not see the same twice, rad/s.
const TURNS_RAD_PER_S: f64 = 0.1;
/// Scans wait for the IMU no longer than this, s.
const WAITS_FOR_IMU_S: f64 = 30.0;

/// A time segment with the measurements of both sensors.
#[derive(Debug, Default)]
pub(super) struct Stretch {
    /// Start and end, lidar time, s.
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// Intervals of the IMU that follow those of the previous segment, each with the start time, IMU time.
    pub(super) intervals: Vec<(f64, Interval)>,
    /// Beams of the stretch in the order of time.
    pub(super) beams: Vec<Beam>,
    /// Whether the IMU was silent before it, for longer than can be bridged.
    pub(super) after_silence: bool,
}

/// Puts the measurements of both sensors in order, and cuts them into stretches.
#[derive(Debug)]
pub(super) struct Intake {
    spec: EstimatorSpec,
    calibration: Calibration,
    origin: Option<Stamp>,
    samples: SampleQueue,
    scans: ScanQueue,
    /// How many clipped samples there were when that was last reported.
    clipped_reported: usize,
    next_start_s: f64,
    /// The next stretch is the first after a silence.
    after_silence: bool,
    /// The lidar has been silent for so long that the estimate waits for it.
    without_lidar: bool,
    /// The longest silence of the IMU that is bridged, s.
    bridged_s: f64,
    warnings: Vec<Warning>,
}

impl Intake {
    pub(super) fn new(spec: &EstimatorSpec, calibration: &Calibration) -> Self {
        Self {
            spec: spec.clone(),
            calibration: calibration.clone(),
            origin: None,
            samples: SampleQueue::new(&calibration.imu),
            scans: ScanQueue::new(spec, calibration),
            clipped_reported: 0,
            next_start_s: 0.0,
            after_silence: false,
            without_lidar: false,
            bridged_s: spec.inertial.max_gap_s,
            warnings: Vec::new(),
        }
    }

    /// Bridges silences of up to `times` the longest that the settings have bridged.
    pub(super) fn bridge(&mut self, times: f64) {
        self.bridged_s = times * self.spec.inertial.max_gap_s;
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
        self.samples.period_s()
    }

    pub(super) fn take_warnings(&mut self) -> Vec<Warning> {
        std::mem::take(&mut self.warnings)
    }

    /// Raises the assumed IMU noise by a factor.
    pub(super) fn make_noisier(&mut self, noisier: Noisier) {
        self.samples.make_noisier(noisier);
    }

    /// Whether the lidar scans in one plane, according to the scans so far.
    pub(super) fn is_planar(&self) -> bool {
        self.scans.is_planar()
    }

    /// The scanning geometry of the lidar, according to the first scans.
    pub(super) fn sight(&self) -> Sight {
        self.scans.sight()
    }

    /// Numbers of IMU samples and lidar scans received.
    pub(super) fn counts(&self) -> (usize, usize) {
        (self.samples.count, self.scans.count)
    }

    /// Queues a measurement in the order of the sensor's stamps.
    pub(super) fn take(&mut self, measurement: Measurement) -> Result<(), EstimationError> {
        match measurement {
            Measurement::Imu(sample) => {
                let seconds = sample.stamp.seconds_since(*self.origin.get_or_insert(sample.stamp));
                self.samples.take(seconds, sample);
                Ok(())
            }
            Measurement::Lidar(scan) => {
                let seconds = scan.stamp.seconds_since(*self.origin.get_or_insert(scan.stamp));
                self.scans.take(seconds, scan)
            }
        }
    }

    /// The next segment, when both sensors have passed its end, or one is silent for too long; with `last`, of
    /// the remaining data.
    pub(super) fn next_stretch(&mut self, last: bool) -> Option<Stretch> {
        if self.samples.period_s().is_none() {
            self.start(last)?;
        }
        loop {
            let stretch = self.cut(last)?;
            let is_silent = stretch.beams.is_empty() && stretch.end_s - self.scans.used_s() > LIDAR_AWAY_S;
            self.without_lidar |= is_silent;
            if self.without_lidar && stretch.beams.is_empty() {
                continue;
            }
            if !stretch.intervals.is_empty() {
                let after_silence = stretch.after_silence || std::mem::take(&mut self.without_lidar);
                return Some(Stretch { after_silence, ..stretch });
            }
        }
    }

    /// Cuts the next segment from the queues.
    fn cut(&mut self, last: bool) -> Option<Stretch> {
        let start_s = self.next_start_s;
        let imu_end_s = self.samples.newest_s() - MARGIN_S;
        let mut end_s = start_s + self.spec.step_s;
        if !self.is_covered(end_s, imu_end_s) {
            // At the end of the recording the last stretch may be shorter, but not without any IMU.
            end_s = end_s.min(imu_end_s);
            if !last || end_s - start_s < 0.25 * self.spec.step_s {
                self.scans.forget_before(self.samples.newest_s().max(self.samples.used_s()) - WAITS_FOR_IMU_S);
                return None;
            }
        }
        let reached = self.samples.advance(end_s, self.bridged_s, last);
        if reached == Reached::Waits && !last {
            return None;
        }
        if reached != Reached::All {
            end_s = end_s.min(self.samples.end_s() - 0.5 * MARGIN_S).max(start_s);
        }
        let intervals = self.samples.take_intervals();
        let beams = self.scans.take_until(end_s, turns(&intervals));
        let after_silence = std::mem::take(&mut self.after_silence);
        let stretch = Stretch { start_s, end_s, intervals, beams, after_silence };
        self.report(&stretch);
        self.next_start_s = end_s;
        if let Reached::Silence(from_s, until_s) = reached {
            let kind = WarningKind::BeganAgain { seconds: until_s - from_s };
            self.warnings.push(Warning { stamp: self.stamp(from_s), kind });
            self.next_start_s = until_s + MARGIN_S;
            self.after_silence = true;
            self.samples.begin_again_at(until_s);
            self.scans.forget_before(until_s);
        } else if last && end_s - start_s < 0.05 * self.spec.step_s {
            return None;
        }
        Some(stretch)
    }

    /// Whether both sensors have passed `end_s`, or waiting for the lidar has become pointless.
    fn is_covered(&self, end_s: f64, imu_end_s: f64) -> bool {
        let both = imu_end_s > end_s + DISORDER_S && self.scans.newest_s() > end_s + DISORDER_S;
        both || imu_end_s > end_s + LIDAR_GAP_S + 2.0 * DISORDER_S
    }

    /// Learns the sensors' periods, and where the stretches begin.
    fn start(&mut self, last: bool) -> Option<()> {
        let ((first_sample, last_sample), (first_scan, last_scan)) = (self.samples.span()?, self.scans.span()?);
        let start_s = first_sample.max(first_scan);
        let enough_s = start_s + self.spec.inertial.rest_s + self.spec.step_s;
        let both_s = last_sample.min(last_scan);
        if both_s < enough_s + DISORDER_S && !(last && both_s > start_s + 2.0 * self.spec.step_s) {
            return None;
        }
        // Ignore data beyond the required, so that the order of arrival has no effect.
        let stamps: Vec<f64> = self.samples.stamps().filter(|s| *s <= enough_s).collect();
        let imu = StampFilter::new(Regularity::of(&stamps)?, self.spec.clock.jitter_s);
        self.scans.start(first_scan, enough_s)?;
        // The IMU must cover the first beam whatever the clock offset.
        self.next_start_s = start_s + MARGIN_S;
        let stream = InertialStream::new(imu, self.calibration.imu, self.spec.inertial.clone());
        self.samples.start(stream, start_s - MARGIN_S);
        Some(())
    }

    /// Reports the notable events of a segment.
    fn report(&mut self, stretch: &Stretch) {
        for (from_s, seconds) in self.samples.take_gaps() {
            self.warnings.push(Warning { stamp: self.stamp(from_s), kind: WarningKind::ImuGap { seconds } });
        }
        if self.samples.clipped >= (CLIPPED_MORE * self.clipped_reported).max(1) {
            self.report_clipping(stretch.end_s);
        }
        let seconds = stretch.end_s - self.scans.used_s();
        if stretch.beams.is_empty() && seconds > LIDAR_GAP_S {
            let stamp = self.stamp(stretch.start_s);
            self.warnings.push(Warning { stamp, kind: WarningKind::LidarGap { seconds } });
        }
    }

    fn report_clipping(&mut self, at_s: f64) {
        let samples = self.samples.clipped;
        self.clipped_reported = samples;
        self.warnings.push(Warning { stamp: self.stamp(at_s), kind: WarningKind::Saturated { samples } });
    }

    /// Reports the remaining events at the end of the data.
    pub(super) fn close(&mut self) {
        if self.samples.clipped > self.clipped_reported {
            self.report_clipping(self.next_start_s);
        }
        let stamp = self.stamp(self.next_start_s);
        let samples = self.samples.left_out;
        for (what, count) in [
            (LeftOut::LateSamples, samples.late),
            (LeftOut::LateScans, self.scans.late),
            (LeftOut::Outliers, samples.outliers),
            (LeftOut::RepeatedSamples, samples.frozen),
            (LeftOut::RepeatedScans, self.scans.frozen),
        ] {
            if count > 0 {
                self.warnings.push(Warning { stamp, kind: WarningKind::LeftOut { what, count } });
            }
        }
    }

    /// The time that both sensors cover, s.
    pub(super) fn common_s(&self) -> f64 {
        let common = self.samples.span().zip(self.scans.span());
        common.map_or(0.0, |(imu, lidar)| (imu.1.min(lidar.1) - imu.0.max(lidar.0)).max(0.0))
    }
}

/// Whether the head turns by more than noise over some intervals.
fn turns(intervals: &[(f64, Interval)]) -> bool {
    let (turn, length) =
        intervals.iter().fold((0.0, 0.0), |(turn, length), (_, i)| (turn + i.gyro.norm() * i.h, length + i.h));
    turn > TURNS_RAD_PER_S * length
}
