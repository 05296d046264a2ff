//! The head carried by hand: where the hand goes, the gait of who walks, the wrist's rhythm that shakes the spring, and
//! stops in which the hand holds the head.
//!
//! The shaking is open loop: the wrist turns at a rhythm whose strength and phase wander, near the head's resonance. A
//! real hand feels the head and regulates its swing; here the head's damping and the rhythm's wandering phase, which
//! takes it off resonance before the swing builds up, keep the swing within bounds. The rhythm's frequency is the
//! spec's: for another head set `frequency_hz` to its rocking frequency.

use super::drops::DropSpec;
use super::jet::{Jet, PoseJet};
use super::rests::Progress;
use super::rhythm::{Rhythm, Wander};
use super::smooth::{Steps, Way};
use super::stand::standpoint;
use super::stops::StopsSpec;
use super::walk::{Walk, WalkSpec};
use super::{BaseMotion, MotionError};
use crate::geometry::{Kinematics, Pose, Route, Vector};
use crate::random::Seed;
use crate::spec::Source;
use crate::spec::checked::{Finite, Fraction, NonNegative, Positive};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// How a hand carries and shakes the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandSpec {
    /// How long everything is at rest first, s.
    #[serde(with = "NonNegative")]
    pub still_s: f64,
    /// Height of the base above the floor, m.
    #[serde(with = "Finite")]
    pub height_m: f64,
    /// Where the hand goes.
    pub carry: CarrySpec,
    /// How the body moves with the steps, where it walks.
    pub gait: Option<GaitSpec>,
    /// How the wrist shakes the base.
    pub shake: ShakeSpec,
    /// When the hand holds the head still.
    pub stops: StopsSpec,
    /// How long it takes to grasp the head, and to let it go, s.
    #[serde(with = "Positive")]
    pub grip_s: f64,
    /// When the walker stands still in the middle of the way: start and duration of each rest, s. The wrist does not
    /// shake then; the head swings on its spring unless a stop holds it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rests: Vec<(f64, f64)>,
    /// Steps down that end in a shock.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drops: Vec<DropSpec>,
}

/// Where a hand goes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum CarrySpec {
    /// Along the scene's route.
    Walk(WalkSpec),
    /// Round a horizontal rectangle, from its near right corner, facing one way, by someone who stands where the route
    /// begins (the paper's pseudostationary experiment, section IV-A).
    Box {
        /// Size forward and to the left, m.
        #[serde(with = "crate::spec::checked::PositiveArray::<2>")]
        size_m: [f64; 2],
        /// How many times round.
        rounds: u32,
        /// Speed along the sides, m/s.
        #[serde(with = "Positive")]
        speed_m_per_s: f64,
        /// Half-width of the bump that rounds the corners, s.
        #[serde(with = "Positive")]
        smoothing_s: f64,
    },
}

/// How the body moves with the steps; all of it grows with the walking speed, to the amplitudes given at full speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaitSpec {
    /// Steps a second, Hz.
    #[serde(with = "Positive")]
    pub step_hz: f64,
    /// Amplitude up and down, once a step, m.
    #[serde(with = "NonNegative")]
    pub bob_m: f64,
    /// Amplitude to the sides, once in two steps, m.
    #[serde(with = "NonNegative")]
    pub sway_m: f64,
    /// Amplitude forward and back, once a step, m.
    #[serde(with = "NonNegative")]
    pub surge_m: f64,
    /// How far the steps wander off their beat, rad rms of two steps' phase.
    #[serde(with = "NonNegative")]
    pub irregularity_rad: f64,
}

