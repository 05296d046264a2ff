//! Detects clipped samples, with range limits from the data sheet or from the readings.

use zsim_base::geometry::Vector;
use zsim_base::measurement::{ImuNoise, ImuSample};

/// A reading within this fraction of a data sheet limit is clipped.
const AT_LIMIT: f64 = 1e-3;
/// Readings that agree to this fraction belong to the same flat top.
const EQUAL: f64 = 1e-6;
/// Smallest plausible range limits, rad/s and m/s^2. A flat top of a smaller signal is an effect of the resolution.
const MIN_LIMIT: (f64, f64) = (1.5, 15.0);
/// The sample before or after a clipped one is clipped for a part of its interval, if it reads at least this fraction of the limit.
const PARTLY_CLIPPED: f64 = 0.5;
/// At least this many samples at one extreme, two of them consecutive, are a flat top.
const MIN_FLAT_TOP_SAMPLES: usize = 3;

/// Axes on which a sample is clipped: the magnitude of the true value is at least that of the reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Clipped {
    /// Axes of the gyroscope.
    pub gyro: [bool; 3],
    /// Axes of the accelerometer.
    pub accel: [bool; 3],
}

impl Clipped {
    /// No axis is clipped.
    pub const NONE: Self = Self { gyro: [false; 3], accel: [false; 3] };

    /// Whether any axis of either sensor is clipped.
    pub fn any(self) -> bool {
        self != Self::NONE
    }

    /// Returns the union of the axes of both.
    pub fn or(self, other: Self) -> Self {
        let either = |a: [bool; 3], b: [bool; 3]| [0, 1, 2].map(|k| a[k] || b[k]);
        Self { gyro: either(self.gyro, other.gyro), accel: either(self.accel, other.accel) }
    }
}

/// Range limits of an IMU, from the data sheet and from the readings.
#[derive(Debug)]
pub(super) struct RangeLimits {
    gyro: [AxisExtreme; 3],
    accel: [AxisExtreme; 3],
    data_sheet: (f64, f64),
}

/// The largest magnitude read on an axis so far, and the number of times it occurred.
#[derive(Debug, Clone, Copy, Default)]
struct AxisExtreme {
    extreme: f64,
    count: usize,
    /// Whether two consecutive readings were at the extreme.
    flat: bool,
    was_at_extreme: bool,
    /// The reading before.
    last: Option<f64>,
}

impl AxisExtreme {
    /// Adds the next reading.
    fn add(&mut self, reading: f64) {
        let size = reading.abs();
        if size > self.extreme * (1.0 + EQUAL) {
            *self = Self { extreme: size, count: 1, flat: false, was_at_extreme: true, last: None };
        } else {
            let at_extreme = size >= self.extreme * (1.0 - EQUAL);
            self.count += usize::from(at_extreme);
            self.flat |= at_extreme && self.was_at_extreme;
            self.was_at_extreme = at_extreme;
        }
        self.last = Some(reading);
    }

    /// The range limit, if the readings form a flat top.
    fn limit(&self, least: f64) -> Option<f64> {
        (self.flat && self.count >= MIN_FLAT_TOP_SAMPLES && self.extreme >= least).then_some(self.extreme)
    }
}

/// The axes of `reading`, followed by `ahead`, that are at the limit `data_sheet` or at an observed one from `least` on, or next
/// to such a reading.
fn clipped_axes(
    axes: &mut [AxisExtreme; 3],
    reading: &Vector,
    ahead: &[Vector],
    data_sheet: f64,
    least: f64,
) -> [bool; 3] {
    std::array::from_fn(|k| {
        let (x, before) = (reading[k], axes[k].last);
        axes[k].add(x);
        let mut with_ahead = axes[k];
        ahead.iter().for_each(|next| with_ahead.add(next[k]));
        let shown = with_ahead.limit(least).unwrap_or(f64::INFINITY);
        let limit = ((1.0 - AT_LIMIT) * data_sheet).min((1.0 - EQUAL) * shown);
        let next = ahead.first().map(|next| next[k]);
        let neighbours = [before, next].into_iter().flatten().map(|neighbour| neighbour * x.signum());
        x.abs() >= limit || x.abs() >= PARTLY_CLIPPED * limit && neighbours.fold(0.0, f64::max) >= limit
    })
}

impl RangeLimits {
    pub(super) fn new(noise: &ImuNoise) -> Self {
        let data_sheet = (noise.gyro_limit_rad_per_s, noise.accel_limit_m_per_s2);
        Self { gyro: [AxisExtreme::default(); 3], accel: [AxisExtreme::default(); 3], data_sheet }
    }

    /// Whether the sensor can have read this specific force, m/s^2, by its data sheet.
    pub(super) fn is_in_accel_range(&self, specific_force: &Vector) -> bool {
        specific_force.iter().all(|x| x.abs() <= (1.0 + AT_LIMIT) * self.data_sheet.1)
    }

    /// The axes on which `sample`, followed by `ahead`, is clipped, at least for a part of its interval.
    pub(super) fn clipped<'a>(&mut self, sample: &ImuSample, ahead: impl Iterator<Item = &'a ImuSample>) -> Clipped {
        let readings = ahead.map(|next| (next.angular_velocity_rad_per_s, next.specific_force_m_per_s2));
        let (gyro_ahead, accel_ahead): (Vec<Vector>, Vec<Vector>) = readings.unzip();
        let (gyro, accel) = (&sample.angular_velocity_rad_per_s, &sample.specific_force_m_per_s2);
        Clipped {
            gyro: clipped_axes(&mut self.gyro, gyro, &gyro_ahead, self.data_sheet.0, MIN_LIMIT.0),
            accel: clipped_axes(&mut self.accel, accel, &accel_ahead, self.data_sheet.1, MIN_LIMIT.1),
        }
    }
}
