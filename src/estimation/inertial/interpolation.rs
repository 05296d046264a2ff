//! Cubic interpolation between IMU readings, and its measured error.

use super::Mean;
use zsim_base::geometry::Vector;

/// Initial interpolation error as a multiple of the squared gap, rad/s and m/s^2 per s^2: a head that rocks by 5 rad/s
/// at 1.2 Hz.
const INITIAL_ERROR_PER_S2: (f64, f64) = (20.0, 100.0);
/// Weight of a new measurement of the interpolation error: the error is a mean over about 30 samples.
const NEW_ERROR_WEIGHT: f64 = 1.0 / 30.0;

/// Error of the cubic interpolation, measured by leaving out one reading at a time, and scaled with the squared gap.
///
/// A smooth motion errs by a higher power of the gap; the square is on the safe side for gaps shorter than those measured.
#[derive(Debug)]
pub(super) struct InterpolationError {
    /// Mean squared error over the squared gap, (rad/s/s^2)^2 and (m/s^2/s^2)^2.
    error2: (f64, f64),
}

impl InterpolationError {
    pub(super) fn new() -> Self {
        let (gyro, accel) = INITIAL_ERROR_PER_S2;
        Self { error2: (gyro * gyro, accel * accel) }
    }

    /// Compares the third of five consecutive readings with the interpolation between its neighbours.
    pub(super) fn measure(&mut self, [first, from, middle, to, last]: &[Mean; 5]) {
        let is_clipped = [first, from, middle, to, last].iter().any(|mean| mean.clipped.any());
        let gap_s = to.centre_s - from.centre_s;
        if is_clipped || gap_s <= 0.0 {
            return;
        }
        let slopes = [slope(Some(first), from, Some(to)), slope(Some(from), to, Some(last))];
        let (gyro, accel) = between(from, to, &slopes, (middle.centre_s - from.centre_s) / gap_s);
        let take = |mean: &mut f64, error: &Vector| {
            *mean += NEW_ERROR_WEIGHT * (error.norm_squared() / 3.0 / gap_s.powi(4) - *mean);
        };
        take(&mut self.error2.0, &(gyro - middle.gyro));
        take(&mut self.error2.1, &(accel - middle.accel));
    }

    /// Standard deviations of the means that bridge a gap in `steps` steps, rad/s and m/s^2.
    ///
    /// The errors within a gap have one sign: together they count as one.
    pub(super) fn sigmas(&self, gap_s: f64, steps: f64) -> (f64, f64) {
        let sigma = |error2: f64| (error2 * steps).sqrt() * gap_s * gap_s;
        (sigma(self.error2.0), sigma(self.error2.1))
    }
}

/// Slopes of angular velocity, rad/s^2, and specific force, m/s^3.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slopes {
    gyro: Vector,
    accel: Vector,
}

/// Cubic Hermite interpolation between two values with slopes, at `u` in 0..1.
pub(super) fn hermite(from: (Vector, Vector), to: (Vector, Vector), length_s: f64, u: f64) -> Vector {
    let (h01, h10, h11) = (u * u * (3.0 - 2.0 * u), u * (1.0 - u) * (1.0 - u), u * u * (u - 1.0));
    from.0.lerp(&to.0, h01) + (from.1 * h10 + to.1 * h11) * length_s
}

/// Slopes of angular velocity and specific force at `at`: the parabola through it and its neighbours.
pub(super) fn slope(before: Option<&Mean>, at: &Mean, after: Option<&Mean>) -> Slopes {
    let chord = |a: &Mean, b: &Mean| {
        let h = b.centre_s - a.centre_s;
        ((b.gyro - a.gyro) / h, (b.accel - a.accel) / h, h)
    };
    match (before.map(|before| chord(before, at)), after.map(|after| chord(at, after))) {
        (Some((g0, a0, h0)), Some((g1, a1, h1))) => {
            let share = h1 / (h0 + h1);
            Slopes { gyro: g0 * share + g1 * (1.0 - share), accel: a0 * share + a1 * (1.0 - share) }
        }
        (Some((gyro, accel, _)), None) | (None, Some((gyro, accel, _))) => Slopes { gyro, accel },
        (None, None) => Slopes { gyro: Vector::zeros(), accel: Vector::zeros() },
    }
}

/// Angular velocity and specific force `u` of the way between two readings with their slopes, `u` from 0 to 1.
pub(super) fn between(from: &Mean, to: &Mean, slopes: &[Slopes; 2], u: f64) -> (Vector, Vector) {
    let [leaving, arriving] = slopes;
    let gap_s = to.centre_s - from.centre_s;
    let cubic = |from, to| hermite(from, to, gap_s, u);
    let gyro = cubic((from.gyro, leaving.gyro), (to.gyro, arriving.gyro));
    (gyro, cubic((from.accel, leaving.accel), (to.accel, arriving.accel)))
}
