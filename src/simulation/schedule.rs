//! When each sensor takes its samples, and when truth is written.

use super::Rig;
use crate::random::Seed;
use crate::sensors::{Clock, Imu, ScanTiming, Stamper};
use crate::time::{Span, Stamp};

/// Truth is written at whole milliseconds of the lidar's time, so that poses estimated at such stamps find theirs.
const TRUTH_STEP: Span = Span::from_nanos(1_000_000);
/// Time between two messages about the clocks, s of true time.
const CLOCK_STEP_S: f64 = 0.1;
/// Instants this close are one: more than what rounding does to a sum of seconds, less than any clock's nanosecond
/// counts.
const SAME_INSTANT_S: f64 = 1e-9;

/// Instants that follow each other evenly on a clock's crystal.
#[derive(Debug, Clone)]
struct Even {
    clock: Clock,
    first: Stamp,
    period_s: f64,
    /// How many were taken.
    taken: u64,
}

impl Even {
    fn new(clock: Clock, first: Stamp, period_s: f64) -> Self {
        Self { clock, first, period_s, taken: 0 }
    }

    /// Instant `index`, true seconds after the start.
    fn true_s(&self, index: u64) -> f64 {
        self.clock.true_s_of_crystal(self.first + Span::from_seconds(index as f64 * self.period_s))
    }

    /// The index of the next instant, taken if what begins there is over at `until_s`, `lasts_s` later at most.
    fn take_until(&mut self, lasts_s: f64, until_s: f64) -> Option<u64> {
        let index = self.taken;
        (self.true_s(index) + lasts_s <= until_s + SAME_INSTANT_S).then(|| {
            self.taken += 1;
            index
        })
    }
}

/// A sample of the IMU to be taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImuInterval {
    pub from_s: f64,
    pub to_s: f64,
    pub stamp: Stamp,
}

/// When an IMU takes its samples, handed out block by block.
pub(super) struct Samples {
    instants: Even,
    stamps: Stamper,
    end_s: f64,
}

impl Samples {
    /// Those of `imu` on `clock` that are over at `end_s`; `seed` makes the stamps' jitter.
    fn new(imu: &Imu, clock: Clock, seed: Seed, end_s: f64) -> Self {
        // A sample is stamped `delay` after the middle of its interval.
        let stamped_after = Span::from_seconds(0.5 * imu.period_s() + imu.delay_s());
        let first_stamp = clock.half_tick_from(clock.crystal(0.0) + stamped_after);
        Self {
            instants: Even::new(clock, first_stamp - stamped_after, imu.period_s()),
            stamps: Stamper::new(clock, first_stamp, imu.period_s(), seed.stream("imu/clock")),
            end_s,
        }
    }

    /// The samples that are over at `until_s`, and were not handed out before.
    pub fn until(&mut self, until_s: f64) -> Vec<ImuInterval> {
        let until_s = until_s.min(self.end_s);
        let mut intervals = Vec::new();
        let period_s = self.instants.period_s / self.instants.clock.pace();
        while let Some(index) = self.instants.take_until(period_s, until_s) {
            let (from_s, to_s) = (self.instants.true_s(index), self.instants.true_s(index + 1));
            intervals.extend(self.stamps.next().map(|stamp| ImuInterval { from_s, to_s, stamp }));
        }
        intervals
    }
}

/// What happens when, each kind in its order, handed out block by block.
pub(super) struct Schedule {
    scans: Even,
    scan_stamps: Stamper,
    sweep_s: f64,
    truth: Even,
    first_truth: Stamp,
    clocks: u64,
    end_s: f64,
}

impl Schedule {
    pub fn new(rig: &Rig) -> Self {
        let (lidar, seed) = (rig.clocks.lidar, rig.seed);
        let first_truth = lidar.first_multiple(TRUTH_STEP);
        let last_truth = lidar.stamp_of(rig.duration_s).floor_to(TRUTH_STEP);
        // The crystal's reading at the first whole millisecond of the lidar's mean time: stamps lag it by half a tick.
        let first_instant = lidar.crystal(lidar.true_s(first_truth));
        let first_scan = lidar.half_tick_from(first_instant);
        let scan_period_s = rig.lidar.period_s();
        Self {
            scans: Even::new(lidar, first_scan, scan_period_s),
            scan_stamps: Stamper::new(lidar, first_scan, scan_period_s, seed.stream("lidar/clock")),
            sweep_s: rig.lidar.sweep_span().seconds() / lidar.pace(),
            truth: Even::new(lidar, first_instant, TRUTH_STEP.seconds()),
            first_truth,
            clocks: 0,
            end_s: lidar.true_s(last_truth),
        }
    }

    /// The scans that are over at `until_s`, and were not handed out before; each within the time that truth covers.
    pub fn scans(&mut self, until_s: f64) -> Vec<ScanTiming> {
        let until_s = until_s.min(self.end_s);
        let mut timings = Vec::new();
        while let Some(index) = self.scans.take_until(self.sweep_s, until_s) {
            let (start_s, pace) = (self.scans.true_s(index), self.scans.clock.pace());
            timings.extend(self.scan_stamps.next().map(|stamp| ScanTiming { index, start_s, pace, stamp }));
        }
        timings
    }

    /// When `imu` takes its samples on `clock`, within the time that truth covers; `seed` makes the stamps' jitter.
    pub fn samples(&self, imu: &Imu, clock: Clock, seed: Seed) -> Samples {
        Samples::new(imu, clock, seed, self.end_s)
    }

    /// The instants at which truth is written up to `until_s`, and was not before: true seconds, and the lidar's stamp.
    pub fn truths(&mut self, until_s: f64) -> Vec<(f64, Stamp)> {
        let until_s = until_s.min(self.end_s);
        let mut instants = Vec::new();
        while let Some(index) = self.truth.take_until(0.0, until_s) {
            let stamp = self.first_truth + Span::from_nanos(index as i64 * TRUTH_STEP.nanos());
            instants.push((self.truth.true_s(index), stamp));
        }
        instants
    }

    /// The instants, true seconds, up to `until_s` at which the clocks are told, and were not before.
    pub fn clocks(&mut self, until_s: f64) -> Vec<f64> {
        let until_s = until_s.min(self.end_s);
        let mut instants = Vec::new();
        while self.clocks as f64 * CLOCK_STEP_S <= until_s {
            instants.push(self.clocks as f64 * CLOCK_STEP_S);
            self.clocks += 1;
        }
        instants
    }
}
