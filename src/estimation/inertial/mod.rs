//! Converts IMU samples to contiguous intervals of about 10 ms.
//!
//! Stamps are smoothed, samples of a fast IMU are averaged, gaps are bridged, and clipped readings are reconstructed.

mod averaging;
mod clipping;
mod interpolation;
mod mean;
mod recent_motion;
mod reconstruction;
mod resampling;
mod screen;

pub(super) use clipping::Clipped;
use mean::{Mean, SPACING_S};
pub(super) use screen::{Screen, Screened};

use super::initial::NoiseFactors;
use super::spec::InertialSpec;
use super::stamps::StampFilter;
use super::strapdown::Interval;
use averaging::{Compensation, Neighbours};
use interpolation::InterpolationError;
use recent_motion::RecentMotion;
use reconstruction::{FIT_MEANS, bridge, reconstruct_clipped};
use resampling::Resampler;
use std::collections::VecDeque;
use zsim_base::geometry::Vector;
use zsim_base::measurement::{ImuAveraging, ImuNoise, ImuSample};

/// A shorter gap of a sensor with a period is bridged whatever the motion, s.
const SHORT_GAP_S: f64 = 0.13;
/// A longer gap is bridged if the attitude after it errs by less, rad.
const MAX_BRIDGING_ERROR_RAD: f64 = 0.1;
/// Maximum time to wait for valid samples after a gap or a clipped reading, s; bounds the latency.
const MAX_WAIT_S: f64 = 1.0;
/// Extra standard deviation of the specific force where a possible shock was discarded, m/s^2.
const SHOCK_ACCEL: f64 = 10.0;

/// Converts ordered IMU samples to contiguous intervals.
#[derive(Debug)]
pub(super) struct InertialStream {
    filter: StampFilter,
    noise: ImuNoise,
    spec: InertialSpec,
    /// Number of samples in a mean.
    per_group: usize,
    compensation: Compensation,
    /// Present for an irregular sensor.
    resampler: Option<Resampler>,
    group: Vec<Mean>,
    /// The last mean, which becomes an interval when the next mean is known.
    current: Option<Mean>,
    /// Error of the interpolation of a missing mean.
    bridging_error: InterpolationError,
    recent_motion: RecentMotion,
    /// The means before the current one; a line through them predicts the motion into a gap or clipping.
    last_valid: VecDeque<Mean>,
    /// Means from the first gap or clipped reading on, until enough valid ones follow.
    waiting: Vec<Mean>,
    /// End of the last interval, IMU time, s.
    end_s: Option<f64>,
    /// Whether a sample was discarded since the last mean that may have measured a shock.
    possible_shock: bool,
    /// Number of clipped samples since the last query.
    saturated: usize,
}

impl InertialStream {
    pub(super) fn new(filter: StampFilter, noise: ImuNoise, averaging: ImuAveraging, spec: InertialSpec) -> Self {
        let is_irregular = filter.is_irregular();
        let per_group = if is_irregular { 1 } else { (SPACING_S / filter.period_s()).round().max(1.0) as usize };
        Self {
            filter,
            noise,
            spec,
            per_group,
            compensation: Compensation::of(averaging, per_group, is_irregular),
            resampler: is_irregular.then(Resampler::new),
            group: Vec::new(),
            current: None,
            bridging_error: InterpolationError::new(),
            recent_motion: RecentMotion::default(),
            last_valid: VecDeque::new(),
            waiting: Vec::new(),
            end_s: None,
            possible_shock: false,
            saturated: 0,
        }
    }

    /// Sampling period, s.
    pub(super) fn period_s(&self) -> f64 {
        self.filter.period_s()
    }

    /// End of the last interval, IMU time, s.
    pub(super) fn end_s(&self) -> f64 {
        self.end_s.unwrap_or(f64::NEG_INFINITY)
    }

    /// Multiplies the assumed IMU noise by factors.
    pub(super) fn raise_noise(&mut self, factors: NoiseFactors) {
        factors.scale_noise(&mut self.noise);
    }

    /// Number of clipped samples since the last call.
    pub(super) fn take_saturated(&mut self) -> usize {
        std::mem::take(&mut self.saturated)
    }

    /// Whether a gap of the current motion can be bridged: a trial of the motion before it decides, if it is not short.
    pub(super) fn can_bridge(&self, gap_s: f64) -> bool {
        let error_rad = || self.recent_motion.bridging_error_rad(gap_s, self.spacing_s());
        self.resampler.is_some()
            || gap_s < SHORT_GAP_S
            || error_rad().is_some_and(|error| error < MAX_BRIDGING_ERROR_RAD)
    }

