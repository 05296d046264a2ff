//! Initial clock offset between IMU and fixes: the one at which the gyroscope best explains the rotation of the fixes.

use super::fixes::Fixes;
use crate::EstimationError;
use crate::strapdown::Interval;
use zsim_base::geometry::Vector;

/// Offsets from minus to plus this are searched, s; a larger offset must be specified.
const MAX_OFFSET_S: f64 = 1.0;
/// Step of the search, s: one sample interval at 100 Hz.
const STEP_S: f64 = 0.01;
/// Rotations are compared over intervals of this length, s.
const ROTATION_S: f64 = 0.05;
/// Length of the start of the recording that is used, s.
const START_LENGTH_S: f64 = 60.0;
/// The used part is extended until the accumulated rotation reaches this, rad.
const MIN_TOTAL_ROTATION_RAD: f64 = 5.0;
/// Minimum accumulated rotation that determines the offset, rad.
const MIN_ROTATION_RAD: f64 = 0.5;
/// Maximum standard deviation of the attitude of the fixes that are used, rad.
const MAX_SIGMA_RAD: f64 = 0.02;
/// Minimum fraction of the variance of the fixes' rotation that the gyroscope must explain.
const MIN_EXPLAINED: f64 = 0.5;

/// Finds the clock offset at the start, s.
///
/// # Errors
/// When the fixes rotate too little, or no offset makes the gyroscope match their rotation.
pub(super) fn find(fixes: &Fixes, start_s: f64, intervals: &[Interval]) -> Result<f64, EstimationError> {
    let gyro = IntegratedRate::new(start_s, intervals);
    let rotations = rotations(fixes, &gyro);
    let total_rad = rotations.iter().fold(0.0, |sum, (_, rotation)| sum + rotation.norm());
    if total_rad < MIN_ROTATION_RAD {
        return Err(EstimationError::Base(format!(
            "too little rotation to find the clock offset of the IMU: fixes with a known attitude rotate by {total_rad:.2} rad, \
             {MIN_ROTATION_RAD} rad are needed; specify `--clock-offset-ms`"
        )));
    }
    let steps = (MAX_OFFSET_S / STEP_S).round() as i32;
    let residuals: Vec<f64> =
        (-steps..=steps).map(|k| gyro.unexplained_fraction(&rotations, f64::from(k) * STEP_S)).collect();
    let best = (0..residuals.len()).min_by(|a, b| residuals[*a].total_cmp(&residuals[*b])).unwrap_or_default();
    if best == 0 || best + 1 == residuals.len() || residuals[best] > 1.0 - MIN_EXPLAINED {
        return Err(EstimationError::Base(format!(
            "the gyroscope does not match the rotation of the base: no clock offset within {MAX_OFFSET_S} s explains half of it \
             (best {:.0} %, at {:.2} s); check the recording, the topic and the pose of the IMU in the base",
            100.0 * (1.0 - residuals[best]).max(0.0),
            (best as f64 - f64::from(steps)) * STEP_S,
        )));
    }
    // Minimum of the parabola through the least residual and both neighbours.
    let (before, least, after) = (residuals[best - 1], residuals[best], residuals[best + 1]);
    let beyond = 0.5 * (before - after) / (before - 2.0 * least + after);
    Ok((best as f64 - f64::from(steps) + beyond) * STEP_S)
}

/// Rotations of the fixes: start, s, and rotation vector in IMU axes, rad.
fn rotations(fixes: &Fixes, gyro: &IntegratedRate) -> Vec<(f64, Vector)> {
    let (from_s, to_s) = fixes.span_s();
    let (from_s, to_s) = (from_s.max(gyro.start_s() + MAX_OFFSET_S), to_s.min(gyro.end_s() - MAX_OFFSET_S));
    let (mut rotations, mut total_rad) = (Vec::new(), 0.0);
    let mut tau_s = from_s;
    while tau_s + ROTATION_S < to_s && (tau_s < from_s + START_LENGTH_S || total_rad < MIN_TOTAL_ROTATION_RAD) {
        let accurate = |tau_s: f64| fixes.at(tau_s).filter(|(_, sigmas)| sigmas.rotation_rad <= MAX_SIGMA_RAD);
        if let (Some((start, _)), Some((end, _))) = (accurate(tau_s), accurate(tau_s + ROTATION_S)) {
            let rotation = (start.rotation.inverse() * end.rotation).scaled_axis();
            total_rad += rotation.norm();
            rotations.push((tau_s, rotation));
        }
        tau_s += ROTATION_S;
    }
    rotations
}

/// Cumulative integral of the gyroscope's rate.
struct IntegratedRate {
    times_s: Vec<f64>,
    sums: Vec<Vector>,
}

impl IntegratedRate {
    fn new(start_s: f64, intervals: &[Interval]) -> Self {
        let (mut times_s, mut sums) = (vec![start_s], vec![Vector::zeros()]);
        let (mut at_s, mut sum) = (start_s, Vector::zeros());
        for interval in intervals {
            at_s += interval.h;
            sum += interval.gyro * interval.h;
            times_s.push(at_s);
            sums.push(sum);
        }
        Self { times_s, sums }
    }

    fn start_s(&self) -> f64 {
        self.times_s[0]
    }

    fn end_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    fn at(&self, u_s: f64) -> Vector {
        let after = self.times_s.partition_point(|t| *t <= u_s).clamp(1, self.times_s.len().max(2) - 1);
        let (t0, t1) = (self.times_s[after - 1], self.times_s[after]);
        self.sums[after - 1].lerp(&self.sums[after], ((u_s - t0) / (t1 - t0)).clamp(0.0, 1.0))
    }

    /// Fraction of the rotations' variance that the gyroscope, with this offset and any constant bias, does not explain.
    fn unexplained_fraction(&self, rotations: &[(f64, Vector)], offset_s: f64) -> f64 {
        let missing = |(tau_s, rotation): &(f64, Vector)| {
            let u_s = tau_s + offset_s;
            rotation - (self.at(u_s + ROTATION_S) - self.at(u_s))
        };
        variance(rotations.iter().map(missing)) / variance(rotations.iter().map(|(_, rotation)| *rotation))
    }
}

fn variance(vectors: impl Iterator<Item = Vector>) -> f64 {
    let (mut count, mut sum, mut squares) = (0.0, Vector::zeros(), 0.0);
    for vector in vectors {
        count += 1.0;
        sum += vector;
        squares += vector.norm_squared();
    }
    squares / count - (sum / count).norm_squared()
}
