//! How far the IMU's clock is ahead of the fixes': where its gyroscope turns most as they do.

use super::fixes::Fixes;
use crate::estimation::EstimationError;
use crate::estimation::strapdown::Interval;
use crate::geometry::Vector;

/// Offsets are sought so far to either side, in steps of this, s.
const REACH_S: f64 = 1.0;
const STEP_S: f64 = 0.01;
/// Turns are compared over this time, s.
const TURN_S: f64 = 0.05;
/// As much of the start is looked at, s, and on until the base has turned so far in all, rad.
const WHILE_S: f64 = 60.0;
const TURNED_RAD: f64 = 5.0;
/// A base that turned less than so much in all, rad, tells no offset.
const LEAST_TURNED_RAD: f64 = 0.5;
/// Fixes that are known less well, rad, are not looked at.
const WELL_KNOWN_RAD: f64 = 0.02;
/// Least share of the fixes' turning that the gyroscope explains.
const LEAST_EXPLAINED: f64 = 0.5;

/// The offset at the start, s.
///
/// # Errors
/// When the fixes turn too little, or the gyroscope turns at no offset as they do.
pub(super) fn find(fixes: &Fixes, start_s: f64, intervals: &[Interval]) -> Result<f64, EstimationError> {
    let gyro = Turned::new(start_s, intervals);
    let turns = turns(fixes, &gyro);
    let turned_rad = turns.iter().fold(0.0, |sum, (_, turn)| sum + turn.norm());
    if turned_rad < LEAST_TURNED_RAD {
        return Err(EstimationError::Base(format!(
            "where it is well known it turns by {turned_rad:.2} rad in all, too little ({LEAST_TURNED_RAD} rad are needed) to \
             find how far its IMU's clock is ahead: `--clock-offset-ms` tells it"
        )));
    }
    let steps = (REACH_S / STEP_S).round() as i32;
    let left: Vec<f64> = (-steps..=steps).map(|k| gyro.unexplained(&turns, f64::from(k) * STEP_S)).collect();
    let best = (0..left.len()).min_by(|a, b| left[*a].total_cmp(&left[*b])).unwrap_or_default();
    if best == 0 || best + 1 == left.len() || left[best] > 1.0 - LEAST_EXPLAINED {
        return Err(EstimationError::Base(format!(
            "its IMU does not turn as it does: at no clock offset within {REACH_S} s does the gyroscope explain half of the \
             turning (at best {:.0} %, at {:.2} s); is it another recording, or does the IMU sit otherwise?",
            100.0 * (1.0 - left[best]).max(0.0),
            (best as f64 - f64::from(steps)) * STEP_S,
        )));
    }
    // The parabola through the least and its neighbours.
    let (before, least, after) = (left[best - 1], left[best], left[best + 1]);
    let beyond = 0.5 * (before - after) / (before - 2.0 * least + after);
    Ok((best as f64 - f64::from(steps) + beyond) * STEP_S)
}

/// Turns of the fixes, rotation vectors in the body, each with its start, s.
fn turns(fixes: &Fixes, gyro: &Turned) -> Vec<(f64, Vector)> {
    let (from_s, to_s) = fixes.span_s();
    let (from_s, to_s) = (from_s.max(gyro.start_s() + REACH_S), to_s.min(gyro.end_s() - REACH_S));
    let (mut turns, mut turned_rad) = (Vec::new(), 0.0);
    let mut tau_s = from_s;
    while tau_s + TURN_S < to_s && (tau_s < from_s + WHILE_S || turned_rad < TURNED_RAD) {
        let well_known = |tau_s: f64| fixes.at(tau_s).filter(|(_, sigmas)| sigmas.rotation_rad <= WELL_KNOWN_RAD);
        if let (Some((start, _)), Some((end, _))) = (well_known(tau_s), well_known(tau_s + TURN_S)) {
            let turn = (start.rotation.inverse() * end.rotation).scaled_axis();
            turned_rad += turn.norm();
            turns.push((tau_s, turn));
        }
        tau_s += TURN_S;
    }
    turns
}

/// The gyroscope's rate, summed over time.
struct Turned {
    times_s: Vec<f64>,
    sums: Vec<Vector>,
}

impl Turned {
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

    /// The share of the turns' variance that the gyroscope, `offset_s` ahead and with a bias, does not explain.
    fn unexplained(&self, turns: &[(f64, Vector)], offset_s: f64) -> f64 {
        let missing = |(tau_s, turn): &(f64, Vector)| {
            let u_s = tau_s + offset_s;
            turn - (self.at(u_s + TURN_S) - self.at(u_s))
        };
        variance(turns.iter().map(missing)) / variance(turns.iter().map(|(_, turn)| *turn))
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
