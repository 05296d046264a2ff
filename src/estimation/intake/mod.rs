//! Queues measurements as they arrive and cuts them into time segments that both sensors cover.

mod position_uncertainty;
mod samples;
mod scans;

use self::position_uncertainty::PositionUncertainty;
use self::samples::{Coverage, MARGIN_S, SampleQueue};
use self::scans::ScanQueue;
use super::coasting::Coasting;
use super::inertial::InertialStream;
use super::initial::NoiseFactors;
use super::scan_geometry::ScanGeometry;
use super::spec::EstimatorSpec;
use super::stamps::StampFilter;
use super::strapdown::Interval;
use super::surfel::TimedReturn;
use super::{EstimationError, Event, EventKind};
use zsim_base::measurement::{Calibration, Measurement};
use zsim_base::signal::Regularity;
use zsim_base::time::{Span, Stamp};

/// Measurements that arrive out of order by up to this are sorted, s.
const MAX_DISORDER_S: f64 = 0.1;
/// Clipped samples are reported again when their number has grown by this factor.
const CLIPPED_REPORT_FACTOR: usize = 10;
/// A longer time without lidar scans is reported as a gap, s.
const LIDAR_GAP_S: f64 = 0.5;
/// After a longer time without lidar scans the estimate stops and restarts with the next scan, s; see also
/// [`PositionUncertainty::is_too_large`].
const MAX_LIDAR_GAP_S: f64 = 3.0;
/// Two scans of a head that turns faster than this on average cannot be equal, rad/s.
const TURNING_RAD_PER_S: f64 = 0.1;
/// So many samples show whether an IMU has a period; a slow one is judged by those of this time, s.
const JUDGED_BY: (usize, f64) = (100, 3.0);
/// Samples before a longer pause do not show the period of the IMU, s.
const MAX_PAUSE_AT_START_S: f64 = 10.0;
/// Scans wait at most this long for IMU samples, s; this bounds the memory.
const MAX_WAIT_FOR_IMU_S: f64 = 30.0;

/// A time segment with the measurements of both sensors.
#[derive(Debug, Clone, Default)]
pub(super) struct Segment {
    /// Start and end, lidar time, s.
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// IMU intervals, which continue those of the previous segment, each with the start in IMU time, s.
    pub(super) intervals: Vec<(f64, Interval)>,
    /// Beams of the segment in order of time.
    pub(super) returns: Vec<TimedReturn>,
    /// Whether an IMU gap too long to bridge, or a long lidar gap, precedes the segment.
    pub(super) after_gap: bool,
    /// The IMU data of a long lidar gap before the segment, if they cover it.
    pub(super) coasting: Option<Coasting>,
}

