//! Reconstructs what an IMU did not measure: gaps between its samples, and axes at the end of their range.

use super::Mean;
use super::clipping::Clipped;
use crate::geometry::{Rotation, Vector};

/// So many means to either side of a gap give the course of the readings there.
pub(super) const EDGE: usize = 5;
/// Standard deviation of a bridged mean as a multiple of the squared gap, rad/s and m/s^2 per s^2, and at most.
///
/// Interpolation errs by an eighth of the second derivative times the squared gap: a head that rocks by 5 rad/s at 1.2
/// Hz has 280 rad/s^3.
const BRIDGED_PER_S2: (f64, f64) = (120.0, 300.0);
const BRIDGED_AT_MOST: (f64, f64) = (2.0, 5.0);
/// Gaps shorter than this are bridged by straight lines: the slopes at their ends are known less well than the chord,
/// s.
const SHORT_S: f64 = 0.045;
/// A clipped angular velocity is known to this fraction of what the reconstruction is beyond the limit, and at least,
/// to this fraction of the limit.
const CLIPPED_GYRO: (f64, f64) = (0.5, 0.02);
/// A clipped force is known to this fraction of the limit: a shock can be of any size.
const CLIPPED_ACCEL: f64 = 1.0;
/// Clipped for no longer than this, s, and reconstructed to less than this multiple of the limit, a force is that of a
/// motion that is a little too fast for the range, and known to the fraction of its excess.
const MILD_ACCEL: (f64, f64, f64) = (0.3, 1.3, 0.5);

/// Angular velocity and specific force along some means: a line through each.
struct Course {
    centre_s: f64,
    gyro: (Vector, Vector),
    accel: (Vector, Vector),
}

impl Course {
    /// Of at least one mean: value at their middle, and slope.
    fn of(means: &[Mean]) -> Self {
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

/// A cubic between two values with their slopes, `u` of the way from 0 to 1.
fn hermite(from: (Vector, Vector), to: (Vector, Vector), length_s: f64, u: f64) -> Vector {
    let (h01, h10, h11) = (u * u * (3.0 - 2.0 * u), u * (1.0 - u) * (1.0 - u), u * u * (u - 1.0));
    from.0.lerp(&to.0, h01) + (from.1 * h10 + to.1 * h11) * length_s
}

/// The means that bridge the gap between the last of `before` and the first of `after`, `steps` of them less one.
///
/// The angular velocity is a cubic that leaves as the means before the gap go and arrives as those after it, the
/// specific force is linear along axes that do not turn.
pub(super) fn bridge(before: &[Mean], after: &[Mean], steps: usize) -> Vec<Mean> {
    let (Some(last), Some(first)) = (before.last(), after.first()) else { return Vec::new() };
    let gap_s = first.centre_s - last.centre_s;
    let (leaves, arrives) = if gap_s < SHORT_S {
        let chord = (first.gyro - last.gyro) / gap_s;
        ((last.gyro, chord), (first.gyro, chord))
    } else {
        (Course::of(before).gyro_at(last.centre_s), Course::of(after).gyro_at(first.centre_s))
    };
    let mut turned = vec![Rotation::identity()];
    for step in 0..steps {
        let rate = hermite(leaves, arrives, gap_s, (step as f64 + 0.5) / steps as f64);
        turned.push(turned[step] * Rotation::from_scaled_axis(rate * (gap_s / steps as f64)));
    }
    let (force_leaves, force_arrives) = if gap_s < SHORT_S {
        (last.accel, first.accel)
    } else {
        (Course::of(before).accel_at(last.centre_s).0, Course::of(after).accel_at(first.centre_s).0)
    };
    let force_arrives = turned[steps] * force_arrives;
    let gap2 = gap_s * gap_s;
    let gyro_doubt = (BRIDGED_PER_S2.0 * gap2).min(BRIDGED_AT_MOST.0);
    let accel_doubt = (BRIDGED_PER_S2.1 * gap2).min(BRIDGED_AT_MOST.1);
    let means = (1..steps).map(|step| {
        let u = step as f64 / steps as f64;
        Mean {
            centre_s: last.centre_s + u * gap_s,
            gyro: hermite(leaves, arrives, gap_s, u),
            accel: turned[step].inverse() * force_leaves.lerp(&force_arrives, u),
            gyro_doubt,
            accel_doubt,
            clipped: Clipped::NONE,
            bridged: true,
        }
    });
    means.collect()
}

/// Replaces what is clipped in `run`, whose means follow each other, by what their neighbours `before` and `after` let
/// expect, never less than the limit that was read.
pub(super) fn reconstruct_clipped(before: &[Mean], run: &mut [Mean], after: &[Mean]) {
    if before.is_empty() || after.is_empty() {
        // Nothing on one side: the readings stay, and are doubted as much as a shock.
        for mean in run.iter_mut() {
            mean.gyro_doubt = mean.gyro_doubt.max(0.5 * largest_clipped(&mean.gyro, &mean.clipped.gyro));
            mean.accel_doubt = mean.accel_doubt.max(CLIPPED_ACCEL * largest_clipped(&mean.accel, &mean.clipped.accel));
        }
        return;
    }
    let (leaving, arriving) = (Course::of(before), Course::of(after));
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
                mean.gyro[axis] = at_least(mean.gyro[axis], gyro[axis], 2.0);
                let excess = mean.gyro[axis].abs() - limit;
                mean.gyro_doubt = mean.gyro_doubt.max(CLIPPED_GYRO.0 * excess + CLIPPED_GYRO.1 * limit);
            }
            if mean.clipped.accel[axis] {
                let limit = mean.accel[axis].abs();
                let (lasts_s, times, share) = MILD_ACCEL;
                let expected = at_least(mean.accel[axis], accel[axis], times);
                let excess = expected.abs() - limit;
                let is_mild = length_s < lasts_s && accel[axis].abs() < times * limit && excess > 0.0;
                mean.accel[axis] = if is_mild { expected } else { mean.accel[axis] };
                let doubt = if is_mild { share * excess + 0.05 * limit } else { CLIPPED_ACCEL * limit };
                mean.accel_doubt = mean.accel_doubt.max(doubt);
            }
        }
    }
}

/// `expected`, but no less than `read` on its side of zero, and no more than `times` as much.
fn at_least(read: f64, expected: f64, times: f64) -> f64 {
    let beyond = expected * read.signum();
    read.signum() * beyond.clamp(read.abs(), times * read.abs())
}

fn largest_clipped(reading: &Vector, clipped: &[bool; 3]) -> f64 {
    (0..3).filter(|axis| clipped[*axis]).map(|axis| reading[axis].abs()).fold(0.0, f64::max)
}
