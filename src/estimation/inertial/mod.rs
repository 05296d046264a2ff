//! From IMU samples to intervals without holes: smoothed stamps, one interval about every 10 ms, gaps bridged, clipped
//! readings reconstructed.

mod clipping;
mod reconstruction;
mod screen;

pub(super) use clipping::Clipped;
pub(super) use screen::{Screen, Screened};

use super::initial::Noisier;
use super::spec::InertialSpec;
use super::stamps::StampFilter;
use super::strapdown::Interval;
use crate::geometry::Vector;
use crate::measurement::{ImuNoise, ImuSample};
use reconstruction::{EDGE, bridge, reconstruct_clipped};
use std::collections::VecDeque;

/// The spacing that samples of a faster IMU are averaged to, s.
const SPACING_S: f64 = 0.01;
/// Means wait for what comes after a gap or a clipped reading, but no longer than this, s.
const WAITS_S: f64 = 1.0;
/// Standard deviation of a force where an outlier was left out: a shock may have been taken for one, m/s^2.
const OUTLIER_ACCEL: f64 = 10.0;

/// The mean of one sample or a few, at the middle of the time they cover.
#[derive(Debug, Clone, Copy)]
struct Mean {
    centre_s: f64,
    gyro: Vector,
    accel: Vector,
    /// Standard deviations beyond the sensor's noise, rad/s and m/s^2.
    gyro_doubt: f64,
    accel_doubt: f64,
    clipped: Clipped,
    /// Whether no sample was there.
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
    /// The last two means; the later one becomes an interval when its successor is known.
    before: Option<Mean>,
    current: Option<Mean>,
    /// The last means before a gap or a clipped reading, if one comes.
    edge: VecDeque<Mean>,
    /// Means from the first gap or clipped reading on, until enough good ones follow.
    waiting: Vec<Mean>,
    /// Where the last interval ended, IMU time.
    end_s: Option<f64>,
    /// An outlier was left out since the last mean.
    left_out: bool,
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
            waiting: Vec::new(),
            end_s: None,
            left_out: false,
            saturated: 0,
        }
    }

    /// The period of the samples, s.
    pub(super) fn period_s(&self) -> f64 {
        self.filter.period_s()
    }

    /// Where the last interval ended, IMU time, s.
    pub(super) fn end_s(&self) -> f64 {
        self.end_s.unwrap_or(f64::NEG_INFINITY)
    }

    /// The IMU is so many times noisier than its specification.
    pub(super) fn make_noisier(&mut self, noisier: Noisier) {
        noisier.raise(&mut self.noise);
    }

    /// Clipped samples since the last call.
    pub(super) fn take_saturated(&mut self) -> usize {
        std::mem::take(&mut self.saturated)
    }

    /// Forgets the samples so far: the next interval does not follow on from the last.
    pub(super) fn begin_again(&mut self) {
        self.group.clear();
        self.edge.clear();
        self.waiting.clear();
        (self.before, self.current, self.end_s) = (None, None, None);
    }

    /// A sample was left out as an outlier.
    pub(super) fn leave_out(&mut self) {
        self.left_out = true;
    }

    /// Takes a sample stamped `raw_s`, and appends the intervals it completes to `into`, each with its start.
    pub(super) fn push(
        &mut self,
        raw_s: f64,
        (sample, clipped): (&ImuSample, Clipped),
        into: &mut Vec<(f64, Interval)>,
    ) {
        self.saturated += usize::from(clipped.any());
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
        let (gyro, accel) = (sample.angular_velocity_rad_per_s, sample.specific_force_m_per_s2);
        self.group.push(Mean { centre_s, gyro, accel, gyro_doubt: 0.0, accel_doubt: 0.0, clipped, bridged: false });
        if self.group.len() >= self.per_group {
            self.close_group(into);
        }
    }

    /// Appends what waits to `into`: nothing follows.
    pub(super) fn flush(&mut self, into: &mut Vec<(f64, Interval)>) {
        if !self.group.is_empty() {
            self.close_group(into);
        }
        self.release(into);
    }

    fn close_group(&mut self, into: &mut Vec<(f64, Interval)>) {
        let n = self.group.len() as f64;
        let sum = |of: fn(&Mean) -> Vector| self.group.iter().map(of).sum::<Vector>() / n;
        let mean = Mean {
            centre_s: self.group.iter().map(|m| m.centre_s).sum::<f64>() / n,
            gyro: sum(|m| m.gyro),
            accel: sum(|m| m.accel),
            gyro_doubt: 0.0,
            accel_doubt: if std::mem::take(&mut self.left_out) { OUTLIER_ACCEL } else { 0.0 },
            clipped: self.group.iter().fold(Clipped::NONE, |all, m| all.or(m.clipped)),
            bridged: false,
        };
        self.group.clear();
        self.append(mean, into);
    }

    /// Appends a mean, or lets it wait where something before it is to be reconstructed.
    fn append(&mut self, mean: Mean, into: &mut Vec<(f64, Interval)>) {
        let Some(last) = self.waiting.last().or(self.current.as_ref()) else {
            self.current = Some(mean);
            return;
        };
        let since_s = mean.centre_s - last.centre_s;
        if since_s < 0.2 * self.spacing_s() {
            return; // the same again
        }
        let is_good = !mean.clipped.any() && since_s < 1.5 * self.spacing_s();
        if self.waiting.is_empty() && is_good {
            self.emit(mean, into);
            return;
        }
        self.waiting.push(mean);
        let waits_s = mean.centre_s - self.waiting[0].centre_s;
        if self.good_at_end() >= EDGE || waits_s > WAITS_S {
            self.release(into);
        }
    }

    /// How many means at the end of those that wait follow each other without a gap and without a clipped one.
    fn good_at_end(&self) -> usize {
        let gap_s = 1.5 * self.spacing_s();
        let clear = self.waiting.iter().rev().take_while(|mean| !mean.clipped.any()).count();
        let from_end = self.waiting.windows(2).rev();
        let joined = from_end.take_while(|pair| pair[1].centre_s - pair[0].centre_s < gap_s).count() + 1;
        clear.min(joined)
    }

    /// The spacing of means, s.
    fn spacing_s(&self) -> f64 {
        self.filter.period_s() * self.per_group as f64
    }

    /// Emits the means that wait, with gaps bridged and clipped readings reconstructed.
    fn release(&mut self, into: &mut Vec<(f64, Interval)>) {
        let mut means = std::mem::take(&mut self.waiting);
        if means.is_empty() {
            return;
        }
        let edge: Vec<Mean> = self.edge.iter().copied().chain(self.current).collect();
        self.reconstruct(&edge, &mut means);
        for k in 0..means.len() {
            let before = if k == 0 { self.current } else { Some(means[k - 1]) };
            let gap_s = before.map_or(0.0, |before| means[k].centre_s - before.centre_s);
            if gap_s >= 1.5 * self.spacing_s() {
                let steps = (gap_s / self.spacing_s()).round().max(2.0) as usize;
                let leaving: Vec<Mean> = edge.iter().chain(&means[..k]).copied().collect();
                let leaving = &leaving[self.joined_before(&leaving)..];
                let arriving = &means[k..k + self.joined_after(&means[k..])];
                bridge(leaving, arriving, steps).into_iter().for_each(|mean| self.emit(mean, into));
            }
            self.emit(means[k], into);
        }
    }

    /// Reconstructs each run of clipped means among `means`, which follow `edge`.
    fn reconstruct(&self, edge: &[Mean], means: &mut [Mean]) {
        let mut from = 0;
        while let Some(start) = means[from..].iter().position(|mean| mean.clipped.any()).map(|k| from + k) {
            let length = means[start..].iter().take_while(|mean| mean.clipped.any()).count();
            let leaving: Vec<Mean> = edge.iter().chain(&means[..start]).copied().collect();
            let leaving = &leaving[leaving.len().saturating_sub(EDGE)..];
            let (run, rest) = means[start..].split_at_mut(length);
            let arriving = rest.iter().take(EDGE).take_while(|mean| !mean.clipped.any()).count();
            reconstruct_clipped(leaving, run, &rest[..arriving]);
            from = start + length;
        }
    }

    /// From which of `means` on the last ones follow each other without a gap, at most [`EDGE`] of them.
    fn joined_before(&self, means: &[Mean]) -> usize {
        let gap_s = 1.5 * self.spacing_s();
        let joined = means.windows(2).rev().take_while(|pair| pair[1].centre_s - pair[0].centre_s < gap_s).count() + 1;
        means.len().saturating_sub(joined.min(EDGE))
    }

    /// How many of `means` at their beginning follow each other without a gap, at most [`EDGE`].
    fn joined_after(&self, means: &[Mean]) -> usize {
        let gap_s = 1.5 * self.spacing_s();
        let joined = means.windows(2).take_while(|pair| pair[1].centre_s - pair[0].centre_s < gap_s).count() + 1;
        joined.min(EDGE).min(means.len())
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
        let white = |density: f64, scale: f64, reading: f64, doubt: f64| {
            let noise = spec.noise_inflation * density / h.sqrt();
            (noise * noise + (scale * reading).powi(2) + doubt * doubt).sqrt()
        };
        let gyro_density = self.noise.gyro_density_rad_per_s_per_sqrt_hz;
        let accel_density = self.noise.accel_density_m_per_s2_per_sqrt_hz;
        Interval {
            h,
            gyro: now.gyro,
            gyro_slope: differences.0 / across_s,
            accel: now.accel,
            accel_slope: differences.1 / across_s,
            gyro_sigma: white(gyro_density, spec.gyro_scale_error, now.gyro.norm(), now.gyro_doubt),
            accel_sigma: white(accel_density, spec.accel_scale_error, now.accel.norm(), now.accel_doubt),
            bridged: now.bridged,
        }
    }
}
