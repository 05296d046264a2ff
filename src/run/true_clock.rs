//! True offset between the clocks of IMU and lidar.

use zsim_base::time::{Span, Stamp};
use zsim_recording::{Reader, RecordingError, Selection, Truth};
use zsim_truth::ClockTruth;

/// The true clock offset, s, with its lidar time: IMU stamp minus lidar stamp of the same true time `now`.
pub(super) fn true_offset(now: Stamp, clock: &ClockTruth) -> (Stamp, f64) {
    (now + clock.lidar_offset, clock.imu_after_lidar().seconds())
}

/// The true clock offset over lidar time, s: IMU stamp minus lidar stamp of the same time.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct TrueClock(Vec<(Stamp, f64)>);

impl TrueClock {
    /// Reads the true offset, including the shift of the IMU stamps that `selection` applies if the clock epochs differ.
    pub(super) fn read(reader: &Reader, selection: &Selection) -> Result<Self, RecordingError> {
        let mut read = Self::default();
        for record in reader.truth() {
            if let Truth::Clock(now, clock) = record? {
                read.add(now, &clock, selection.imu_shift());
            }
        }
        Ok(read)
    }

    /// Adds the next record; `imu_shift` is the shift of the IMU stamps that the selection applies.
    pub(super) fn add(&mut self, now: Stamp, clock: &ClockTruth, imu_shift: Span) {
        let (at, offset_s) = true_offset(now, clock);
        self.0.push((at, offset_s + imu_shift.seconds()));
    }

    /// A clock with the given offsets, s, in order of time.
    #[cfg(test)]
    pub(super) fn from_offsets(offsets: Vec<(Stamp, f64)>) -> Self {
        Self(offsets)
    }

    /// Converts an IMU stamp to the lidar clock.
    ///
    /// The offset is interpolated linearly, and constant before the first and after the last record. It is interpolated
    /// at the IMU stamp: the clocks differ by milliseconds, and in that time the offset changes by nanoseconds.
    pub(super) fn on_lidar_clock(&self, imu_stamp: Stamp) -> Stamp {
        let after = self.0.partition_point(|(at, _)| *at <= imu_stamp);
        let offset_s = match (after.checked_sub(1).map(|before| self.0[before]), self.0.get(after)) {
            (Some((t0, l0)), Some((t1, l1))) => l0 + (l1 - l0) * imu_stamp.seconds_since(t0) / t1.seconds_since(t0),
            (Some((_, offset_s)), None) | (None, Some(&(_, offset_s))) => offset_s,
            (None, None) => 0.0,
        };
        imu_stamp - Span::from_seconds(offset_s)
    }
}
