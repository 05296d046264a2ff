use super::triad_model::{GaussMarkov, TriadModel, WarmUp};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use zsim_base::geometry::STANDARD_GRAVITY_M_PER_S2;
use zsim_base::measurement::ImuAveraging;
use zsim_base::spec::{Source, SpecError, checked};

/// Accepted sample rates, Hz.
const RATES_HZ: RangeInclusive<f64> = 1.0..=10_000.0;

/// Accepted orders of a Butterworth filter, and numbers of averaged readings.
const ORDERS: RangeInclusive<u32> = 1..=8;
const AVERAGED: RangeInclusive<u32> = 1..=1000;

/// Accepted cut-off frequencies, as multiples of the sample rate.
const MIN_CUTOFF: f64 = 0.01;
const MAX_CUTOFF: f64 = 10.0;

/// One thousandth of standard gravity, m/s^2.
const MILLI_G: f64 = STANDARD_GRAVITY_M_PER_S2 * 1e-3;

/// One degree per hour, rad/s.
const RAD_PER_S_PER_DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// An inertial measurement unit, by the data sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImuSpec {
    /// Samples per second, Hz. A sample describes the motion during the period before it.
    #[serde(with = "checked::Positive")]
    pub rate_hz: f64,
    /// Delay of the stamp after the middle of that period, ms. Half a period puts the stamp at the end of the period; a
    /// driver that corrects for it has a smaller value, a filter or a buffer a larger one. The clock offset adds to it.
    #[serde(default, with = "checked::Finite")]
    pub stamp_delay_ms: f64,
    /// How a sample is derived from the motion during its period.
    #[serde(default)]
    pub averaging: ImuAveraging,
    /// The low-pass filter at the output. A sample is then the filtered signal at the end of the period, so that `averaging`
    /// must be `none`. The delay of the filter is part of the true clock offset.
    pub output_filter: Option<OutputFilterSpec>,
    /// Rise of the temperature from the start on; biases change with it by `bias_deg_per_s_per_k` and `bias_mg_per_k`.
    pub warm_up: Option<WarmUpSpec>,
    /// The gyroscope.
    pub gyro: GyroSpec,
    /// The accelerometer.
    pub accel: AccelSpec,
}

/// A low-pass filter at the output of an IMU.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum OutputFilterSpec {
    /// A Butterworth filter: the gain is `1 / sqrt(1 + (f / cutoff_hz)^(2 order))`.
    Butterworth {
        /// Order, 1 to 8.
        order: u32,
        /// Frequency at which the gain is 0.707, Hz.
        #[serde(with = "checked::Positive")]
        cutoff_hz: f64,
    },
    /// The mean of the last readings inside the IMU.
    MovingAverage {
        /// Number of readings, 1 to 1000.
        samples: u32,
        /// Readings per second, Hz: a whole multiple, 1 to 100, of the rate of the samples.
        #[serde(with = "checked::Positive")]
        rate_hz: f64,
    },
}

/// Rise of the temperature of a sensor after the start, which approaches a final value exponentially.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WarmUpSpec {
    /// Final rise, K.
    #[serde(with = "checked::NonNegative")]
    pub rise_k: f64,
    /// Time constant, s: 63 % of the rise.
    #[serde(with = "checked::Positive")]
    pub time_s: f64,
}

/// Errors of a gyroscope, independent on three axes, with equal parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GyroSpec {
    /// White noise, deg/s/sqrt(Hz).
    #[serde(with = "checked::NonNegative")]
    pub density_deg_per_s_per_sqrt_hz: f64,
    /// Standard deviation of the turn-on bias, deg/s.
    #[serde(default, with = "checked::NonNegative")]
    pub turn_on_bias_deg_per_s: f64,
    /// Random walk of the bias, rad/s/sqrt(s).
    #[serde(default, with = "checked::NonNegative")]
    pub bias_walk_rad_per_s_per_sqrt_s: f64,
    /// Bias instability (in-run stability), deg/h: flicker noise with an Allan deviation of 0.664 times this value.
    #[serde(default, with = "checked::NonNegative")]
    pub bias_instability_deg_per_h: f64,
    /// Additional Gauss-Markov bias, deg/h.
    pub wander_deg_per_h: Option<GaussMarkovSpec>,
    /// Standard deviation of the change of the bias with temperature, deg/s/K.
    #[serde(default, with = "checked::NonNegative")]
    pub bias_deg_per_s_per_k: f64,
    /// Standard deviation of the scale error, per cent.
    #[serde(default, with = "checked::NonNegative")]
    pub scale_percent: f64,
    /// Standard deviation of the misalignment of each axis towards each other axis, degrees.
    #[serde(default, with = "checked::NonNegative")]
    pub misalignment_deg: f64,
    /// Measurement range per axis, deg/s; larger rates saturate.
    #[serde(default = "usual::limit_deg_per_s", with = "checked::Positive")]
    pub limit_deg_per_s: f64,
    /// Resolution, deg/s: rates are rounded to a multiple of it; 0 disables the rounding.
    #[serde(default, with = "checked::NonNegative")]
    pub resolution_deg_per_s: f64,
}

