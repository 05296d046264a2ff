//! Motion of a base carried by hand: the path, the gait, the wrist that excites the spring, and stops.
//!
//! The excitation is open loop: the wrist rotates near the resonance of the head, with random variations of amplitude
//! and phase. A real hand senses the swing and regulates it. Here two effects bound the swing: the damping of the head,
//! and the phase noise, which leaves the resonance before the swing builds up. The frequency is a setting: for another
//! head, set `frequency_hz` to its rocking frequency.

use super::drops::DropSpec;
use super::jet::{Jet, PoseJet};
use super::oscillator::{BandLimitedNoise, Oscillator, Variation};
use super::rests::MovingTime;
use super::smooth::{SmoothPath, SmoothSteps};
use super::stand::start_on_route;
use super::stops::StopsSpec;
use super::walk::{RouteMotion, WalkSpec};
use super::{BaseMotion, MotionError};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use zsim_base::geometry::{Kinematics, Pose, Route, Vector};
use zsim_base::random::Seed;
use zsim_base::spec::Source;
use zsim_base::spec::checked::{Finite, Fraction, NonNegative, Positive};

/// A hand that moves and shakes the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandSpec {
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Height of the base above the floor, m.
    #[serde(with = "Finite")]
    pub height_m: f64,
    /// Path of the hand.
    pub carry: CarrySpec,
    /// Body motion with the steps of a walk; `None` for a smooth path.
    pub gait: Option<GaitSpec>,
    /// Rotation of the wrist.
    pub shake: ShakeSpec,
    /// When the hand grips the head; never by default.
    #[serde(default)]
    pub stops: StopsSpec,
    /// Time to grasp the head, and to release it, s.
    #[serde(default = "crate::usual::grip_s", with = "Positive")]
    pub grip_s: f64,
    /// Rests of the walker: start and duration of each, s. The wrist does not shake during a rest; the head swings on
    /// its spring unless a stop holds it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rests: Vec<(f64, f64)>,
    /// Steps down, each with a landing shock.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drops: Vec<DropSpec>,
}

/// Path of a hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum CarrySpec {
    /// Along the scene's route.
    Walk(WalkSpec),
    /// Round a horizontal rectangle, from its near right corner, with constant heading, at the start of the route (the
    /// paper's pseudostationary experiment, section IV-A).
    Box {
        /// Size forward and to the left, m.
        #[serde(with = "zsim_base::spec::checked::PositiveArray::<2>")]
        size_m: [f64; 2],
        /// Number of rounds.
        rounds: u32,
        /// Speed along the sides, m/s.
        #[serde(with = "Positive")]
        speed_m_per_s: f64,
        /// Half-width of the kernel that smooths the corners, s.
        #[serde(default = "crate::usual::smoothing_s", with = "Positive")]
        smoothing_s: f64,
    },
}

/// Body motion with the steps. The amplitudes apply at full walking speed and scale with the speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaitSpec {
    /// Step frequency, Hz.
    #[serde(with = "Positive")]
    pub step_hz: f64,
    /// Vertical amplitude, once per step, m.
    #[serde(with = "NonNegative")]
    pub bob_m: f64,
    /// Lateral amplitude, once per two steps, m.
    #[serde(with = "NonNegative")]
    pub sway_m: f64,
    /// Longitudinal amplitude, once per step, m.
    #[serde(with = "NonNegative")]
    pub surge_m: f64,
    /// Phase noise of the gait, rad rms of the phase of two steps.
    #[serde(default, with = "NonNegative")]
    pub irregularity_rad: f64,
}

/// Rotation of the wrist, which excites the head.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShakeSpec {
    /// Frequency, Hz: near the rocking frequency of the head.
    #[serde(with = "Positive")]
    pub frequency_hz: f64,
    /// Mean amplitude of pitch, degrees.
    #[serde(with = "NonNegative")]
    pub pitch_deg: f64,
    /// Mean amplitude of roll, degrees.
    #[serde(with = "NonNegative")]
    pub roll_deg: f64,
    /// If true, roll follows pitch by a quarter of a period, so that the head circles; if false, roll oscillates
    /// independently.
    #[serde(default)]
    pub lasso: bool,
    /// Standard deviation of the amplitudes, as a fraction of their mean.
    #[serde(default, with = "Fraction")]
    pub amplitude_spread: f64,
    /// Standard deviation of the phase, rad.
    #[serde(default, with = "NonNegative")]
    pub phase_spread_rad: f64,
    /// Bandwidth of the variations of amplitude and phase, Hz.
    #[serde(default = "crate::usual::wander_hz", with = "Positive")]
    pub wander_hz: f64,
    /// Distance of the wrist, the centre of rotation, below the base, m.
    #[serde(default, with = "Finite")]
    pub wrist_below_m: f64,
    /// Time in which the shaking rises to full amplitude, s.
    #[serde(default = "crate::usual::onset_s", with = "Positive")]
    pub onset_s: f64,
}

