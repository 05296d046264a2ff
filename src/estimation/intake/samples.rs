//! IMU input: queues and screens samples, and converts them to intervals.

use crate::inertial::{InertialStream, Screen, Screened};
use crate::initial::NoiseFactors;
use crate::strapdown::Interval;
use std::collections::VecDeque;
use zsim_base::measurement::{ImuNoise, ImuSample};

/// Margin of the IMU intervals on both sides of a segment, s: room for a change of the clock offset.
pub(super) const MARGIN_S: f64 = 0.05;

/// A sample is used when the newest one is later by this, s. By then delayed samples have arrived, and so have the
/// later samples that the screening needs.
const COMPLETE_AFTER_S: f64 = 0.2;

/// Whether the intervals cover a requested time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Coverage {
    /// The intervals cover the requested time.
    Complete,
    /// More samples are needed.
    Waiting,
    /// No samples between these times (IMU time, s), for longer than is bridged.
    Gap(f64, f64),
}

/// Numbers of discarded IMU samples, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DiscardedCounts {
    pub late: usize,
    pub outliers: usize,
    pub frozen: usize,
}

/// Queue of IMU samples, and the intervals made of them.
#[derive(Debug)]
pub(super) struct SampleQueue {
    waiting: VecDeque<(f64, ImuSample)>,
    /// Stamp of the last sample removed from the queue; earlier ones are late.
    taken_s: f64,
    /// Stamp of the last sample that was used.
    used_s: f64,
    pub(super) count: usize,
    pub(super) discarded: DiscardedCounts,
    /// Number of clipped samples.
    pub(super) clipped: usize,
    /// Gaps bridged since the last call of `take_gaps`: start and length, s.
    gaps: Vec<(f64, f64)>,
    screen: Screen,
    stream: Option<InertialStream>,
    intervals: Vec<(f64, Interval)>,
}

impl SampleQueue {
    pub(super) fn new(noise: &ImuNoise) -> Self {
        Self {
            waiting: VecDeque::new(),
            taken_s: f64::NEG_INFINITY,
            used_s: f64::NEG_INFINITY,
            count: 0,
            discarded: DiscardedCounts::default(),
            clipped: 0,
            gaps: Vec::new(),
            screen: Screen::new(noise),
            stream: None,
            intervals: Vec::new(),
        }
    }

    /// Inserts a sample in order of time; discards a late one.
    pub(super) fn push(&mut self, seconds: f64, sample: ImuSample) {
        self.count += 1;
        if seconds <= self.taken_s {
            self.discarded.late += 1;
            return;
        }
        let at = self.waiting.partition_point(|(s, _)| *s <= seconds);
        self.waiting.insert(at, (seconds, sample));
    }

    /// Stamps of the queued samples, s.
    pub(super) fn stamps(&self) -> impl Iterator<Item = f64> {
        self.waiting.iter().map(|(seconds, _)| *seconds)
    }

    /// First and last stamp in the queue, s.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        Some((self.waiting.front()?.0, self.waiting.back()?.0))
    }

    /// The newest queued stamp, s; minus infinity if the queue is empty.
    pub(super) fn newest_s(&self) -> f64 {
        self.waiting.back().map_or(f64::NEG_INFINITY, |(seconds, _)| *seconds)
    }

    /// Stamp of the last sample that was used, s.
    pub(super) fn used_s(&self) -> f64 {
        self.used_s
    }

    /// Starts the conversion by `stream` with the samples from `from_s` on. Earlier samples precede the first lidar scan
    /// and would only allow dead reckoning.
    pub(super) fn start(&mut self, stream: InertialStream, from_s: f64) {
        let before = self.waiting.partition_point(|(seconds, _)| *seconds < from_s);
        self.waiting.drain(..before);
        self.stream = Some(stream);
    }

    /// Ends the conversion; samples are queued until it starts again.
    pub(super) fn stop(&mut self) {
        (self.stream, self.used_s) = (None, f64::NEG_INFINITY);
        self.intervals.clear();
    }

    /// Sampling period, once known, s.
    pub(super) fn period_s(&self) -> Option<f64> {
        self.stream.as_ref().map(InertialStream::period_s)
    }

    /// Multiplies the assumed IMU noise by factors.
    pub(super) fn raise_noise(&mut self, factors: NoiseFactors) {
        if let Some(stream) = &mut self.stream {
            stream.raise_noise(factors);
        }
    }

    /// Uses samples until the intervals reach slightly past `end_s`. Bridges gaps of up to `max_gap_s`, if the motion
    /// allows it or they are `always_bridged`. `last`: no more data will arrive.
    pub(super) fn advance(&mut self, end_s: f64, max_gap_s: f64, always_bridged: bool, last: bool) -> Coverage {
        let complete_s = if last { f64::INFINITY } else { self.newest_s() - COMPLETE_AFTER_S };
        let Some(stream) = &mut self.stream else { return Coverage::Waiting };
        while let Some((seconds, sample)) = self.waiting.front().copied() {
            if self.used_s > end_s + MARGIN_S && stream.end_s() > end_s + 0.5 * MARGIN_S {
                return Coverage::Complete;
            }
            if seconds > complete_s && seconds > end_s + 2.0 * MARGIN_S {
                return Coverage::Waiting;
            }
            let screened = self.screen.screen(seconds, &sample, self.waiting.iter().skip(1));
            let gap_s = seconds - self.used_s;
            if let Screened::Measured(_) = screened
                && gap_s.is_finite()
                && gap_s > 4.5 * stream.period_s()
                && !(gap_s < max_gap_s && (always_bridged || stream.can_bridge(gap_s)))
            {
                stream.flush(&mut self.intervals);
                return Coverage::Gap(self.used_s, seconds);
            }
            self.waiting.pop_front();
            self.taken_s = seconds;
            match screened {
                Screened::Measured(clipped) => {
                    if gap_s.is_finite() && gap_s > 4.5 * stream.period_s() {
                        self.gaps.push((self.used_s, gap_s));
                    }
                    self.used_s = seconds;
                    let later_s = self.waiting.iter().map(|(later_s, _)| *later_s);
                    stream.push(seconds, later_s, &sample, clipped, &mut self.intervals);
                }
                Screened::Outlier { may_be_shock } => {
                    self.discarded.outliers += 1;
                    if may_be_shock {
                        stream.note_possible_shock();
                    }
                }
                Screened::Frozen => self.discarded.frozen += 1,
            }
        }
        self.clipped += stream.take_saturated();
        if last {
            stream.flush(&mut self.intervals);
        }
        if self.used_s > end_s + MARGIN_S { Coverage::Complete } else { Coverage::Waiting }
    }

    /// The complete intervals, in order, each with the start time.
    pub(super) fn take_intervals(&mut self) -> Vec<(f64, Interval)> {
        if let Some(stream) = &mut self.stream {
            self.clipped += stream.take_saturated();
        }
        std::mem::take(&mut self.intervals)
    }

    /// The gaps bridged since the last call: start and length, s.
    pub(super) fn take_gaps(&mut self) -> Vec<(f64, f64)> {
        std::mem::take(&mut self.gaps)
    }

    /// End of the last interval, IMU time, s.
    pub(super) fn end_s(&self) -> f64 {
        self.stream.as_ref().map_or(f64::NEG_INFINITY, InertialStream::end_s)
    }

    /// Restarts after a gap with the next sample, stamped `until_s`.
    pub(super) fn restart_at(&mut self, until_s: f64) {
        (self.taken_s, self.used_s) = (until_s - 1e-9, f64::NEG_INFINITY);
        if let Some(stream) = &mut self.stream {
            stream.restart();
        }
    }
}