/// How the wrist shakes the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShakeSpec {
    /// The rhythm's frequency, Hz: near the head's rocking frequency.
    #[serde(with = "Positive")]
    pub frequency_hz: f64,
    /// Mean amplitude of pitch, degrees.
    #[serde(with = "NonNegative")]
    pub pitch_deg: f64,
    /// Mean amplitude of roll, degrees.
    #[serde(with = "NonNegative")]
    pub roll_deg: f64,
    /// Whether roll follows pitch a quarter of a beat later, so that the head circles like a lasso; else roll has a
    /// rhythm of its own.
    pub lasso: bool,
    /// Standard deviation of the amplitudes, as a share of their mean.
    #[serde(with = "Fraction")]
    pub amplitude_spread: f64,
    /// How far the rhythm wanders off its beat, rad rms.
    #[serde(with = "NonNegative")]
    pub phase_spread_rad: f64,
    /// The highest frequency in the wandering of amplitude and phase, Hz.
    #[serde(with = "Positive")]
    pub wander_hz: f64,
    /// How far below the base the wrist is, about which it turns, m.
    #[serde(with = "Finite")]
    pub wrist_below_m: f64,
    /// How long the shaking takes to reach its full strength, s.
    #[serde(with = "Positive")]
    pub onset_s: f64,
}

/// A base carried by hand.
pub(super) struct Hand {
    carry: Walk,
    height_m: f64,
    gait: Option<Gait>,
    shake: Shake,
    grip: Steps,
    progress: Option<Progress>,
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
        let times_s = (spec.still_s, duration_s);
        let carry = match &spec.carry {
            CarrySpec::Walk(walk) => {
                walk.check(source)?;
                let route = route.ok_or_else(|| MotionError::NoRoute { motion: source.name.clone() })?;
                walk.along(route, spec.still_s, duration_s)?
            }
            CarrySpec::Box { size_m, rounds, speed_m_per_s, smoothing_s } => {
                round_box((*size_m, *rounds), (*speed_m_per_s, *smoothing_s), times_s, route)
            }
        };
        let grip = spec.stops.grip(source, spec.grip_s, times_s, &mut seed.stream("motion/hand/stops"))?;
        Ok(Self {
            carry,
            height_m: spec.height_m - spec.shake.wrist_below_m,
            gait: spec.gait.as_ref().map(|gait| Gait::new(gait, seed)),
            shake: Shake::new(&spec.shake, spec.still_s, seed),
            grip,
            progress: Progress::new(&spec.rests, source, duration_s)?,
            drops: spec.drops.clone(),
            wrist_from_base: Pose::translation(0.0, 0.0, spec.shake.wrist_below_m),
        })
    }
}

impl Hand {
    /// Position on the floor, heading and share of the walking speed.
    fn carried(&self, t_s: f64) -> ([Jet; 3], Jet, Jet) {
        let at = |s: f64| (self.carry.way.at(s), self.carry.heading.at(s), self.carry.speed_share.at(s));
        let Some(progress) = &self.progress else { return at(t_s) };
        let elapsed = progress.at(t_s);
        let (position, heading, share) = at(elapsed.x);
        (position.map(|x| x.of(elapsed)), heading.of(elapsed), share.of(elapsed) * progress.moving(t_s))
    }
}

impl BaseMotion for Hand {
    fn at(&self, t_s: f64) -> Kinematics {
        let ([x, y, z], yaw, speed_share) = self.carried(t_s);
        let mut position = [x, y, z + Jet::constant(self.height_m)];
        if let Some(gait) = &self.gait {
            let [surge, sway, bob] = gait.at(t_s, speed_share);
            let (sin, cos) = yaw.sin_cos();
            position[0] += surge * cos - sway * sin;
            position[1] += surge * sin + sway * cos;
            position[2] += bob;
        }
        self.drops.iter().for_each(|drop| position[2] += drop.at(t_s));
        let free = Jet::constant(1.0) - self.grip.at(t_s);
        let moving = self.progress.as_ref().map_or(Jet::constant(1.0), |progress| progress.moving(t_s));
        let [roll, pitch] = self.shake.at(t_s, free * moving);
        PoseJet { position, roll, pitch, yaw }.kinematics().of_frame(&self.wrist_from_base)
    }

    fn hold(&self, t_s: f64) -> f64 {
        self.grip.at(t_s).x
    }
}