/// Motion of a base carried by hand.
pub(super) struct Hand {
    carry: RouteMotion,
    height_m: f64,
    gait: Option<Gait>,
    shake: Shake,
    grip: SmoothSteps,
    moving_time: Option<MovingTime>,
    drops: Vec<DropSpec>,
    wrist_from_base: Pose,
}

impl Hand {
    pub fn new(
        spec: &HandSpec,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Self, MotionError> {
        let carry = match &spec.carry {
            CarrySpec::Walk(walk) => {
                walk.check(source)?;
                let route = route.ok_or_else(|| MotionError::NoRoute { motion: source.name.clone() })?;
                walk.along(route, spec.still_s, duration_s)?
            }
            CarrySpec::Box { size_m, rounds, speed_m_per_s, smoothing_s } => {
                let path = BoxPath {
                    size_m: *size_m,
                    rounds: *rounds,
                    speed_m_per_s: *speed_m_per_s,
                    smoothing_s: *smoothing_s,
                };
                path.motion(route, spec.still_s, duration_s)
            }
        };
        let stream = &mut seed.stream("motion/hand/stops");
        let grip = spec.stops.grip(source, spec.grip_s, spec.still_s, duration_s, stream)?;
        Ok(Self {
            carry,
            height_m: spec.height_m - spec.shake.wrist_below_m,
            gait: spec.gait.as_ref().map(|gait| Gait::new(gait, seed)),
            shake: Shake::new(&spec.shake, spec.still_s, seed),
            grip,
            moving_time: MovingTime::new(&spec.rests, source, duration_s)?,
            drops: spec.drops.clone(),
            wrist_from_base: Pose::translation(0.0, 0.0, spec.shake.wrist_below_m),
        })
    }
}

impl Hand {
    /// Position on the floor, heading, and fraction of the walking speed.
    fn route_motion(&self, t_s: f64) -> ([Jet; 3], Jet, Jet) {
        let at = |s: f64| (self.carry.path.at(s), self.carry.heading.at(s), self.carry.speed_fraction.at(s));
        let Some(moving_time) = &self.moving_time else { return at(t_s) };
        let elapsed = moving_time.at(t_s);
        let (position, heading, fraction) = at(elapsed.x);
        (
            position.map(|x| x.compose(elapsed)),
            heading.compose(elapsed),
            fraction.compose(elapsed) * moving_time.speed_fraction(t_s),
        )
    }
}

impl BaseMotion for Hand {
    fn at(&self, t_s: f64) -> Kinematics {
        let ([x, y, z], yaw, speed_fraction) = self.route_motion(t_s);
        let mut position = [x, y, z + Jet::constant(self.height_m)];
        if let Some(gait) = &self.gait {
            let [surge, sway, bob] = gait.at(t_s, speed_fraction);
            let (sin, cos) = yaw.sin_cos();
            position[0] += surge * cos - sway * sin;
            position[1] += surge * sin + sway * cos;
            position[2] += bob;
        }
        self.drops.iter().for_each(|drop| position[2] += drop.at(t_s));
        let free = Jet::constant(1.0) - self.grip.at(t_s);
        let moving =
            self.moving_time.as_ref().map_or(Jet::constant(1.0), |moving_time| moving_time.speed_fraction(t_s));
        let [roll, pitch] = self.shake.at(t_s, free * moving);
        PoseJet { position, roll, pitch, yaw }.kinematics().of_frame(&self.wrist_from_base)
    }

