//! From IMU samples to intervals without holes: smoothed stamps, one interval about every 10 ms, gaps bridged.

use super::initial::Noisier;
use super::spec::InertialSpec;
use super::stamps::StampFilter;
use super::strapdown::Interval;
use crate::geometry::{Rotation, Vector};
use crate::measurement::{ImuNoise, ImuSample};
use std::collections::VecDeque;

/// The spacing that samples of a faster IMU are averaged to, s.
const SPACING_S: f64 = 0.01;
/// Standard deviation of a bridged interval's angular velocity, rad/s, and specific force, m/s^2: next to nothing is
/// known.
const BRIDGED: (f64, f64) = (2.0, 5.0);
/// So many means to either side of a gap tell how the head moves there.
const EDGE: usize = 5;
/// A saturated sample's noise, as a multiple: it says little more than "at least".
const SATURATED: f64 = 100.0;

/// The mean of one sample or a few, at the middle of the time they cover.
#[derive(Debug, Clone, Copy)]
struct Mean {
    centre_s: f64,
    gyro: Vector,
    accel: Vector,
    saturated: bool,
    bridged: bool,
}

/// How angular velocity and specific force go along some means: a line through them.
struct Course {
    centre_s: f64,
    gyro: (Vector, Vector),
    accel: (Vector, Vector),
}

impl Course {
    /// Of some means, at least one: value at their middle, and slope.
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

    /// Angular velocity and its slope at an instant.
    fn gyro_at(&self, t_s: f64) -> (Vector, Vector) {
        (self.gyro.0 + self.gyro.1 * (t_s - self.centre_s), self.gyro.1)
    }

    /// Specific force at an instant.
    fn accel_at(&self, t_s: f64) -> Vector {
        self.accel.0 + self.accel.1 * (t_s - self.centre_s)
    }
}

/// Turns IMU samples, in order, into intervals that follow each other without a hole.
#[derive(Debug)]
pub(super) struct InertialStream {
    filter: StampFilter,
    noise: ImuNoise,
    spec: InertialSpec,
    per_group: usize,
    group: Vec<Mean>,
    /// The last two means; the later one becomes an interval when its successor is known.
    before: Option<Mean>,
    current: Option<Mean>,
    /// The last means before a gap, if one comes.
    edge: VecDeque<Mean>,
    /// The first means behind a gap, which is bridged when enough of them tell how the head moves there.
    landed: Vec<Mean>,
    /// Where the last interval ended, IMU time.
    end_s: Option<f64>,
    saturated: usize,
}

impl InertialStream {
    pub(super) fn new(filter: StampFilter, noise: ImuNoise, spec: InertialSpec) -> Self {
        let per_group = (SPACING_S / filter.period_s()).round().max(1.0) as usize;
        Self {
            filter,
            noise,
            spec,
            per_group,
            group: Vec::new(),
            before: None,
            current: None,
            edge: VecDeque::new(),
            landed: Vec::new(),
            end_s: None,
            saturated: 0,
        }
    }

    /// The period of the samples, s.
    pub(super) fn period_s(&self) -> f64 {
        self.filter.period_s()
    }

    /// The IMU is so many times noisier than it was told.
    pub(super) fn make_noisier(&mut self, noisier: Noisier) {
        noisier.raise(&mut self.noise);
    }

    /// Samples at the end of the sensor's range since the last call.
    pub(super) fn take_saturated(&mut self) -> usize {
        std::mem::take(&mut self.saturated)
    }

    /// Forgets the samples so far: the next interval does not follow on from the last.
    pub(super) fn begin_again(&mut self) {
        self.group.clear();
        self.edge.clear();
        self.landed.clear();
        (self.before, self.current, self.end_s) = (None, None, None);
    }

    /// Takes a sample stamped `raw_s`, and appends the intervals it completes to `into`, each with its start.
    pub(super) fn push(&mut self, raw_s: f64, sample: &ImuSample, into: &mut Vec<(f64, Interval)>) {
        let (gyro, accel) = (sample.angular_velocity_rad_per_s, sample.specific_force_m_per_s2);
        // Within a thousandth of the end of the range a sample may be clipped.
        let saturated = gyro.amax() >= 0.999 * self.noise.gyro_limit_rad_per_s
            || accel.amax() >= 0.999 * self.noise.accel_limit_m_per_s2;
        self.saturated += usize::from(saturated);
        let centre_s = self.filter.smooth(raw_s);
        let period = self.filter.period_s();
        if let Some(last) = self.group.last() {
            if centre_s - last.centre_s < 0.2 * period {
                return; // the same sample twice
            }
            if centre_s - last.centre_s > 1.5 * period {
                self.close_group(into);
            }
        }
        self.group.push(Mean { centre_s, gyro, accel, saturated, bridged: false });
        if self.group.len() >= self.per_group {
            self.close_group(into);
        }
    }