/// Sorts the measurements of both sensors and cuts them into segments.
#[derive(Debug)]
pub(super) struct Intake {
    spec: EstimatorSpec,
    calibration: Calibration,
    /// Origin of the time axis in seconds: the stamp of the first measurement.
    origin: Option<Stamp>,
    samples: SampleQueue,
    scans: ScanQueue,
    /// Number of clipped samples in the last report.
    clipped_reported: usize,
    next_start_s: f64,
    /// First and last stamp of the samples and of the scans, s.
    spans: [Option<(f64, f64)>; 2],
    /// The next segment is the first after an IMU gap that is not bridged.
    after_gap: bool,
    /// The lidar gap is so long, or the IMU so uncertain in it, that the estimate waits for the next scan.
    without_lidar: bool,
    uncertainty: PositionUncertainty,
    /// IMU data since the estimate waits for a scan.
    coasting: Coasting,
    /// Whether IMU gaps are bridged whatever the motion.
    gaps_are_bridged: bool,
    warnings: Vec<Event>,
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
            spans: [None; 2],
            after_gap: false,
            without_lidar: false,
            uncertainty: PositionUncertainty::default(),
            coasting: Coasting::default(),
            gaps_are_bridged: false,
            warnings: Vec::new(),
        }
    }

    /// Bridges the IMU gaps up to `max_gap_s` of the spec whatever the motion, or only where the motion allows it.
    pub(super) fn bridge_gaps(&mut self, always: bool) {
        self.gaps_are_bridged = always;
    }

    /// Converts `seconds` since the origin into a stamp.
    pub(super) fn stamp(&self, seconds: f64) -> Stamp {
        self.origin.unwrap_or_default() + Span::from_seconds(seconds)
    }

    /// The stamp from which times in seconds count.
    pub(super) fn origin(&self) -> Stamp {
        self.origin.unwrap_or_default()
    }

    /// Sampling period of the IMU, once known, s.
    pub(super) fn imu_period_s(&self) -> Option<f64> {
        self.samples.period_s()
    }

    pub(super) fn take_warnings(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.warnings)
    }

    /// Multiplies the assumed IMU noise by factors.
    pub(super) fn raise_noise(&mut self, factors: NoiseFactors) {
        self.samples.raise_noise(factors);
    }

    /// Whether all scans so far lie in one plane of the lidar frame.
    pub(super) fn is_planar(&self) -> bool {
        self.scans.is_planar()
    }

    /// The scanning geometry of the lidar, according to the first scans.
    pub(super) fn scan_geometry(&self) -> ScanGeometry {
        self.scans.scan_geometry()
    }

    /// Numbers of IMU samples and lidar scans received.
    pub(super) fn counts(&self) -> (usize, usize) {
        (self.samples.count, self.scans.count)
    }

    /// Whether no scan received has a usable return.
    pub(super) fn sees_nothing(&self) -> bool {
        self.scans.empty == self.scans.count
    }

    /// Queues a measurement in the order of the stamps of its sensor.
    pub(super) fn push(&mut self, measurement: Measurement) -> Result<(), EstimationError> {
        match measurement {
            Measurement::Imu(sample) => {
                let seconds = sample.stamp.seconds_since(*self.origin.get_or_insert(sample.stamp));
                extend(&mut self.spans[0], seconds);
                self.samples.push(seconds, sample);
                Ok(())
            }
            Measurement::Lidar(scan) => {
                let seconds = scan.stamp.seconds_since(*self.origin.get_or_insert(scan.stamp));
                extend(&mut self.spans[1], seconds);
                self.scans.push(seconds, scan)
            }
        }
    }

    /// The next segment, once both sensors have data past its end or one has a long gap; with `last`, of the remaining
    /// data.
    pub(super) fn next_segment(&mut self, last: bool) -> Option<Segment> {
        if self.samples.period_s().is_none() {
            self.start(last)?;
        }
        loop {
            let segment = self.cut(last)?;
            if self.is_skipped(&segment) {
                continue;
            }
            if !segment.intervals.is_empty() {
                let after_gap = segment.after_gap || std::mem::take(&mut self.without_lidar);
                let coasting = std::mem::take(&mut self.coasting).if_complete();
                return Some(Segment { after_gap, coasting, ..segment });
            }
        }
    }

    /// Whether a segment is in a lidar gap in which the estimate waits; keeps its IMU data for a prediction.
    fn is_skipped(&mut self, segment: &Segment) -> bool {
        let silent_s = segment.end_s - self.scans.used_s();
        let is_silent = segment.returns.is_empty();
        if is_silent {
            self.uncertainty.add(&segment.intervals);
        } else {
            self.uncertainty = PositionUncertainty::default();
        }
        self.without_lidar |= (is_silent && silent_s > MAX_LIDAR_GAP_S) || self.uncertainty.is_too_large();
        if self.without_lidar && (segment.after_gap || self.uncertainty.is_too_large()) {
            self.coasting.interrupt();
        }
        let is_skipped = self.without_lidar && is_silent;
        if is_skipped {
            self.coasting.add(&segment.intervals, silent_s);
        }
        is_skipped
    }

    /// Cuts the next segment from the queues.
    fn cut(&mut self, last: bool) -> Option<Segment> {
        let start_s = self.next_start_s;
        let imu_end_s = self.samples.newest_s() - MARGIN_S;
        let mut end_s = start_s + self.spec.step_s;
        if !self.is_covered(end_s, imu_end_s) {
            // At the end of the recording the last segment may be shorter, but it needs IMU samples.
            end_s = end_s.min(imu_end_s);
            if !last || end_s - start_s < 0.25 * self.spec.step_s {
                self.scans.forget_before(self.samples.newest_s().max(self.samples.used_s()) - MAX_WAIT_FOR_IMU_S);
                return None;
            }
        }
        let coverage = self.samples.advance(end_s, self.spec.inertial.max_gap_s, self.gaps_are_bridged, last);
        if coverage == Coverage::Waiting && !last {
            return None;
        }
        if coverage != Coverage::Complete {
            end_s = end_s.min(self.samples.end_s() - 0.5 * MARGIN_S).max(start_s);
        }
        let intervals = self.samples.take_intervals();
        let returns = self.scans.take_until(end_s, is_turning(&intervals));
        let after_gap = std::mem::take(&mut self.after_gap);
        let segment = Segment { start_s, end_s, intervals, returns, after_gap, coasting: None };
        self.report(&segment);
        self.next_start_s = end_s;
        if let Coverage::Gap(from_s, until_s) = coverage {
            let seconds = until_s - from_s;
            self.warnings.push(Event::lasting(self.stamp(from_s), seconds, EventKind::Restarted { seconds }));
            self.next_start_s = until_s + MARGIN_S;
            self.after_gap = true;
            self.samples.restart_at(until_s);
            self.scans.forget_before(until_s);
        } else if last && end_s - start_s < 0.05 * self.spec.step_s {
            return None;
        }
        Some(segment)
    }

    /// Whether both sensors have data past `end_s`, or the lidar has a gap for which it is not worth to wait.
    fn is_covered(&self, end_s: f64, imu_end_s: f64) -> bool {
        let both = imu_end_s > end_s + MAX_DISORDER_S && self.scans.newest_s() > end_s + MAX_DISORDER_S;
        both || imu_end_s > end_s + LIDAR_GAP_S + 2.0 * MAX_DISORDER_S
    }

    /// Discards what is known of the sensors' periods: the next samples show them. An irregular sensor can look regular for a
    /// second.
    pub(super) fn start_again(&mut self) {
        self.samples.stop();
    }

    /// Estimates the periods of the sensors and sets the start of the first segment.
    fn start(&mut self, last: bool) -> Option<()> {
        let ((first_sample, last_sample), (first_scan, last_scan)) = (self.samples.span()?, self.scans.span()?);
        let start_s = first_sample.max(first_scan);
        let enough_s = start_s + self.spec.inertial.rest_s + self.spec.step_s;
        let judged_s = self.samples.stamps().nth(JUDGED_BY.0).unwrap_or(f64::INFINITY);
        let enough_s = judged_s.min(start_s + JUDGED_BY.1).max(enough_s);
        let both_s = last_sample.min(last_scan);
        if both_s < enough_s + MAX_DISORDER_S && !(last && both_s > start_s + 2.0 * self.spec.step_s) {
            return None;
        }
        // Ignore later data, so that the order of arrival has no effect.
        let stamps: Vec<f64> = self.samples.stamps().filter(|s| *s <= enough_s).collect();
        // A lone sample long before the others would make the period as long.
        let pause = stamps.windows(2).rposition(|pair| pair[1] - pair[0] > MAX_PAUSE_AT_START_S);
        let stamps = &stamps[pause.map_or(0, |k| k + 1)..];
        let imu = StampFilter::new(Regularity::of(stamps)?, self.spec.clock.jitter_s);
        self.scans.start(first_scan, enough_s)?;
        // The IMU must cover the first beam for any clock offset.
        self.next_start_s = start_s + MARGIN_S;
        let Calibration { imu: noise, imu_averaging: averaging, .. } = self.calibration;
        let stream = InertialStream::new(imu, noise, averaging, self.spec.inertial.clone());
        self.samples.start(stream, start_s - MARGIN_S);
        Some(())
    }

    /// Adds the warnings of a segment: gaps and clipping.
    fn report(&mut self, segment: &Segment) {
        for (from_s, seconds) in self.samples.take_gaps() {
            self.warnings.push(Event::lasting(self.stamp(from_s), seconds, EventKind::ImuGap { seconds }));
        }
        if self.samples.clipped >= (CLIPPED_REPORT_FACTOR * self.clipped_reported).max(1) {
            self.report_clipping(segment.end_s);
        }
        let seconds = segment.end_s - self.scans.used_s();
        if segment.returns.is_empty() && seconds > LIDAR_GAP_S {
            self.warnings.push(Event::at(self.stamp(segment.start_s), EventKind::LidarGap { seconds }));
        }
    }

    fn report_clipping(&mut self, at_s: f64) {
        let samples = self.samples.clipped;
        self.clipped_reported = samples;
        self.warnings.push(Event::at(self.stamp(at_s), EventKind::Saturated { samples }));
    }

    /// Adds the remaining warnings at the end of the data.
    pub(super) fn close(&mut self) {
        if self.samples.clipped > self.clipped_reported {
            self.report_clipping(self.next_start_s);
        }
        let stamp = self.stamp(self.next_start_s);
        let discarded = self.samples.discarded;
        let kinds = [
            EventKind::LateSamples { count: discarded.late },
            EventKind::LateScans { count: self.scans.late },
            EventKind::Outliers { count: discarded.outliers },
            EventKind::RepeatedSamples { count: discarded.frozen },
            EventKind::RepeatedScans { count: self.scans.frozen },
        ];
        let occurred = kinds.into_iter().filter(|kind| kind.magnitude() > Some(0.0));
        self.warnings.extend(occurred.map(|kind| Event::at(stamp, kind)));
    }

    /// Length of time that the measurements of both sensors cover, s.
    pub(super) fn common_s(&self) -> f64 {
        let common = self.spans[0].zip(self.spans[1]);
        common.map_or(0.0, |(imu, lidar)| (imu.1.min(lidar.1) - imu.0.max(lidar.0)).max(0.0))
    }
}

/// Extends a span to `seconds`.
fn extend(span: &mut Option<(f64, f64)>, seconds: f64) {
    let (first, last) = span.get_or_insert((seconds, seconds));
    (*first, *last) = (first.min(seconds), last.max(seconds));
}

/// Whether the head turns by more than noise during the intervals.
fn is_turning(intervals: &[(f64, Interval)]) -> bool {
    let (turn, length) =
        intervals.iter().fold((0.0, 0.0), |(turn, length), (_, i)| (turn + i.gyro.norm() * i.h, length + i.h));
    turn > TURNING_RAD_PER_S * length
}
