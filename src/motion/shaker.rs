//! A shaker: test signals along or about the axes of the base, to characterise a head.

use super::jet::{Jet, PoseJet};
use super::sines::{FrequencyBin, SineSum, SpectralLine, linear_bins};
use super::smooth::SmoothSteps;
use super::stand::start_on_route;
use super::{BaseMotion, MotionError};
use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use zsim_base::geometry::{Kinematics, Route, Vector};
use zsim_base::random::{Seed, Stream};
use zsim_base::spec::checked::{Finite, NonNegative, Positive};
use zsim_base::spec::{Source, SpecError};

/// A base that a shaker drives along or about an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShakerSpec {
    /// Height of the base above the floor, m.
    #[serde(with = "Finite")]
    pub height_m: f64,
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Time in which the signals rise to their full amplitude, s.
    #[serde(default = "crate::usual::onset_s", with = "Positive")]
    pub onset_s: f64,
    /// The signals. Signals on the same axis are added.
    pub drives: Vec<DriveSpec>,
}

/// A signal on one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveSpec {
    /// The axis.
    pub axis: Axis,
    /// The signal.
    pub signal: SignalSpec,
}

/// An axis of the base at rest: x forward, y left, z up, or a rotation about one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Axis {
    /// x, forward.
    X,
    /// y, left.
    Y,
    /// z, up.
    Z,
    /// Rotation about x.
    Roll,
    /// Rotation about y.
    Pitch,
    /// Rotation about z.
    Yaw,
}

impl Axis {
    /// All axes.
    pub const ALL: [Axis; 6] = [Axis::X, Axis::Y, Axis::Z, Axis::Roll, Axis::Pitch, Axis::Yaw];

    /// Whether the axis is a rotation.
    pub fn is_rotation(self) -> bool {
        matches!(self, Axis::Roll | Axis::Pitch | Axis::Yaw)
    }
}

/// A test signal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum SignalSpec {
    /// A sine whose frequency changes exponentially until the end of the run.
    SweptSine {
        /// Frequency at the start, Hz.
        #[serde(with = "Positive")]
        from_hz: f64,
        /// Frequency at the end, Hz.
        #[serde(with = "Positive")]
        to_hz: f64,
        /// Amplitude, constant over the sweep.
        amplitude: Level,
    },
    /// Equal sines at the multiples of `1 / period_s` within a band. The signal is periodic, so a spectrum over whole
    /// periods has no leakage.
    Multisine {
        /// The period, s.
        #[serde(with = "Positive")]
        period_s: f64,
        /// Lowest frequency, Hz.
        #[serde(with = "Positive")]
        low_hz: f64,
        /// Highest frequency, Hz.
        #[serde(with = "Positive")]
        high_hz: f64,
        /// Root mean square of the sum.
        rms: Level,
        /// The sines' phases.
        #[serde(default)]
        phases: Phases,
        /// Only the odd multiples. The even ones then have no excitation, and quadratic distortion of the response appears
        /// there, not in the measured lines.
        #[serde(default)]
        odd: bool,
    },
    /// Random noise with a flat spectrum within a band: 256 sinusoids.
    BandNoise {
        /// Lowest frequency, Hz.
        #[serde(with = "Positive")]
        low_hz: f64,
        /// Highest frequency, Hz.
        #[serde(with = "Positive")]
        high_hz: f64,
        /// Root mean square of the sum.
        rms: Level,
    },
}

/// The phases of a multisine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Phases {
    /// Schroeder phases: low crest factor.
    #[default]
    Schroeder,
    /// Drawn from the run's seed. Runs differ in the phases only, so a difference in the response is nonlinear.
    Random,
}

/// Amplitude of a signal, and the derivative in which it is the same at every frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Level {
    /// Displacement, m.
    Metres(f64),
    /// Velocity, m/s.
    MetresPerS(f64),
    /// Acceleration, m/s^2.
    MetresPerS2(f64),
    /// Angle, degrees.
    Degrees(f64),
    /// Angular rate, degrees/s.
    DegreesPerS(f64),
    /// Angular acceleration, degrees/s^2.
    DegreesPerS2(f64),
}