/// Errors of an accelerometer, independent on three axes, with equal parameters. One g is 9.80665 m/s^2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccelSpec {
    /// White noise, ug/sqrt(Hz).
    #[serde(with = "checked::NonNegative")]
    pub density_ug_per_sqrt_hz: f64,
    /// Standard deviation of the turn-on bias, mg.
    #[serde(default, with = "checked::NonNegative")]
    pub turn_on_bias_mg: f64,
    /// Random walk of the bias, m/s^2/sqrt(s).
    #[serde(default, with = "checked::NonNegative")]
    pub bias_walk_m_per_s2_per_sqrt_s: f64,
    /// Bias instability (in-run stability), mg: flicker noise with an Allan deviation of 0.664 times this value.
    #[serde(default, with = "checked::NonNegative")]
    pub bias_instability_mg: f64,
    /// Additional Gauss-Markov bias, mg.
    pub wander_mg: Option<GaussMarkovSpec>,
    /// Standard deviation of the change of the bias with temperature, mg/K.
    #[serde(default, with = "checked::NonNegative")]
    pub bias_mg_per_k: f64,
    /// Standard deviation of the scale error, per cent.
    #[serde(default, with = "checked::NonNegative")]
    pub scale_percent: f64,
    /// Standard deviation of the misalignment of each axis towards each other axis, degrees.
    #[serde(default, with = "checked::NonNegative")]
    pub misalignment_deg: f64,
    /// Measurement range per axis, g; larger specific forces saturate.
    #[serde(default = "usual::limit_g", with = "checked::Positive")]
    pub limit_g: f64,
    /// Resolution, mg: specific forces are rounded to a multiple of it; 0 disables the rounding.
    #[serde(default, with = "checked::NonNegative")]
    pub resolution_mg: f64,
}

/// A first-order Gauss-Markov process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussMarkovSpec {
    /// Stationary standard deviation, in the unit of the parent key.
    #[serde(with = "checked::NonNegative")]
    pub sigma: f64,
    /// Correlation time, s: the autocorrelation decays by 1/e.
    #[serde(with = "checked::Positive")]
    pub time_s: f64,
}

/// The values of keys that are omitted: ranges of ordinary MEMS, as in `specs/imus/unknown.ron`.
mod usual {
    pub fn limit_deg_per_s() -> f64 {
        2000.0
    }

    pub fn limit_g() -> f64 {
        16.0
    }
}

impl ImuSpec {
    /// Checks the relations between fields.
    pub(super) fn check(&self, source: &Source) -> Result<(), SpecError> {
        if !RATES_HZ.contains(&self.rate_hz) {
            let message = format!("{} samples a second; give {} to {}", self.rate_hz, RATES_HZ.start(), RATES_HZ.end());
            return Err(SpecError::about(source, "rate_hz", message));
        }
        if self.stamp_delay_ms.abs() > 1e3 {
            let message =
                format!("a delay of {} ms is too large; give at most 1000 ms either way", self.stamp_delay_ms);
            return Err(SpecError::about(source, "stamp_delay_ms", message));
        }
        self.check_filter(source)?;
        if self.warm_up.is_some() && self.gyro.bias_deg_per_s_per_k + self.accel.bias_mg_per_k == 0.0 {
            let message = "it changes no bias; give bias_deg_per_s_per_k or bias_mg_per_k too";
            return Err(SpecError::about(source, "warm_up", message));
        }
        let (gyro, accel) = self.triads();
        for (key, model) in [("resolution_deg_per_s", gyro), ("resolution_mg", accel)] {
            if model.resolution > model.limit {
                return Err(SpecError::about(source, key, format!("{key} is greater than the sensor's limit")));
            }
        }
        Ok(())
    }