    /// Discards the samples so far; the next interval does not continue the last one.
    pub(super) fn restart(&mut self) {
        self.group.clear();
        self.recent_motion.clear();
        self.last_valid.clear();
        self.waiting.clear();
        self.resampler.iter_mut().for_each(Resampler::restart);
        (self.current, self.end_s) = (None, None);
    }

    /// Records that a sample was discarded that may have measured a shock.
    pub(super) fn note_possible_shock(&mut self) {
        self.possible_shock = true;
    }

    /// Adds a sample stamped `raw_s`, before samples stamped `later_s`; appends the intervals that it completes to `into`,
    /// each with its start time.
    pub(super) fn push(
        &mut self,
        raw_s: f64,
        later_s: impl Iterator<Item = f64>,
        sample: &ImuSample,
        clipped: Clipped,
        into: &mut Vec<(f64, Interval)>,
    ) {
        self.saturated += usize::from(clipped.any());
        let centre_s = self.filter.smooth(raw_s, later_s);
        let period = self.filter.period_s();
        if let Some(last) = self.group.last() {
            if centre_s - last.centre_s < 0.2 * period {
                return; // a duplicate
            }
            if centre_s - last.centre_s > 1.5 * period {
                self.close_group(into);
            }
        }
        let (gyro, accel) = (sample.angular_velocity_rad_per_s, sample.specific_force_m_per_s2);
        self.group.push(Mean {
            centre_s,
            gyro,
            accel,
            extra_gyro_sigma: 0.0,
            extra_accel_sigma: 0.0,
            clipped,
            bridged: false,
        });
        if self.group.len() >= self.per_group {
            self.close_group(into);
        }
    }

    /// Appends the remaining intervals to `into`, at the end of the data.
    pub(super) fn flush(&mut self, into: &mut Vec<(f64, Interval)>) {
        if !self.group.is_empty() {
            self.close_group(into);
        }
        if let Some(resampler) = &mut self.resampler {
            resampler.flush().into_iter().for_each(|mean| self.append(mean, into));
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
            extra_gyro_sigma: 0.0,
            extra_accel_sigma: if std::mem::take(&mut self.possible_shock) { SHOCK_ACCEL } else { 0.0 },
            clipped: self.group.iter().fold(Clipped::NONE, |all, m| all.or(m.clipped)),
            bridged: false,
        };
        self.group.clear();
        match &mut self.resampler {
            Some(resampler) => resampler.push(mean).into_iter().for_each(|mean| self.append(mean, into)),
            None => self.append(mean, into),
        }
    }

    /// Appends a mean, or holds it back until a gap or clipped readings before it are reconstructed.
    fn append(&mut self, mean: Mean, into: &mut Vec<(f64, Interval)>) {
        let Some(last) = self.waiting.last().or(self.current.as_ref()) else {
            self.current = Some(mean);
            return;
        };
        let since_s = mean.centre_s - last.centre_s;
        if since_s < 0.2 * self.spacing_s() {
            return; // a duplicate
        }
        let is_valid = !mean.clipped.any() && since_s < 1.5 * self.spacing_s();
        if self.waiting.is_empty() && is_valid {
            self.emit(mean, into);
            return;
        }
        self.waiting.push(mean);
        let waits_s = mean.centre_s - self.waiting[0].centre_s;
        if self.valid_at_end() >= FIT_MEANS || waits_s > MAX_WAIT_S {
            self.release(into);
        }
    }

    /// Number of waiting means at the end without a gap and without clipping.
    fn valid_at_end(&self) -> usize {
        let gap_s = 1.5 * self.spacing_s();
        let clear = self.waiting.iter().rev().take_while(|mean| !mean.clipped.any()).count();
        let from_end = self.waiting.windows(2).rev();
        let joined = from_end.take_while(|pair| pair[1].centre_s - pair[0].centre_s < gap_s).count() + 1;
        clear.min(joined)
    }

    /// Spacing of the means, s.
    fn spacing_s(&self) -> f64 {
        match &self.resampler {
            Some(_) => SPACING_S,
            None => self.filter.period_s() * self.per_group as f64,
        }
    }

    /// Emits the waiting means, with gaps bridged and clipped readings reconstructed.
    fn release(&mut self, into: &mut Vec<(f64, Interval)>) {
        let mut means = std::mem::take(&mut self.waiting);
        if means.is_empty() {
            return;
        }
        let last_valid: Vec<Mean> = self.last_valid.iter().copied().chain(self.current).collect();
        self.reconstruct(&last_valid, &mut means);
        for k in 0..means.len() {
            let before = if k == 0 { self.current } else { Some(means[k - 1]) };
            let gap_s = before.map_or(0.0, |before| means[k].centre_s - before.centre_s);
            if gap_s >= 1.5 * self.spacing_s() {
                let steps = (gap_s / self.spacing_s()).round().max(2.0) as usize;
                let leaving: Vec<Mean> = last_valid.iter().chain(&means[..k]).copied().collect();
                let leaving = &leaving[self.gapless_from(&leaving)..];
                let arriving = &means[k..k + self.gapless_count(&means[k..])];
                bridge(leaving, arriving, steps, &self.bridging_error)
                    .into_iter()
                    .for_each(|mean| self.emit(mean, into));
            }
            self.emit(means[k], into);
        }
    }