impl Level {
    /// The level in SI units, and the order of the derivative to which it applies.
    fn parts(self) -> (f64, i32) {
        match self {
            Level::Metres(x) => (x, 0),
            Level::MetresPerS(x) => (x, 1),
            Level::MetresPerS2(x) => (x, 2),
            Level::Degrees(x) => (x.to_radians(), 0),
            Level::DegreesPerS(x) => (x.to_radians(), 1),
            Level::DegreesPerS2(x) => (x.to_radians(), 2),
        }
    }

    fn is_rotation(self) -> bool {
        matches!(self, Level::Degrees(_) | Level::DegreesPerS(_) | Level::DegreesPerS2(_))
    }

    /// Displacement amplitude of a sine of this level at `freq_hz`, m or rad.
    fn displacement(self, freq_hz: f64) -> f64 {
        let (level, order) = self.parts();
        level / (TAU * freq_hz).powi(order)
    }
}

/// Sinusoids in band-limited noise.
const NOISE_LINES: usize = 256;

/// Maximum number of lines of a multisine: each costs time at every evaluation.
const MAX_LINES: f64 = 1e5;

/// Motion of a base on a shaker.
pub(super) struct Shaker {
    rest: PoseJet,
    onset: SmoothSteps,
    start_s: f64,
    drives: Vec<(Axis, Drive)>,
}

enum Drive {
    Sines(SineSum<1>),
    Sweep { from_hz: f64, growth_per_s: f64, displacement: f64, order: i32 },
}

