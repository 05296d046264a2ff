use crate::recording::{Reader, RecordingError, Selection, Truth};
use crate::time::{Span, Stamp};
use crate::truth::ClockTruth;

/// How much later the IMU's clock truly stamps an instant than the lidar's, s, at lidar time; the clocks tell it at the
/// true time `now`.
pub(super) fn true_offset(now: Stamp, clock: &ClockTruth) -> (Stamp, f64) {
    (now + clock.lidar_ahead, clock.imu_after_lidar().seconds())
}

/// How much later the IMU's clock truly stamps an instant than the lidar's, over lidar time.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct TrueClock(Vec<(Stamp, f64)>);

impl TrueClock {
    /// The offset of `selection`'s samples, whose stamps are shifted already where the clocks' epochs differ.
    pub(super) fn read(reader: &Reader, selection: &Selection) -> Result<Self, RecordingError> {
        let shift_s = selection.imu_shift().seconds();
        let mut offsets = Vec::new();
        for told in reader.truth() {
            if let Truth::Clock(now, clock) = told? {
                let (at, offset_s) = true_offset(now, &clock);
                offsets.push((at, offset_s + shift_s));
            }
        }
        Ok(Self(offsets))
    }

    /// Offsets, s, in order of time.
    #[cfg(test)]
    pub(super) fn told(offsets: Vec<(Stamp, f64)>) -> Self {
        Self(offsets)
    }

    /// What the lidar's clock says when the IMU's says `imu_stamp`.
    ///
    /// The offset is linear between those told, and that of the end beyond them. It is looked up by the IMU's stamp:
    /// the clocks differ by milliseconds, in which it changes by nanoseconds.
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
