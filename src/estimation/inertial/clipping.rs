//! Recognises samples at the end of a sensor's range, with or without its data sheet.

use crate::geometry::Vector;
use crate::measurement::{ImuNoise, ImuSample};

/// A reading this close to a limit, as a fraction of it, is clipped.
const AT_LIMIT: f64 = 1e-3;
/// Readings this close to each other, as a fraction, are the same flat top.
const SAME: f64 = 1e-6;
/// No sensor ends at less than this, rad/s and m/s^2: the flat top of a smaller signal is its resolution.
const LEAST_LIMIT: (f64, f64) = (1.5, 15.0);
/// So many samples at one extreme, two of them in a row, are a flat top.
const RECURS: usize = 3;

/// On which axes a sample is at the end of the range: it says only that the true value is not smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::estimation) struct Clipped {
    /// Axes of the gyroscope.
    pub gyro: [bool; 3],
    /// Axes of the accelerometer.
    pub accel: [bool; 3],
}

impl Clipped {
    /// On no axis.
    pub const NONE: Self = Self { gyro: [false; 3], accel: [false; 3] };

    /// On any axis of either sensor.
    pub fn any(self) -> bool {
        self != Self::NONE
    }

    /// On the axes of both.
    pub fn or(self, other: Self) -> Self {
        let either = |a: [bool; 3], b: [bool; 3]| [0, 1, 2].map(|k| a[k] || b[k]);
        Self { gyro: either(self.gyro, other.gyro), accel: either(self.accel, other.accel) }
    }
}

/// The ends of an IMU's ranges: as its data sheet has them, and as its readings show them.
#[derive(Debug)]
pub(super) struct RangeLimits {
    gyro: [Axis; 3],
    accel: [Axis; 3],
    data_sheet: (f64, f64),
}

/// The largest reading of an axis so far, and how often it occurred.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    extreme: f64,
    count: usize,
    /// Whether two readings in a row were at it.
    flat: bool,
    was_at_extreme: bool,
}

impl Axis {
    /// Takes the next reading.
    fn take(&mut self, reading: f64) {
        let size = reading.abs();
        if size > self.extreme * (1.0 + SAME) {
            *self = Self { extreme: size, count: 1, flat: false, was_at_extreme: true };
        } else {
            let at_extreme = size >= self.extreme * (1.0 - SAME);
            self.count += usize::from(at_extreme);
            self.flat |= at_extreme && self.was_at_extreme;
            self.was_at_extreme = at_extreme;
        }
    }

    /// The limit that the readings show, if they show one.
    fn limit(&self, least: f64) -> Option<f64> {
        (self.flat && self.count >= RECURS && self.extreme >= least).then_some(self.extreme)
    }
}

/// Which axes of `reading`, followed by `ahead`, are at a limit.
fn clipped_axes(
    axes: &mut [Axis; 3],
    reading: &Vector,
    ahead: &[Vector],
    (data_sheet, least): (f64, f64),
) -> [bool; 3] {
    std::array::from_fn(|k| {
        axes[k].take(reading[k]);
        let mut with_ahead = axes[k];
        ahead.iter().for_each(|next| with_ahead.take(next[k]));
        let shown = with_ahead.limit(least).unwrap_or(f64::INFINITY);
        reading[k].abs() >= (1.0 - AT_LIMIT) * data_sheet || reading[k].abs() >= (1.0 - SAME) * shown
    })
}

impl RangeLimits {
    pub(super) fn new(noise: &ImuNoise) -> Self {
        let data_sheet = (noise.gyro_limit_rad_per_s, noise.accel_limit_m_per_s2);
        Self { gyro: [Axis::default(); 3], accel: [Axis::default(); 3], data_sheet }
    }

    /// On which axes `sample`, followed by `ahead`, is clipped.
    pub(super) fn clipped<'a>(&mut self, sample: &ImuSample, ahead: impl Iterator<Item = &'a ImuSample>) -> Clipped {
        let readings = ahead.map(|next| (next.angular_velocity_rad_per_s, next.specific_force_m_per_s2));
        let (gyro_ahead, accel_ahead): (Vec<Vector>, Vec<Vector>) = readings.unzip();
        let (gyro, accel) = (&sample.angular_velocity_rad_per_s, &sample.specific_force_m_per_s2);
        Clipped {
            gyro: clipped_axes(&mut self.gyro, gyro, &gyro_ahead, (self.data_sheet.0, LEAST_LIMIT.0)),
            accel: clipped_axes(&mut self.accel, accel, &accel_ahead, (self.data_sheet.1, LEAST_LIMIT.1)),
        }
    }
}