    fn hold(&self, t_s: f64) -> f64 {
        self.grip.at(t_s).x
    }
}

/// The settings of [`CarrySpec::Box`].
struct BoxPath {
    size_m: [f64; 2],
    rounds: u32,
    speed_m_per_s: f64,
    smoothing_s: f64,
}

impl BoxPath {
    /// Motion round the box, from `from_s` until all rounds are complete or `until_s` has passed.
    fn motion(&self, route: Option<&Route>, from_s: f64, until_s: f64) -> RouteMotion {
        let Self { size_m, rounds, speed_m_per_s, smoothing_s } = *self;
        let (start, heading) = start_on_route(route);
        let ahead = Vector::new(heading.cos(), heading.sin(), 0.0) * size_m[0];
        let left = Vector::new(-heading.sin(), heading.cos(), 0.0) * size_m[1];
        let mut path = SmoothPath::new(start, from_s + smoothing_s, smoothing_s);
        let corners = [(ahead, size_m[0]), (ahead + left, size_m[1]), (left, size_m[0]), (Vector::zeros(), size_m[1])];
        for (corner, side_m) in (0..rounds).flat_map(|_| corners) {
            if path.end_s() > until_s + smoothing_s {
                break;
            }
            path.move_to(start + corner, side_m / speed_m_per_s);
        }
        let speed_fraction = path.speed_fraction(speed_m_per_s);
        RouteMotion { path, heading: SmoothSteps::from_level(heading), speed_fraction }
    }
}

/// Body motion with the steps.
struct Gait {
    stride_rate: f64,
    amplitudes_m: [f64; 3],
    irregularity_rad: f64,
    phase_noise: BandLimitedNoise,
}

impl Gait {
    fn new(spec: &GaitSpec, seed: Seed) -> Self {
        Self {
            stride_rate: PI * spec.step_hz,
            amplitudes_m: [spec.surge_m, spec.sway_m, spec.bob_m],
            irregularity_rad: spec.irregularity_rad,
            phase_noise: BandLimitedNoise::new(spec.step_hz / 10.0, &mut seed.stream("motion/hand/gait")),
        }
    }

    /// Offsets forward, left and up, m, at a fraction of the full speed.
    fn at(&self, t_s: f64, fraction: Jet) -> [Jet; 3] {
        let stride = Jet::linear(t_s, self.stride_rate, 0.0) + self.phase_noise.at(t_s) * self.irregularity_rad;
        let (sin, cos) = stride.sin_cos();
        let [surge, sway, bob] = self.amplitudes_m;
        // A stride is two steps: sin 2x = 2 sin x cos x and cos 2x = 1 - 2 sin^2 x.
        let surging = sin * cos * 2.0;
        let bobbing = Jet::constant(1.0) - sin * sin * 2.0;
        [surging * fraction * surge, cos * fraction * sway, bobbing * fraction * bob]
    }
}

/// Rotation of the wrist.
struct Shake {
    onset: SmoothSteps,
    pitch_rad: f64,
    roll_rad: f64,
    pitch: Oscillator,
    /// Oscillator of roll; `None` for pitch delayed by a quarter of a period.
    roll: Option<Oscillator>,
}

impl Shake {
    fn new(spec: &ShakeSpec, from_s: f64, seed: Seed) -> Self {
        let rhythm = |name: &str| {
            let variation = Variation {
                strength: spec.amplitude_spread,
                phase_rad: spec.phase_spread_rad,
                bandwidth_hz: spec.wander_hz,
            };
            Oscillator::new(spec.frequency_hz, &variation, &mut seed.stream(name))
        };
        let mut onset = SmoothSteps::from_level(0.0);
        onset.push(from_s + spec.onset_s / 2.0, spec.onset_s / 2.0, 1.0);
        Self {
            onset,
            pitch_rad: spec.pitch_deg.to_radians(),
            roll_rad: spec.roll_deg.to_radians(),
            pitch: rhythm("motion/hand/pitch"),
            roll: (!spec.lasso).then(|| rhythm("motion/hand/roll")),
        }
    }

    /// Roll and pitch of the wrist, rad. `free` is the fraction of the shaking that the grip on the head allows.
    fn at(&self, t_s: f64, free: Jet) -> [Jet; 2] {
        let fraction = self.onset.at(t_s) * free;
        let (strength, phase) = self.pitch.at(t_s);
        let (sin, cos) = phase.sin_cos();
        let roll = match &self.roll {
            None => strength * sin,
            Some(rhythm) => {
                let (strength, phase) = rhythm.at(t_s);
                strength * (phase + Jet::constant(TAU / 4.0)).sin_cos().0
            }
        };
        [roll * fraction * self.roll_rad, strength * cos * fraction * self.pitch_rad]
    }
}