/// A hand that goes round a box, from `from_s` until it has gone round as often as told, or `until_s` is past.
fn round_box(
    (size_m, rounds): ([f64; 2], u32),
    (speed_m_per_s, smoothing_s): (f64, f64),
    (from_s, until_s): (f64, f64),
    route: Option<&Route>,
) -> Walk {
    let (start, heading) = standpoint(route);
    let ahead = Vector::new(heading.cos(), heading.sin(), 0.0) * size_m[0];
    let left = Vector::new(-heading.sin(), heading.cos(), 0.0) * size_m[1];
    let mut way = Way::new(start, from_s + smoothing_s, smoothing_s);
    let corners = [(ahead, size_m[0]), (ahead + left, size_m[1]), (left, size_m[0]), (Vector::zeros(), size_m[1])];
    for (corner, side_m) in (0..rounds).flat_map(|_| corners) {
        if way.end_s() > until_s + smoothing_s {
            break;
        }
        way.go(start + corner, side_m / speed_m_per_s);
    }
    let speed_share = way.speed_share(speed_m_per_s);
    Walk { way, heading: Steps::from_level(heading), speed_share }
}

/// The body's motion with the steps.
struct Gait {
    stride_rate: f64,
    amplitudes_m: [f64; 3],
    irregularity_rad: f64,
    wander: Wander,
}

impl Gait {
    fn new(spec: &GaitSpec, seed: Seed) -> Self {
        Self {
            stride_rate: PI * spec.step_hz,
            amplitudes_m: [spec.surge_m, spec.sway_m, spec.bob_m],
            irregularity_rad: spec.irregularity_rad,
            wander: Wander::new(spec.step_hz / 10.0, &mut seed.stream("motion/hand/gait")),
        }
    }

    /// Offsets forward, to the left and up, m, at a share of the full speed.
    fn at(&self, t_s: f64, share: Jet) -> [Jet; 3] {
        let stride = Jet::linear(t_s, self.stride_rate, 0.0) + self.wander.at(t_s) * self.irregularity_rad;
        let (sin, cos) = stride.sin_cos();
        let [surge, sway, bob] = self.amplitudes_m;
        // A stride is two steps: sin 2x = 2 sin x cos x and cos 2x = 1 - 2 sin^2 x.
        let surging = sin * cos * 2.0;
        let bobbing = Jet::constant(1.0) - sin * sin * 2.0;
        [surging * share * surge, cos * share * sway, bobbing * share * bob]
    }
}

/// The wrist's rhythm.
struct Shake {
    onset: Steps,
    pitch_rad: f64,
    roll_rad: f64,
    pitch: Rhythm,
    /// Roll's own rhythm; `None`: pitch's, a quarter of a beat later.
    roll: Option<Rhythm>,
}

impl Shake {
    fn new(spec: &ShakeSpec, from_s: f64, seed: Seed) -> Self {
        let rhythm = |name: &str| {
            let spreads = (spec.amplitude_spread, spec.phase_spread_rad);
            Rhythm::new(spec.frequency_hz, spreads, spec.wander_hz, &mut seed.stream(name))
        };
        let mut onset = Steps::from_level(0.0);
        onset.push(from_s + spec.onset_s / 2.0, spec.onset_s / 2.0, 1.0);
        Self {
            onset,
            pitch_rad: spec.pitch_deg.to_radians(),
            roll_rad: spec.roll_deg.to_radians(),
            pitch: rhythm("motion/hand/pitch"),
            roll: (!spec.lasso).then(|| rhythm("motion/hand/roll")),
        }
    }

    /// Roll and pitch of the wrist, rad, where the hand is free to shake by the share `free`.
    fn at(&self, t_s: f64, free: Jet) -> [Jet; 2] {
        let share = self.onset.at(t_s) * free;
        let (strength, phase) = self.pitch.at(t_s);
        let (sin, cos) = phase.sin_cos();
        let roll = match &self.roll {
            None => strength * sin,
            Some(rhythm) => {
                let (strength, phase) = rhythm.at(t_s);
                strength * (phase + Jet::constant(TAU / 4.0)).sin_cos().0
            }
        };
        [roll * share * self.roll_rad, strength * cos * share * self.pitch_rad]
    }
}
