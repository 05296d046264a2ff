//! Interpolates IMU readings across gaps and reconstructs clipped axes.

use super::Mean;
use super::clipping::Clipped;
use super::interpolation::{InterpolationError, hermite, slope};
use crate::geometry::{Rotation, Vector};

/// Number of means on each side of a gap to which a line is fitted.
pub(super) const FIT_MEANS: usize = 5;
/// Standard deviation of a bridged mean per squared gap length, rad/s and m/s^2 per s^2.
///
/// The interpolation error is an eighth of the second derivative times the squared gap; a head that rocks with 5 rad/s
/// at 1.2 Hz has 280 rad/s^3.
const BRIDGED_SIGMA_PER_S2: (f64, f64) = (120.0, 300.0);
/// Upper limit of the standard deviation of a bridged mean, rad/s and m/s^2.
const MAX_BRIDGED_SIGMA: (f64, f64) = (2.0, 5.0);
/// Shorter gaps are bridged by a cubic through two readings on each side, s: fitted lines are less accurate.
const SHORT_GAP_S: f64 = 0.045;
/// Standard deviation of a reconstructed angular velocity: fraction of the excess over the limit, plus fraction of the
/// limit.
const CLIPPED_GYRO_SIGMA: (f64, f64) = (0.5, 0.02);
/// Standard deviation of a clipped specific force, as a fraction of the limit: the size of a shock is unknown.
const CLIPPED_ACCEL_SIGMA: f64 = 1.0;
/// Mild clipping of the specific force, which is reconstructed: maximum duration, s; maximum reconstruction as a
/// multiple of the limit; standard deviation as a fraction of the excess over the limit.
///
/// Such a motion is slightly too fast for the range, in contrast to a shock.
const MILD_CLIPPING: (f64, f64, f64) = (0.3, 1.3, 0.5);

/// Straight lines fitted to angular velocity and specific force: value at `centre_s` and slope.
struct LineFit {
    centre_s: f64,
    gyro: (Vector, Vector),
    accel: (Vector, Vector),
}

impl LineFit {
    /// Least-squares lines through at least one mean.
    fn through(means: &[Mean]) -> Self {
        let count = means.len() as f64;
        let centre_s = means.iter().map(|mean| mean.centre_s).sum::<f64>() / count;
        let spread: f64 = means.iter().map(|mean| (mean.centre_s - centre_s).powi(2)).sum();
        let line = |of: fn(&Mean) -> Vector| {
            let value = means.iter().map(of).sum::<Vector>() / count;
            let moment: Vector = means.iter().map(|mean| of(mean) * (mean.centre_s - centre_s)).sum();
            (value, if spread > 0.0 { moment / spread } else { Vector::zeros() })
        };
        Self { centre_s, gyro: line(|mean| mean.gyro), accel: line(|mean| mean.accel) }
    }

    /// Angular velocity and its slope at a time.
    fn gyro_at(&self, t_s: f64) -> (Vector, Vector) {
        (self.gyro.0 + self.gyro.1 * (t_s - self.centre_s), self.gyro.1)
    }

    /// Specific force and its slope at a time.
    fn accel_at(&self, t_s: f64) -> (Vector, Vector) {
        (self.accel.0 + self.accel.1 * (t_s - self.centre_s), self.accel.1)
    }
}

/// Angular velocity and specific force at both ends of a gap, each with its slope.
type Ends = (((Vector, Vector), (Vector, Vector)), ((Vector, Vector), (Vector, Vector)));

/// The readings at both ends, with the slopes of parabolas through their neighbours.
fn cubic_ends(before: &[Mean], after: &[Mean]) -> Ends {
    let (last, first) = (&before[before.len() - 1], &after[0]);
    let earlier = before.len().checked_sub(2).map(|k| &before[k]);
    let (leaves, arrives) = (slope(earlier, last, Some(first)), slope(Some(last), first, after.get(1)));
    (((last.gyro, leaves.0), (first.gyro, arrives.0)), ((last.accel, leaves.1), (first.accel, arrives.1)))
}

/// Lines fitted to the readings on both sides, at the ends.
fn fitted_ends(before: &[Mean], after: &[Mean]) -> Ends {
    let (last_s, first_s) = (before[before.len() - 1].centre_s, after[0].centre_s);
    let (leaving, arriving) = (LineFit::through(before), LineFit::through(after));
    ((leaving.gyro_at(last_s), arriving.gyro_at(first_s)), (leaving.accel_at(last_s), arriving.accel_at(first_s)))
}

