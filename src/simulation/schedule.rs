//! Sample times of all sensors, and the times at which ground truth is written.

use super::Rig;
use zsim_base::random::Seed;
use zsim_base::time::{Span, Stamp};
use zsim_sensors::{Clock, Imu, ScanTiming, Stamper};

/// Ground truth is written at whole milliseconds of lidar time, so that poses estimated at such stamps have a match.
const TRUTH_STEP: Span = Span::from_nanos(1_000_000);
/// Period of the clock messages, s of true time.
const CLOCK_STEP_S: f64 = 0.1;
/// Times closer than this are equal, s: above the rounding of sums of seconds, and within the 1 ns resolution of
/// stamps.
const TIME_TOLERANCE_S: f64 = 1e-9;

/// Periodic times on the crystal of a clock.
#[derive(Debug, Clone)]
struct PeriodicTimes {
    clock: Clock,
    first: Stamp,
    period_s: f64,
    /// Number of times handed out.
    count: u64,
}

impl PeriodicTimes {
    fn new(clock: Clock, first: Stamp, period_s: f64) -> Self {
        Self { clock, first, period_s, count: 0 }
    }

    /// Time `index`, true seconds after the start.
    fn true_s(&self, index: u64) -> f64 {
        self.clock.true_s_of_crystal(self.first + Span::from_seconds(index as f64 * self.period_s))
    }

    /// Index of the next time; handed out if an interval of `duration_s` from there ends by `until_s`.
    fn take_until(&mut self, duration_s: f64, until_s: f64) -> Option<u64> {
        let index = self.count;
        (self.true_s(index) + duration_s <= until_s + TIME_TOLERANCE_S).then(|| {
            self.count += 1;
            index
        })
    }
}

/// The interval of an IMU sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImuInterval {
    pub from_s: f64,
    pub to_s: f64,
    pub stamp: Stamp,
}

/// Sample intervals of an IMU, handed out in chunks.
pub(super) struct ImuSchedule {
    instants: PeriodicTimes,
    stamps: Stamper,
    end_s: f64,
}

impl ImuSchedule {
    /// The samples of `imu` on `clock` that end by `end_s`; `seed` determines the jitter of the stamps.
    fn new(imu: &Imu, clock: Clock, seed: Seed, end_s: f64) -> Self {
        // The stamp is `delay` after the middle of the interval.
        let stamped_after = Span::from_seconds(0.5 * imu.period_s() + imu.stamp_delay_s());
        let first_stamp = clock.half_tick_from(clock.crystal(0.0) + stamped_after);
        Self {
            instants: PeriodicTimes::new(clock, first_stamp - stamped_after, imu.period_s()),
            stamps: Stamper::new(clock, first_stamp, imu.period_s(), seed.stream("imu/clock")),
            end_s,
        }
    }

    /// The samples that end by `until_s` and were not handed out before.
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

/// Times of scans, ground truth and clock messages, handed out in chunks.
pub(super) struct Schedule {
    scans: PeriodicTimes,
    scan_stamps: Stamper,
    sweep_s: f64,
    truth: PeriodicTimes,
    first_truth: Stamp,
    clocks: u64,
    end_s: f64,
}

impl Schedule {
    pub fn new(rig: &Rig) -> Self {
        let (lidar, seed) = (rig.clocks.lidar, rig.seed);
        let first_truth = lidar.first_multiple(TRUTH_STEP);
        let last_truth = lidar.stamp_of(rig.duration_s).floor_to(TRUTH_STEP);
        // Crystal reading at the first whole millisecond of mean lidar time: stamps lag by half a tick.
        let first_instant = lidar.crystal(lidar.true_s(first_truth));
        let first_scan = lidar.half_tick_from(first_instant);
        let scan_period_s = rig.lidar.period_s();
        Self {
            scans: PeriodicTimes::new(lidar, first_scan, scan_period_s),
            scan_stamps: Stamper::new(lidar, first_scan, scan_period_s, seed.stream("lidar/clock")),
            sweep_s: rig.lidar.sweep_span().seconds() / lidar.pace(),
            truth: PeriodicTimes::new(lidar, first_instant, TRUTH_STEP.seconds()),
            first_truth,
            clocks: 0,
            end_s: lidar.true_s(last_truth),
        }
    }

    /// The scans that end by `until_s`, within the time covered by ground truth, and were not handed out before.
    pub fn scans(&mut self, until_s: f64) -> Vec<ScanTiming> {
        let until_s = until_s.min(self.end_s);
        let mut timings = Vec::new();
        while let Some(index) = self.scans.take_until(self.sweep_s, until_s) {
            let (start_s, pace) = (self.scans.true_s(index), self.scans.clock.pace());
            timings.extend(self.scan_stamps.next().map(|stamp| ScanTiming { index, start_s, pace, stamp }));
        }
        timings
    }

    /// Sample intervals of `imu` on `clock`, within the time covered by ground truth; `seed` determines the jitter.
    pub fn samples(&self, imu: &Imu, clock: Clock, seed: Seed) -> ImuSchedule {
        ImuSchedule::new(imu, clock, seed, self.end_s)
    }

    /// Times up to `until_s` at which ground truth is written and was not before: true seconds, and lidar stamp.
    pub fn truths(&mut self, until_s: f64) -> Vec<(f64, Stamp)> {
        let until_s = until_s.min(self.end_s);
        let mut instants = Vec::new();
        while let Some(index) = self.truth.take_until(0.0, until_s) {
            let stamp = self.first_truth + Span::from_nanos(index as i64 * TRUTH_STEP.nanos());
            instants.push((self.truth.true_s(index), stamp));
        }
        instants
    }

    /// Times up to `until_s`, true seconds, of clock messages that were not handed out before.
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