    fn check_filter(&self, source: &Source) -> Result<(), SpecError> {
        let Some(filter) = &self.output_filter else { return Ok(()) };
        let refused = |message: String| Err(SpecError::about(source, "output_filter", message));
        if self.averaging != ImuAveraging::None {
            return refused("a filtered sample is not the average over a period; set averaging: none".to_owned());
        }
        match *filter {
            OutputFilterSpec::Butterworth { order, .. } if !ORDERS.contains(&order) => {
                refused(format!("a filter of order {order}; give {} to {}", ORDERS.start(), ORDERS.end()))
            }
            OutputFilterSpec::Butterworth { cutoff_hz, .. } if cutoff_hz > MAX_CUTOFF * self.rate_hz => {
                let max_hz = MAX_CUTOFF * self.rate_hz;
                refused(format!(
                    "a cut-off at {cutoff_hz} Hz has no effect; give at most {max_hz} Hz, or omit the filter"
                ))
            }
            OutputFilterSpec::Butterworth { cutoff_hz, .. } if cutoff_hz < MIN_CUTOFF * self.rate_hz => {
                let min_hz = MIN_CUTOFF * self.rate_hz;
                refused(format!("a cut-off at {cutoff_hz} Hz leaves no signal; give at least {min_hz} Hz"))
            }
            OutputFilterSpec::MovingAverage { samples, .. } if !AVERAGED.contains(&samples) => {
                refused(format!("the mean of {samples} readings; give {} to {}", AVERAGED.start(), AVERAGED.end()))
            }
            OutputFilterSpec::MovingAverage { rate_hz, .. } if !is_multiple(rate_hz / self.rate_hz) => {
                let message =
                    format!("{rate_hz} readings a second are not 1 to 100 times the {} samples", self.rate_hz);
                refused(message)
            }
            _ => Ok(()),
        }
    }

    /// The models of gyroscope and accelerometer.
    pub(super) fn triads(&self) -> (TriadModel, TriadModel) {
        (self.gyro.model(self.warm_up), self.accel.model(self.warm_up))
    }
}

/// Whether a ratio of rates is a whole number from 1 to 100.
fn is_multiple(ratio: f64) -> bool {
    (0.5..100.5).contains(&ratio) && (ratio - ratio.round()).abs() < 1e-9 * ratio
}

impl WarmUpSpec {
    /// The change of the bias with `per_k` for each kelvin, in the unit of `per_k`.
    fn model(warm_up: Option<Self>, per_k: f64) -> WarmUp {
        warm_up.map_or(WarmUp { sigma: 0.0, time_s: 1.0 }, |it| WarmUp { sigma: it.rise_k * per_k, time_s: it.time_s })
    }
}

impl GyroSpec {
    fn model(&self, warm_up: Option<WarmUpSpec>) -> TriadModel {
        TriadModel {
            density: self.density_deg_per_s_per_sqrt_hz.to_radians(),
            turn_on: self.turn_on_bias_deg_per_s.to_radians(),
            walk: self.bias_walk_rad_per_s_per_sqrt_s,
            gauss_markov: self.wander_deg_per_h.map(|w| w.model(RAD_PER_S_PER_DEG_PER_H)),
            instability: self.bias_instability_deg_per_h * RAD_PER_S_PER_DEG_PER_H,
            scale: self.scale_percent * 1e-2,
            misalignment: self.misalignment_deg.to_radians(),
            limit: self.limit_deg_per_s.to_radians(),
            resolution: self.resolution_deg_per_s.to_radians(),
            warm_up: WarmUpSpec::model(warm_up, self.bias_deg_per_s_per_k.to_radians()),
        }
    }
}

impl AccelSpec {
    fn model(&self, warm_up: Option<WarmUpSpec>) -> TriadModel {
        TriadModel {
            density: self.density_ug_per_sqrt_hz * 1e-3 * MILLI_G,
            turn_on: self.turn_on_bias_mg * MILLI_G,
            walk: self.bias_walk_m_per_s2_per_sqrt_s,
            gauss_markov: self.wander_mg.map(|w| w.model(MILLI_G)),
            instability: self.bias_instability_mg * MILLI_G,
            scale: self.scale_percent * 1e-2,
            misalignment: self.misalignment_deg.to_radians(),
            limit: self.limit_g * STANDARD_GRAVITY_M_PER_S2,
            resolution: self.resolution_mg * MILLI_G,
            warm_up: WarmUpSpec::model(warm_up, self.bias_mg_per_k * MILLI_G),
        }
    }
}

impl GaussMarkovSpec {
    /// The process in SI units; `unit` is the unit of the parent key.
    fn model(&self, unit: f64) -> GaussMarkov {
        GaussMarkov { sigma: self.sigma * unit, time_s: self.time_s }
    }
}
