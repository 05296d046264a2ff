//! From IMU samples to intervals without holes: smoothed stamps, one interval about every 10 ms, gaps bridged.

use super::initial::Noisier;
use super::spec::InertialSpec;
use super::stamps::StampFilter;
use super::strapdown::Interval;
use crate::geometry::Vector;
use crate::measurement::{ImuNoise, ImuSample};

/// The spacing that samples of a faster IMU are averaged to, s.
const SPACING_S: f64 = 0.01;
/// Standard deviation of a bridged interval's angular velocity, rad/s, and specific force, m/s^2: next to nothing is known.
const BRIDGED: (f64, f64) = (2.0, 5.0);
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

/// Turns IMU samples, in order, into intervals that follow each other without a hole.
#[derive(Debug)]
pub(super) struct InertialStream {
    filter: StampFilter,
    noise: ImuNoise,
    spec: InertialSpec,
    per_group: usize,
    group: Vec<Mean>,
    /// The last two means; the earlier one becomes an interval when its successor is known.
    before: Option<Mean>,
    current: Option<Mean>,
    /// Where the last interval ended, IMU time.
    end_s: Option<f64>,
    saturated: usize,
}

impl InertialStream {
    pub(super) fn new(filter: StampFilter, noise: ImuNoise, spec: InertialSpec) -> Self {
        let per_group = (SPACING_S / filter.period_s()).round().max(1.0) as usize;
        let (before, current, end_s) = (None, None, None);
        Self { filter, noise, spec, per_group, group: Vec::new(), before, current, end_s, saturated: 0 }
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

    /// Appends a mean, after as many bridging ones as a gap before it holds.
    fn append(&mut self, mean: Mean, into: &mut Vec<(f64, Interval)>) {
        let spacing = self.filter.period_s() * self.per_group as f64;
        let Some(last) = self.current else {
            self.current = Some(mean);
            return;
        };
        let gap = mean.centre_s - last.centre_s;
        if gap < 0.2 * spacing {
            return;
        }
        let steps = (gap / spacing).round().max(1.0);
        for step in 1..steps as usize {
            let u = step as f64 / steps;
            let bridge = Mean {
                centre_s: last.centre_s + u * gap,
                gyro: last.gyro.lerp(&mean.gyro, u),
                accel: last.accel.lerp(&mean.accel, u),
                saturated: false,
                bridged: true,
            };
            self.emit(bridge, into);
        }
        self.emit(mean, into);
    }

    /// `next` is known, so that the current mean's slope and end are.
    fn emit(&mut self, next: Mean, into: &mut Vec<(f64, Interval)>) {
        let Some(now) = self.current.replace(next) else { return };
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
