//! The window's normal equations: the IMU's part and what is known before, then the matches with their robust weights.

use super::Window;
use super::correspondence::{Match, Matches};
use crate::estimation::nominal::Correction;
use crate::estimation::normal_equations::{Factor, NormalEquations};
use crate::estimation::residual::Layout;
use crate::estimation::residual::inertial::add_inertial;
use crate::estimation::residual::matched::{ALWAYS, Plane, SHARED, Side};
use crate::estimation::residual::prior;
use crate::estimation::residual::sums::{Coupling, OfSpan, Own};
use crate::estimation::spec::SolveSpec;
use crate::estimation::spent::{Stopwatch, TimeSpent};
use crate::estimation::spline::Basis;
use crate::estimation::surfel::Placed;
use crate::geometry::Vector;
use pulp::Arch;
use rayon::prelude::*;

/// How still the head is at rest, m/s.
const REST_VELOCITY_SIGMA: f64 = 0.003;

/// How little it turns there, rad/s.
const REST_RATE_SIGMA: f64 = 0.003;

/// Memory that is used again from solve to solve.
#[derive(Debug)]
pub(super) struct Workspace {
    equations: NormalEquations,
    pub factor: Factor,
    pub bases: Vec<Basis>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self { equations: NormalEquations::new(0), factor: Factor::default(), bases: Vec::new() }
    }
}

/// Cauchy's weights.
#[derive(Debug)]
pub(super) struct Robust {
    weight: f64,
    threshold: f64,
}

impl Robust {
    /// Those of an iteration: the threshold shrinks from `cauchy_start` to `cauchy_end`.
    pub fn of(spec: &SolveSpec, iteration: usize) -> Self {
        let late = iteration as f64 / (spec.max_iterations as f64 - 1.0).max(1.0);
        let threshold = spec.cauchy_start + (spec.cauchy_end - spec.cauchy_start) * late;
        Self { weight: spec.match_weight, threshold }
    }

    /// The weight of a match that a solution leaves `residual_m` apart.
    pub fn weight(&self, plane: &Plane, residual_m: f64) -> f64 {
        let normalised2 = residual_m * residual_m / plane.variance;
        self.weight / (plane.variance * (1.0 + normalised2 / (self.threshold * self.threshold)))
    }
}

/// The most that a correction moves the trajectory anywhere.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Moved {
    /// m.
    pub shift: f64,
    /// rad.
    pub turn: f64,
}

impl Moved {
    /// Of some corrections, turn and shift.
    pub fn greatest(corrections: impl Iterator<Item = (Vector, Vector)>) -> Self {
        // NaN must not pass for small.
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        corrections.fold(Self { shift: 0.0, turn: 0.0 }, |most, (turn, shift)| Self {
            shift: larger(most.shift, shift.norm()),
            turn: larger(most.turn, turn.norm()),
        })
    }

    /// The larger of both, m or rad.
    pub fn most(self) -> f64 {
        self.shift.max(self.turn)
    }
}

impl Window {
    /// Where the window's unknowns stand, those from the node `first` on.
    pub(super) fn layout(&mut self, first: usize) -> Layout {
        let spacing = self.spec.knot_spacing_s;
        self.workspace.bases.clear();
        self.workspace.bases.extend(self.nominal.times_s()[first..].iter().map(|t| Basis::at(*t, spacing)));
        let first_knot = Basis::at(self.start.u_s, spacing).first;
        let last_knot = Basis::at(self.nominal.end_s(), spacing).first + 3;
        Layout { first_knot, knots: (last_knot - first_knot + 1) as usize }
    }

    /// Solves the linearised window: the solution, and by how much it moves the head; adds the time to `spent`.
    pub(super) fn solve_linearised(
        &mut self,
        (first, total): (usize, &[f64]),
        scene: &[Placed],
        (matches, robust): (&Matches, &Robust),
        layout: &Layout,
        spent: &mut TimeSpent,
    ) -> Option<(Vec<f64>, Moved)> {
        let mut watch = Stopwatch::start();
        self.assemble_inertial(first, layout, total);
        let seen = Seen { scene, matches, robust, clock_at_s: self.clock.at_s };
        seen.add_to(&mut self.workspace.equations, layout, self.spec.extrinsics.estimated);
        spent.equations_s += watch.lap_s();
        let Workspace { equations, factor, bases } = &mut self.workspace;
        equations.factor(factor).ok()?;
        let x = equations.solve(factor);
        let moved = Moved::greatest(bases.iter().map(|basis| {
            let correction = Correction::of_spline(basis, layout.first_knot, &x);
            (correction.rotation, correction.translation)
        }));
        spent.solve_s += watch.lap_s();
        Some((x, moved))
    }