/// The `steps - 1` means that bridge the gap between the last of `before` and the first of `after`.
///
/// Short gaps are bridged by a cubic with the slopes at both ends; `error` is the measured error of that interpolation.
/// In longer ones the angular velocity is a cubic with fitted slopes, and the specific force is linear in a frame that
/// does not rotate.
pub(super) fn bridge(before: &[Mean], after: &[Mean], steps: usize, error: &InterpolationError) -> Vec<Mean> {
    let (Some(last), Some(first)) = (before.last(), after.first()) else { return Vec::new() };
    let gap_s = first.centre_s - last.centre_s;
    let is_short = gap_s < SHORT_GAP_S;
    let ends = if is_short { cubic_ends(before, after) } else { fitted_ends(before, after) };
    let ((leaves, arrives), (force_leaves, force_arrives)) = ends;
    let mut turned = vec![Rotation::identity()];
    for step in 0..steps {
        let rate = hermite(leaves, arrives, gap_s, (step as f64 + 0.5) / steps as f64);
        turned.push(turned[step] * Rotation::from_scaled_axis(rate * (gap_s / steps as f64)));
    }
    // The cubic of the force is that in the frame of the head, for the short gaps in which it hardly rotates.
    let force_at = |step: usize, u: f64| {
        if is_short {
            return hermite(force_leaves, force_arrives, gap_s, u);
        }
        turned[step].inverse() * force_leaves.0.lerp(&(turned[steps] * force_arrives.0), u)
    };
    let (gyro_sigma, accel_sigma) = error.sigmas(gap_s, steps as f64);
    let (curvature_gyro, curvature_accel) = if is_short {
        (0.0, 0.0)
    } else {
        (BRIDGED_SIGMA_PER_S2.0 * gap_s * gap_s, BRIDGED_SIGMA_PER_S2.1 * gap_s * gap_s)
    };
    let extra_gyro_sigma = gyro_sigma.max(curvature_gyro).min(MAX_BRIDGED_SIGMA.0);
    let extra_accel_sigma = accel_sigma.max(curvature_accel).min(MAX_BRIDGED_SIGMA.1);
    let means = (1..steps).map(|step| {
        let u = step as f64 / steps as f64;
        Mean {
            centre_s: last.centre_s + u * gap_s,
            gyro: hermite(leaves, arrives, gap_s, u),
            accel: force_at(step, u),
            extra_gyro_sigma,
            extra_accel_sigma,
            clipped: Clipped::NONE,
            bridged: true,
        }
    });
    means.collect()
}

/// Reconstructs the clipped axes of consecutive means by interpolation between `before` and `after`.
///
/// The magnitude of the result is at least the reading, which is the limit of the range.
pub(super) fn reconstruct_clipped(before: &[Mean], run: &mut [Mean], after: &[Mean]) {
    if before.is_empty() || after.is_empty() {
        // Without data on both sides the readings stay, with the standard deviation of a shock.
        for mean in run.iter_mut() {
            mean.extra_gyro_sigma = mean.extra_gyro_sigma.max(0.5 * largest_clipped(&mean.gyro, &mean.clipped.gyro));
            mean.extra_accel_sigma =
                mean.extra_accel_sigma.max(CLIPPED_ACCEL_SIGMA * largest_clipped(&mean.accel, &mean.clipped.accel));
        }
        return;
    }
    let (leaving, arriving) = (LineFit::through(before), LineFit::through(after));
    let (from_s, to_s) = (before[before.len() - 1].centre_s, after[0].centre_s);
    let length_s = to_s - from_s;
    let gyro_ends = (leaving.gyro_at(from_s), arriving.gyro_at(to_s));
    let accel_ends = (leaving.accel_at(from_s), arriving.accel_at(to_s));
    for mean in run {
        let u = ((mean.centre_s - from_s) / length_s).clamp(0.0, 1.0);
        let gyro = hermite(gyro_ends.0, gyro_ends.1, length_s, u);
        let accel = hermite(accel_ends.0, accel_ends.1, length_s, u);
        for axis in 0..3 {
            if mean.clipped.gyro[axis] {
                let limit = mean.gyro[axis].abs();
                mean.gyro[axis] = bounded(mean.gyro[axis], gyro[axis], 2.0);
                let excess = mean.gyro[axis].abs() - limit;
                mean.extra_gyro_sigma =
                    mean.extra_gyro_sigma.max(CLIPPED_GYRO_SIGMA.0 * excess + CLIPPED_GYRO_SIGMA.1 * limit);
            }
            if mean.clipped.accel[axis] {
                let limit = mean.accel[axis].abs();
                let (max_duration_s, max_ratio, fraction) = MILD_CLIPPING;
                let expected = bounded(mean.accel[axis], accel[axis], max_ratio);
                let excess = expected.abs() - limit;
                let is_mild = length_s < max_duration_s && accel[axis].abs() < max_ratio * limit && excess > 0.0;
                mean.accel[axis] = if is_mild { expected } else { mean.accel[axis] };
                let sigma = if is_mild { fraction * excess + 0.05 * limit } else { CLIPPED_ACCEL_SIGMA * limit };
                mean.extra_accel_sigma = mean.extra_accel_sigma.max(sigma);
            }
        }
    }
}

/// `expected`, with the sign of `read` and a magnitude of 1 to `max_ratio` times that of `read`.
fn bounded(read: f64, expected: f64, max_ratio: f64) -> f64 {
    let along = expected * read.signum();
    read.signum() * along.clamp(read.abs(), max_ratio * read.abs())
}

fn largest_clipped(reading: &Vector, clipped: &[bool; 3]) -> f64 {
    (0..3).filter(|axis| clipped[*axis]).map(|axis| reading[axis].abs()).fold(0.0, f64::max)
}