    fn close_group(&mut self, into: &mut Vec<(f64, Interval)>) {
        let n = self.group.len() as f64;
        let sum = |of: fn(&Mean) -> Vector| self.group.iter().map(of).sum::<Vector>() / n;
        let mean = Mean {
            centre_s: self.group.iter().map(|m| m.centre_s).sum::<f64>() / n,
            gyro: sum(|m| m.gyro),
            accel: sum(|m| m.accel),
            saturated: self.group.iter().any(|m| m.saturated),
            bridged: false,
        };
        self.group.clear();
        self.append(mean, into);
    }

    /// Appends a mean; where there is a gap before it, after as many bridging ones as it holds.
    fn append(&mut self, mean: Mean, into: &mut Vec<(f64, Interval)>) {
        let spacing_s = self.spacing_s();
        let gap_before = |last: &Mean| mean.centre_s - last.centre_s >= 1.5 * spacing_s;
        if let Some(last) = self.landed.last() {
            if self.landed.len() < EDGE && !gap_before(last) {
                self.landed.push(mean);
                return;
            }
            self.bridge(into);
        }
        let Some(last) = self.current else {
            self.current = Some(mean);
            return;
        };
        if gap_before(&last) {
            self.landed.push(mean);
        } else if mean.centre_s - last.centre_s >= 0.2 * spacing_s {
            self.emit(mean, into);
        }
    }

    /// The spacing of means, s.
    fn spacing_s(&self) -> f64 {
        self.filter.period_s() * self.per_group as f64
    }

    /// Bridges the gap that the head has landed behind: its angular velocity by a cubic that leaves as the means before
    /// the gap go and arrives as those behind it, its specific force evenly along axes that do not turn.
    fn bridge(&mut self, into: &mut Vec<(f64, Interval)>) {
        let landed = std::mem::take(&mut self.landed);
        let (Some(last), Some(first)) = (self.current, landed.first()) else { return };
        let leaving: Vec<Mean> = self.edge.iter().copied().chain([last]).collect();
        let (from, to) = (Course::of(&leaving), Course::of(&landed));
        let gap_s = first.centre_s - last.centre_s;
        let steps = (gap_s / self.spacing_s()).round() as usize;
        let (leaves, arrives) = (from.gyro_at(last.centre_s), to.gyro_at(first.centre_s));
        let gyro = |u: f64| {
            let (h01, h10, h11) = (u * u * (3.0 - 2.0 * u), u * (1.0 - u) * (1.0 - u), u * u * (u - 1.0));
            leaves.0.lerp(&arrives.0, h01) + (leaves.1 * h10 + arrives.1 * h11) * gap_s
        };
        let mut turned = vec![Rotation::identity()];
        for step in 0..steps {
            let rate = gyro((step as f64 + 0.5) / steps as f64);
            turned.push(turned[step] * Rotation::from_scaled_axis(rate * (gap_s / steps as f64)));
        }
        let (leaves, arrives) = (from.accel_at(last.centre_s), turned[steps] * to.accel_at(first.centre_s));
        for (step, turned) in turned.iter().enumerate().take(steps).skip(1) {
            let u = step as f64 / steps as f64;
            let accel = turned.inverse() * leaves.lerp(&arrives, u);
            let centre_s = last.centre_s + u * gap_s;
            self.emit(Mean { centre_s, gyro: gyro(u), accel, saturated: false, bridged: true }, into);
        }
        landed.into_iter().for_each(|mean| self.emit(mean, into));
    }

    /// `next` is known, so that the current mean's slope and end are.
    fn emit(&mut self, next: Mean, into: &mut Vec<(f64, Interval)>) {
        let Some(now) = self.current.replace(next) else { return };
        self.edge.push_back(now);
        if self.edge.len() >= EDGE {
            self.edge.pop_front();
        }
        let before = self.before.replace(now).unwrap_or(now);
        let end = 0.5 * (now.centre_s + next.centre_s);
        let start = self.end_s.unwrap_or(2.0 * now.centre_s - end);
        self.end_s = Some(end);
        let across = next.centre_s - before.centre_s;
        into.push((
            start,
            self.interval(&now, end - start, (next.gyro - before.gyro, next.accel - before.accel), across),
        ));
    }

    fn interval(&self, now: &Mean, h: f64, differences: (Vector, Vector), across_s: f64) -> Interval {
        let spec = &self.spec;
        let white = |density: f64, scale: f64, reading: f64| {
            let noise = spec.noise_inflation * density / h.sqrt();
            (noise * noise + (scale * reading).powi(2)).sqrt()
        };
        let worse = if now.saturated { SATURATED } else { 1.0 };
        let gyro = white(self.noise.gyro_density_rad_per_s_per_sqrt_hz, spec.gyro_scale_error, now.gyro.norm());
        let accel = white(self.noise.accel_density_m_per_s2_per_sqrt_hz, spec.accel_scale_error, now.accel.norm());
        Interval {
            h,
            gyro: now.gyro,
            gyro_slope: differences.0 / across_s,
            accel: now.accel,
            accel_slope: differences.1 / across_s,
            gyro_sigma: if now.bridged { BRIDGED.0 } else { gyro * worse },
            accel_sigma: if now.bridged { BRIDGED.1 } else { accel * worse },
            bridged: now.bridged,
        }
    }
}