impl Shaker {
    pub fn new(
        spec: &ShakerSpec,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Self, MotionError> {
        let (floor, heading) = start_on_route(route);
        let sweep_s = duration_s - spec.still_s;
        let mut drives = Vec::new();
        for (index, drive) in spec.drives.iter().enumerate() {
            let stream_seed = seed.child(&format!("motion/shaker/{index}"));
            drives.push((drive.axis, drive.build(source, sweep_s, stream_seed)?));
        }
        let mut onset = SmoothSteps::from_level(0.0);
        onset.push(spec.still_s + spec.onset_s / 2.0, spec.onset_s / 2.0, 1.0);
        let rest = PoseJet::at_rest(&(floor + Vector::z() * spec.height_m), heading);
        Ok(Self { rest, onset, start_s: spec.still_s, drives })
    }
}

impl DriveSpec {
    fn build(&self, source: &Source, sweep_s: f64, seed: Seed) -> Result<Drive, SpecError> {
        let error = |key: &str, message: String| Err(SpecError::about(source, key, message));
        let (level, key) = match &self.signal {
            SignalSpec::SweptSine { amplitude, .. } => (*amplitude, "amplitude"),
            SignalSpec::Multisine { rms, .. } | SignalSpec::BandNoise { rms, .. } => (*rms, "rms"),
        };
        if level.is_rotation() != self.axis.is_rotation() {
            return error(
                key,
                format!(
                    "{level:?} does not fit the axis {:?}: give a length for x, y, z and an angle for rotations",
                    self.axis
                ),
            );
        }
        if !(level.parts().0.is_finite() && level.parts().0 > 0.0) {
            return error(key, format!("{level:?}: a level must be a finite number above 0"));
        }
        match self.signal {
            SignalSpec::SweptSine { from_hz, to_hz, .. } => {
                if sweep_s <= 0.0 {
                    return error("still_s", format!("the run ends {} s before the sweep begins", -sweep_s));
                }
                let (displacement, order) = (level.displacement(from_hz), level.parts().1);
                Ok(Drive::Sweep { from_hz, growth_per_s: (to_hz / from_hz).ln() / sweep_s, displacement, order })
            }
            SignalSpec::Multisine { low_hz, high_hz, .. } | SignalSpec::BandNoise { low_hz, high_hz, .. }
                if high_hz <= low_hz =>
            {
                error("high_hz", format!("the band ends at {high_hz} Hz, not above its begin at {low_hz} Hz"))
            }
            SignalSpec::Multisine { period_s, low_hz, high_hz, phases, odd, .. } => {
                let (first, last) = ((low_hz * period_s - 1e-9).ceil(), (high_hz * period_s + 1e-9).floor());
                if last < first || last - first >= MAX_LINES {
                    let message = format!(
                        "a period of {period_s} s has {} lines from {low_hz} to {high_hz} Hz; a multisine has 1 to {MAX_LINES}",
                        last - first + 1.0
                    );
                    return error("period_s", message);
                }
                let multiples: Vec<u32> = (first as u32..=last as u32).filter(|k| !odd || k % 2 == 1).collect();
                if multiples.is_empty() {
                    let message = format!("a period of {period_s} s has no odd line from {low_hz} to {high_hz} Hz");
                    return error("period_s", message);
                }
                let mut random = match phases {
                    Phases::Schroeder => None,
                    Phases::Random => Some(seed.stream("multisine")),
                };
                Ok(Drive::Sines(multisine(&multiples, period_s, level, random.as_mut())))
            }
            SignalSpec::BandNoise { low_hz, high_hz, .. } => {
                let bins = linear_bins((low_hz, high_hz), NOISE_LINES, &mut seed.stream("noise"));
                let amplitude = (2.0 / NOISE_LINES as f64).sqrt();
                let line = |bin: &FrequencyBin| SpectralLine {
                    cycles: bin.at,
                    amplitudes: [bin.phase * (amplitude * level.displacement(bin.at))],
                };
                Ok(Drive::Sines(SineSum::new(bins.iter().map(line))))
            }
        }
    }
}

/// Equal sines at these multiples of `1 / period_s`.
///
/// The phases are drawn from `random`; without it they are `-pi k (k - 1) / n` (Schroeder 1970).
fn multisine(multiples: &[u32], period_s: f64, level: Level, mut random: Option<&mut Stream>) -> SineSum<1> {
    let count = multiples.len() as f64;
    let line = |(before, multiple): (usize, &u32)| {
        let (freq_hz, k) = (f64::from(*multiple) / period_s, before as f64 + 1.0);
        let amplitude = (2.0 / count).sqrt() * level.displacement(freq_hz);
        let phase = match &mut random {
            Some(stream) => TAU * stream.random::<f64>(),
            None => -PI * k * (k - 1.0) / count,
        };
        SpectralLine { cycles: freq_hz, amplitudes: [Complex::from_polar(amplitude, phase)] }
    };
    SineSum::new(multiples.iter().enumerate().map(line))
}

impl Drive {
    /// Displacement at `t_s` after the start of the signal, m or rad.
    fn at(&self, t_s: f64) -> Jet {
        match self {
            Drive::Sines(sines) => {
                let [jet] = sines.at(t_s);
                jet
            }
            Drive::Sweep { from_hz, growth_per_s, displacement, order } => {
                // Phase: the integral of from_hz exp(growth t). With equal end frequencies the growth is 0: no division
                // by it.
                let phase = if *growth_per_s == 0.0 {
                    Jet::linear(t_s, TAU * from_hz, 0.0)
                } else {
                    Jet::exponential(t_s, *growth_per_s, TAU * from_hz / growth_per_s)
                };
                let falling = Jet::exponential(t_s, -growth_per_s * f64::from(*order), *displacement);
                phase.sin_cos().0 * falling
            }
        }
    }
}

impl BaseMotion for Shaker {
    fn at(&self, t_s: f64) -> Kinematics {
        if t_s <= self.start_s {
            return self.rest.kinematics();
        }
        let fraction = self.onset.at(t_s);
        let mut pose = self.rest;
        let (sin, cos) = self.rest.yaw.x.sin_cos();
        for (axis, drive) in &self.drives {
            let moved = drive.at(t_s - self.start_s) * fraction;
            match axis {
                Axis::X => {
                    pose.position[0] += moved * cos;
                    pose.position[1] += moved * sin;
                }
                Axis::Y => {
                    pose.position[0] += moved * -sin;
                    pose.position[1] += moved * cos;
                }
                Axis::Z => pose.position[2] += moved,
                Axis::Roll => pose.roll += moved,
                Axis::Pitch => pose.pitch += moved,
                Axis::Yaw => pose.yaw += moved,
            }
        }
        pose.kinematics()
    }
}