    /// Reconstructs each run of clipped means in `means`, which follow `last_valid`.
    fn reconstruct(&self, last_valid: &[Mean], means: &mut [Mean]) {
        let mut from = 0;
        while let Some(start) = means[from..].iter().position(|mean| mean.clipped.any()).map(|k| from + k) {
            let length = means[start..].iter().take_while(|mean| mean.clipped.any()).count();
            let leaving: Vec<Mean> = last_valid.iter().chain(&means[..start]).copied().collect();
            let leaving = &leaving[leaving.len().saturating_sub(FIT_MEANS)..];
            let (run, rest) = means[start..].split_at_mut(length);
            let arriving = rest.iter().take(FIT_MEANS).take_while(|mean| !mean.clipped.any()).count();
            reconstruct_clipped(leaving, run, &rest[..arriving]);
            from = start + length;
        }
    }

    /// Index of the first of the means at the end without a gap between them, at most [`FIT_MEANS`].
    fn gapless_from(&self, means: &[Mean]) -> usize {
        let gap_s = 1.5 * self.spacing_s();
        let joined = means.windows(2).rev().take_while(|pair| pair[1].centre_s - pair[0].centre_s < gap_s).count() + 1;
        means.len().saturating_sub(joined.min(FIT_MEANS))
    }

    /// Number of means at the start without a gap between them, at most [`FIT_MEANS`].
    fn gapless_count(&self, means: &[Mean]) -> usize {
        let gap_s = 1.5 * self.spacing_s();
        let joined = means.windows(2).take_while(|pair| pair[1].centre_s - pair[0].centre_s < gap_s).count() + 1;
        joined.min(FIT_MEANS).min(means.len())
    }

    /// Converts the current mean to an interval; `next` determines the end and the slopes.
    fn emit(&mut self, next: Mean, into: &mut Vec<(f64, Interval)>) {
        let Some(now) = self.current.replace(next) else { return };
        self.measure_bridging_error(&now, &next);
        self.recent_motion.push(now, self.spacing_s());
        self.last_valid.push_back(now);
        if self.last_valid.len() >= FIT_MEANS {
            self.last_valid.pop_front();
        }
        let end = 0.5 * (now.centre_s + next.centre_s);
        let start = self.end_s.unwrap_or(2.0 * now.centre_s - end);
        self.end_s = Some(end);
        let back = |steps: usize| self.last_valid.len().checked_sub(1 + steps).map(|k| self.last_valid[k]);
        let readings = Neighbours { earlier: back(2), before: back(1), now, next };
        into.push((start, self.interval(&readings, end - start)));
    }

    /// Measures the interpolation error on five measured means at regular intervals.
    fn measure_bridging_error(&mut self, now: &Mean, next: &Mean) {
        let Some(from) = self.last_valid.len().checked_sub(3) else { return };
        let [a, b, c] = [0, 1, 2].map(|k| self.last_valid[from + k]);
        let five = [a, b, c, *now, *next];
        let spans_s = next.centre_s - a.centre_s;
        if five.iter().all(|mean| !mean.bridged) && spans_s < 4.5 * self.spacing_s() {
            self.bridging_error.measure(&five);
        }
    }

    fn interval(&self, readings: &Neighbours, h: f64) -> Interval {
        let spec = &self.spec;
        let sigma = |density: f64, scale: f64, reading: f64, extra: f64| {
            let noise = spec.noise_inflation * density / h.sqrt();
            (noise * noise + (scale * reading).powi(2) + extra * extra).sqrt()
        };
        let gyro_density = self.noise.gyro_density_rad_per_s_per_sqrt_hz;
        let accel_density = self.noise.accel_density_m_per_s2_per_sqrt_hz;
        let now = &readings.now;
        let (gyro, gyro_slope) = self.compensation.mean_and_slope(readings, |mean| mean.gyro);
        let (accel, accel_slope) = self.compensation.mean_and_slope(readings, |mean| mean.accel);
        Interval {
            h,
            gyro,
            gyro_slope,
            accel,
            accel_slope,
            uncompensated: self.compensation.uncompensated,
            gyro_sigma: sigma(gyro_density, spec.gyro_scale_error, now.gyro.norm(), now.extra_gyro_sigma),
            accel_sigma: sigma(accel_density, spec.accel_scale_error, now.accel.norm(), now.extra_accel_sigma),
            bridged: now.bridged,
        }
    }
}
