//! Interpolates IMU readings across gaps and reconstructs clipped axes.

use super::Mean;
use super::clipping::Clipped;
use super::interpolation::{InterpolationError, between, hermite, slope};
use zsim_base::geometry::{Rotation, Vector};

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

/// The `steps - 1` means that bridge the gap between the last of `before` and the first of `after`.
///
/// `error` is the measured error of the cubic interpolation, a lower limit for longer gaps.
pub(super) fn bridge(before: &[Mean], after: &[Mean], steps: usize, error: &InterpolationError) -> Vec<Mean> {
    let (Some(last), Some(first)) = (before.last(), after.first()) else { return Vec::new() };
    let gap_s = first.centre_s - last.centre_s;
    let (gyro_sigma, accel_sigma) = error.sigmas(gap_s, steps as f64);
    let (readings, sigmas) = if gap_s < SHORT_GAP_S {
        (cubic(before, after, steps), (gyro_sigma, accel_sigma))
    } else {
        let of_curvature = |per_s2: f64| per_s2 * gap_s * gap_s;
        let (gyro, accel) = (of_curvature(BRIDGED_SIGMA_PER_S2.0), of_curvature(BRIDGED_SIGMA_PER_S2.1));
        (between_lines(before, after, steps), (gyro_sigma.max(gyro), accel_sigma.max(accel)))
    };
    let mean = |(step, (gyro, accel)): (usize, (Vector, Vector))| Mean {
        centre_s: last.centre_s + step as f64 / steps as f64 * gap_s,
        gyro,
        accel,
        extra_gyro_sigma: sigmas.0.min(MAX_BRIDGED_SIGMA.0),
        extra_accel_sigma: sigmas.1.min(MAX_BRIDGED_SIGMA.1),
        clipped: Clipped::NONE,
        bridged: true,
    };
    (1..steps).zip(readings).map(mean).collect()
}

/// Angular velocity and specific force in a short gap: a cubic through two readings on each side.
///
/// In such a gap the head hardly rotates: the force is interpolated in its frame.
fn cubic(before: &[Mean], after: &[Mean], steps: usize) -> Vec<(Vector, Vector)> {
    let (last, first) = (&before[before.len() - 1], &after[0]);
    let earlier = before.len().checked_sub(2).map(|k| &before[k]);
    let slopes = [slope(earlier, last, Some(first)), slope(Some(last), first, after.get(1))];
    (1..steps).map(|step| between(last, first, &slopes, step as f64 / steps as f64)).collect()
}

/// Angular velocity and specific force in a longer gap, from lines fitted to the readings on both sides.
///
/// The angular velocity is a cubic with the slopes of the lines; the specific force is linear in a frame that does not
/// rotate.
fn between_lines(before: &[Mean], after: &[Mean], steps: usize) -> Vec<(Vector, Vector)> {
    let (from_s, to_s) = (before[before.len() - 1].centre_s, after[0].centre_s);
    let gap_s = to_s - from_s;
    let (leaving, arriving) = (LineFit::through(before), LineFit::through(after));
    let gyro_at = |u: f64| hermite(leaving.gyro_at(from_s), arriving.gyro_at(to_s), gap_s, u);
    let mut turned = vec![Rotation::identity()];
    for step in 0..steps {
        let rate = gyro_at((step as f64 + 0.5) / steps as f64);
        turned.push(turned[step] * Rotation::from_scaled_axis(rate * (gap_s / steps as f64)));
    }
    let (force_leaves, force_arrives) = (leaving.accel_at(from_s).0, turned[steps] * arriving.accel_at(to_s).0);
    let reading = |step: usize| {
        let u = step as f64 / steps as f64;
        (gyro_at(u), turned[step].inverse() * force_leaves.lerp(&force_arrives, u))
    };
    (1..steps).map(reading).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Angular velocity and specific force of a head on a trotting robot: a swing at 1.2 Hz and impacts at 12.8 Hz.
    fn mean(centre_s: f64) -> Mean {
        let (swing, impact) = (7.5 * centre_s, 80.4 * centre_s);
        Mean {
            centre_s,
            gyro: Vector::new(2.0 * swing.cos(), 0.1 * impact.sin(), 0.1),
            accel: Vector::new(3.0 * swing.sin(), 0.5, 9.8 + 1.9 * impact.cos()),
            extra_gyro_sigma: 0.0,
            extra_accel_sigma: 0.0,
            clipped: Clipped::NONE,
            bridged: false,
        }
    }

    /// Means at 100 Hz.
    fn means(count: usize) -> Vec<Mean> {
        (0..count).map(|k| mean(k as f64 * 0.01)).collect()
    }

    /// Error of the interpolation, learned from `means`.
    fn measured(means: &[Mean]) -> InterpolationError {
        let mut error = InterpolationError::new();
        means.windows(5).for_each(|five| error.measure(five.try_into().unwrap()));
        error
    }

    #[test]
    fn a_lost_sample_is_interpolated_to_the_error_claimed_and_better_than_by_a_line() {
        let means = means(300);
        let error = measured(&means);
        let (mut squares, mut squares_of_line, mut claimed) = (0.0, 0.0, 0.0);
        for lost in 100..200 {
            let [bridged] = bridge(&means[..lost], &means[lost + 1..], 2, &error)[..] else { panic!("one mean") };
            let line = 0.5 * (means[lost - 1].accel + means[lost + 1].accel);
            squares += (bridged.accel - means[lost].accel).norm_squared() / 300.0;
            squares_of_line += (line - means[lost].accel).norm_squared() / 300.0;
            claimed += bridged.extra_accel_sigma.powi(2) / 100.0;
        }
        // Relative errors at 80.4 rad/s and 10 ms by theory: 1 - (4 cos x - cos 2x) / 3 = 0.062 and 1 - cos x = 0.307 at
        // x = 0.804.
        let ratio = (squares / squares_of_line).sqrt();
        assert!((ratio - 0.062 / 0.307).abs() < 0.02, "{ratio}");
        // Two steps share one error, so that a mean claims the root of two times it.
        let claim = (claimed / squares).sqrt();
        assert!((claim - 2.0_f64.sqrt()).abs() < 0.3, "{claim}");
    }

    #[test]
    fn a_longer_gap_claims_at_least_the_error_of_the_curvature() {
        let means = means(300);
        let error = measured(&means);
        let (before, after) = (&means[..100], &means[109..]);
        let bridged = bridge(&before[95..], &after[..FIT_MEANS], 10, &error);
        assert_eq!(bridged.len(), 9);
        assert!(bridged.iter().all(|mean| mean.bridged && mean.extra_gyro_sigma >= 120.0 * 0.01 * 0.999));
    }
}