    /// Empties the equations, and begins them with what does not hang on matches: IMU and priors.
    fn assemble_inertial(&mut self, first: usize, layout: &Layout, total: &[f64]) {
        let Workspace { equations, bases, .. } = &mut self.workspace;
        equations.reset(layout.size());
        let states = self.nominal.states();
        let known = (&self.biases, &self.gravity);
        add_inertial(equations, layout, (&states[first..], bases), &self.nominal.intervals()[first..], known);
        self.start.add_to(equations, layout, (total, self.border.moved_so_far()), self.spec.knot_spacing_s);
        self.border.add_to(equations, layout);
        let nodes = self.nominal.times_s().iter().zip(states).skip(first);
        for ((_, state), basis) in nodes.zip(&*bases).take_while(|((time, _), _)| **time < self.rested_until_s) {
            prior::add_standstill(equations, layout, basis, &state.velocity, REST_VELOCITY_SIGMA);
        }
        for k in (first..self.nominal.intervals().len()).filter(|k| self.rests.at(self.nominal.times_s()[*k])) {
            let (state, next, basis) = (&states[k], &states[k + 1], &bases[k - first]);
            let turn = (next.rotation * state.rotation.inverse()).scaled_axis() / self.nominal.intervals()[k].h;
            prior::add_standstill(equations, layout, basis, &state.velocity, REST_VELOCITY_SIGMA);
            prior::add_no_turn(equations, layout, basis, &turn, REST_RATE_SIGMA);
        }
        // The outermost knots hardly touch the window: a metre and a radian keep them where nothing else does.
        for unknown in 0..layout.border() {
            equations.add_entry(unknown, unknown, 1.0);
        }
    }
}

/// What was seen, on its way into the normal equations.
struct Seen<'a> {
    scene: &'a [Placed],
    matches: &'a Matches,
    robust: &'a Robust,
    clock_at_s: f64,
}

impl Seen<'_> {
    /// Adds all matches; with `extrinsics`, with what they say of how the lidar sits.
    fn add_to(&self, equations: &mut NormalEquations, layout: &Layout, extrinsics: bool) {
        let weigh = |one: &Match| self.robust.weight(&one.plane, one.plane.distance_m);
        let weights: Vec<f64> = self.matches.all.iter().map(weigh).collect();
        if extrinsics {
            self.add_weighted::<SHARED>(&weights, equations, layout);
        } else {
            self.add_weighted::<ALWAYS>(&weights, equations, layout);
        }
    }

    /// Sums are taken run by run and added in order: so they are the same bits on any number of threads, and, since
    /// vector units of any width take them in the same order, on all machines.
    fn add_weighted<const B: usize>(&self, weights: &[f64], equations: &mut NormalEquations, layout: &Layout) {
        let spans = self.matches.spans.par_iter();
        let spans = spans.map(|(span, surfels)| (span, Arch::new().dispatch(|| self.of_span::<B>(surfels, weights))));
        let pairs = self.matches.couplings.par_iter();
        let pairs = pairs.map(|(pair, matches)| (pair, Arch::new().dispatch(|| self.coupling::<B>(matches, weights))));
        let (spans, pairs): (Vec<_>, Vec<_>) = rayon::join(|| spans.collect(), || pairs.collect());
        spans.iter().for_each(|(span, sum)| sum.add_to(equations, layout, *span));
        pairs.iter().for_each(|(pair, sum)| sum.add_to(equations, layout, *pair));
    }

    /// What the matches of the surfels of a span say of each surfel's own motion.
    #[inline(always)]
    fn of_span<const B: usize>(&self, surfels: impl Iterator<Item = usize>, weights: &[f64]) -> OfSpan<B> {
        let mut sum = OfSpan::NONE;
        for index in surfels {
            let surfel = &self.scene[index];
            let mut own = Own::NONE;
            for k in self.matches.of_surfel(index).iter().map(|k| *k as usize) {
                let (one, weight) = (&self.matches.all[k], weights[k]);
                let is_first = one.a as usize == index;
                let side = self.side(one, is_first);
                let side = if one.other().is_some() { side.together_with(&self.side(one, !is_first)) } else { side };
                own.add(&side, one.plane.distance_m, weight);
                // Each match of two is met from both sides.
                if is_first {
                    sum.beside.add(&side, one.plane.distance_m, weight);
                }
            }
            sum.add(&own, &surfel.basis);
        }
        sum
    }

    /// How the surfels of two spans hang together by some matches.
    #[inline(always)]
    fn coupling<const B: usize>(&self, matches: impl Iterator<Item = usize>, weights: &[f64]) -> Coupling {
        let mut sum = Coupling::NONE;
        for k in matches {
            let one = &self.matches.all[k];
            let Some(other) = one.other() else { continue };
            let (a, b) = (&self.scene[one.a as usize], &self.scene[other]);
            let (a, b) = ((a, &self.side::<B>(one, true)), (b, &self.side(one, false)));
            let (early, late) = if a.0.basis.first <= b.0.basis.first { (a, b) } else { (b, a) };
            sum.add(early, late, weights[k]);
        }
        sum
    }

    /// How a match's distance grows by what moves its first surfel, or the other.
    #[inline(always)]
    fn side<const B: usize>(&self, one: &Match, first: bool) -> Side<B> {
        let normal = if first { one.plane.normal } else { -one.plane.normal };
        let surfel = if first { one.a as usize } else { one.other().unwrap_or(one.a as usize) };
        Side::of(&self.scene[surfel], &normal, self.clock_at_s)
    }
}
