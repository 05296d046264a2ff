//! The low-pass filter at the output of an IMU.

use super::InertialReading;
use super::spec::OutputFilterSpec;
use nalgebra::Matrix3x2;
use std::collections::VecDeque;
use std::f64::consts::PI;

/// Least number of steps of a Butterworth filter per sample, and per period of its cut-off frequency.
const LEAST_STEPS: (f64, f64) = (10.0, 20.0);

/// Angular velocity, rad/s, and specific force, m/s^2, as columns.
type Columns = Matrix3x2<f64>;

/// A low-pass filter of all six axes, advanced in equal steps. Its gain at zero frequency is 1.
#[derive(Debug, Clone)]
pub(super) enum OutputFilter {
    /// Sections in series.
    Butterworth(Vec<Section>),
    /// The last readings, at most `length`.
    MovingAverage { last: VecDeque<Columns>, length: usize },
}

/// A section of a Butterworth filter of second or first order, in the transposed direct form II.
#[derive(Debug, Clone)]
pub(super) struct Section {
    numerator: [f64; 3],
    denominator: [f64; 2],
    /// `None` before the first reading: the filter starts as if that had been the reading for ever.
    state: Option<[Columns; 2]>,
}

/// Steps of the filter `spec` per sample of an IMU with `rate_hz` samples per second.
pub(super) fn steps_per_sample(spec: &OutputFilterSpec, rate_hz: f64) -> usize {
    match spec {
        OutputFilterSpec::Butterworth { cutoff_hz, .. } => {
            LEAST_STEPS.0.max((LEAST_STEPS.1 * cutoff_hz / rate_hz).ceil()) as usize
        }
        OutputFilterSpec::MovingAverage { rate_hz: internal_hz, .. } => (internal_hz / rate_hz).round() as usize,
    }
}

/// Delay of the output of `spec` at low frequencies in steps, without that of the averaging over a step.
pub(super) fn delay_steps(spec: &OutputFilterSpec, step_s: f64) -> f64 {
    match spec {
        // The filter of cut-off frequency 1 rad/s has the phase -w sum(1 / Q) at low frequencies w.
        OutputFilterSpec::Butterworth { order, cutoff_hz } => {
            let by_quality: f64 = sections(*order).map(|section| section.unwrap_or(1.0)).sum();
            0.5 * by_quality / (PI * cutoff_hz * step_s).tan()
        }
        OutputFilterSpec::MovingAverage { samples, .. } => 0.5 * (f64::from(*samples) - 1.0),
    }
}

/// `1 / Q` of the sections of second order of a Butterworth filter, and `None` for that of first order.
fn sections(order: u32) -> impl Iterator<Item = Option<f64>> {
    let pairs = (0..order / 2).map(move |k| Some(2.0 * (PI * f64::from(2 * k + 1) / f64::from(2 * order)).sin()));
    pairs.chain((order % 2 == 1).then_some(None))
}

impl OutputFilter {
    pub fn new(spec: &OutputFilterSpec, step_s: f64) -> Self {
        match spec {
            OutputFilterSpec::Butterworth { order, cutoff_hz } => {
                let tangent = (PI * cutoff_hz * step_s).tan();
                Self::Butterworth(sections(*order).map(|by_quality| Section::new(tangent, by_quality)).collect())
            }
            OutputFilterSpec::MovingAverage { samples, .. } => {
                Self::MovingAverage { last: VecDeque::new(), length: *samples as usize }
            }
        }
    }

    /// Advances by one step with its mean reading; returns the output at the end of the step.
    pub fn step(&mut self, reading: &InertialReading) -> InertialReading {
        let input = Columns::from_columns(&[reading.angular_velocity_rad_per_s, reading.specific_force_m_per_s2]);
        let output = match self {
            Self::Butterworth(sections) => sections.iter_mut().fold(input, |signal, section| section.step(signal)),
            Self::MovingAverage { last, length } => {
                last.push_back(input);
                if last.len() > *length {
                    last.pop_front();
                }
                last.iter().sum::<Columns>() / last.len() as f64
            }
        };
        InertialReading {
            angular_velocity_rad_per_s: output.column(0).into(),
            specific_force_m_per_s2: output.column(1).into(),
        }
    }
}

impl Section {
    /// By the bilinear transform, with `tangent = tan(pi cutoff step)`, so that the cut-off frequency is exact.
    fn new(tangent: f64, by_quality: Option<f64>) -> Self {
        let square = tangent * tangent;
        let (numerator, denominator) = match by_quality {
            Some(damping) => {
                let scale = 1.0 / (1.0 + damping * tangent + square);
                let edge = square * scale;
                ([edge, 2.0 * edge, edge], [2.0 * (square - 1.0) * scale, (1.0 - damping * tangent + square) * scale])
            }
            None => {
                let scale = 1.0 / (1.0 + tangent);
                ([tangent * scale, tangent * scale, 0.0], [(tangent - 1.0) * scale, 0.0])
            }
        };
        Self { numerator, denominator, state: None }
    }

    fn step(&mut self, input: Columns) -> Columns {
        let ([b0, b1, b2], [a1, a2]) = (self.numerator, self.denominator);
        // The steady state, in which the output equals the input.
        let [first, second] = self.state.unwrap_or([input * (b1 + b2 - a1 - a2), input * (b2 - a2)]);
        let output = input * b0 + first;
        self.state = Some([input * b1 - output * a1 + second, input * b2 - output * a2]);
        output
    }
}
