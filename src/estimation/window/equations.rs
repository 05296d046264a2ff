//! The window's normal equations: the IMU's part and what is known before, then the matches with their robust weights.

use super::Window;
use super::correspondence::{Matches, Scene};
use crate::estimation::normal_equations::{Factor, NormalEquations};
use crate::estimation::residual::Layout;
use crate::estimation::residual::inertial::Inertial;
use crate::estimation::residual::matched::{self, Own, Plane};
use crate::estimation::residual::prior;
use crate::estimation::spec::SolveSpec;
use crate::estimation::spent::{Stopwatch, TimeSpent};
use crate::estimation::spline::Basis;
use crate::estimation::surfel::Placed;
use rayon::prelude::*;

/// The normal equations are summed in so many parts, whatever the number of threads, so that sums keep their order.
const PARTS: usize = 4;
/// How still the head is at rest, m/s.
const REST_VELOCITY_SIGMA: f64 = 0.003;

/// Memory that is used again from solve to solve.
#[derive(Debug)]
pub(super) struct Workspace {
    inertial: NormalEquations,
    sum: NormalEquations,
    parts: Vec<(NormalEquations, Vec<Own>)>,
    own: Vec<Own>,
    pub factor: Factor,
    pub bases: Vec<Basis>,
}

impl Default for Workspace {
    fn default() -> Self {
        let empty = || NormalEquations::new(0);
        Self {
            inertial: empty(),
            sum: empty(),
            parts: vec![(empty(), Vec::new()); PARTS],
            own: Vec::new(),
            factor: Factor::default(),
            bases: Vec::new(),
        }
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

    /// The part of the normal equations that robust weights do not change: IMU and priors.
    pub(super) fn assemble_inertial(&mut self, first: usize, layout: &Layout, total: &[f64]) {
        let Workspace { inertial, bases, .. } = &mut self.workspace;
        inertial.reset(layout.size());
        let states = self.nominal.states();
        for (k, interval) in self.nominal.intervals().iter().enumerate().skip(first) {
            let terms = Inertial::between(&states[k], &states[k + 1], interval, &self.biases, &self.gravity);
            let ends = (&bases[k - first], &bases[k + 1 - first]);
            terms.add_to(inertial, layout, ends, interval, &self.gravity);
        }
        self.start.add_to(inertial, layout, total, self.spec.knot_spacing_s);
        self.border.add_to(inertial, layout);
        let nodes = self.nominal.times_s().iter().zip(states).skip(first);
        for ((_, state), basis) in nodes.zip(&*bases).take_while(|((time, _), _)| **time < self.rested_until_s) {
            prior::add_standstill(inertial, layout, basis, &state.velocity, REST_VELOCITY_SIGMA);
        }
        // The outermost knots hardly touch the window: a metre and a radian keep them where nothing else does.
        for unknown in 0..layout.border() {
            inertial.add_entry(unknown, unknown, 1.0);
        }
    }

    /// Solves the linearised window, with robust weights from the residuals that the solution before leaves; adds the time
    /// to `spent`.
    pub(super) fn solve_robustly(
        &mut self,
        scene: &Scene,
        matches: &Matches,
        layout: &Layout,
        robust: &Robust,
        spent: &mut TimeSpent,
    ) -> Option<Vec<f64>> {
        let mut x: Option<Vec<f64>> = None;
        let mut watch = Stopwatch::start();
        for _ in 0..self.spec.solve.reweightings {
            self.assemble_matches(scene, matches, layout, robust, x.as_deref());
            spent.equations_s += watch.lap_s();
            let Workspace { sum, factor, .. } = &mut self.workspace;
            sum.factor(factor).ok()?;
            x = Some(sum.solve(factor));
            spent.solve_s += watch.lap_s();
        }
        x
    }

    /// Adds the matches to the inertial part, weighted by what the solution `x` leaves of them.
    fn assemble_matches(
        &mut self,
        scene: &Scene,
        matches: &Matches,
        layout: &Layout,
        robust: &Robust,
        x: Option<&[f64]>,
    ) {
        let at_s = self.clock.at_s;
        let placed = &scene.placed;
        let residual = |a: &Placed, b: Option<&Placed>, plane: &Plane| {
            let Some(x) = x else { return plane.distance_m };
            let moved = |surfel: &Placed| matched::moved_m(surfel, &plane.normal, layout, x, at_s);
            plane.distance_m + moved(a) - b.map_or(0.0, moved)
        };
        let Workspace { inertial, sum, parts, own, .. } = &mut self.workspace;
        parts.par_iter_mut().enumerate().for_each(|(part, (equations, own))| {
            equations.reset(layout.size());
            own.clear();
            own.resize(placed.len(), Own::default());
            for (a, b, plane) in part_of(&matches.pairs, part) {
                let (a, b) = (*a as usize, *b as usize);
                let weight = robust.weight(plane, residual(&placed[a], Some(&placed[b]), plane));
                matched::add_pair((equations, own), layout, (placed, a, b), plane, (weight, at_s));
            }
            for (a, .., plane) in part_of(&matches.fixed, part) {
                let a = *a as usize;
                let weight = robust.weight(plane, residual(&placed[a], None, plane));
                matched::add_fixed(&mut own[a], &placed[a], plane, weight);
            }
        });
        own.clear();
        own.resize(placed.len(), Own::default());
        for (_, part) in parts.iter() {
            own.iter_mut().zip(part).for_each(|(sum, term)| sum.merge(term));
        }
        parts.par_iter_mut().enumerate().for_each(|(part, (equations, _))| {
            let matched = part_of(own, part).iter().zip(part_of(placed, part)).filter(|(own, _)| own.has_matches());
            for (own, surfel) in matched {
                own.add_to(equations, layout, surfel, at_s);
            }
        });
        sum.copy_from(inertial);
        for (equations, _) in parts.iter() {
            sum.add(equations);
        }
    }
}

/// Part `part` of a list, the same whatever the number of threads.
fn part_of<T>(list: &[T], part: usize) -> &[T] {
    let cut = |k: usize| list.len() * k / PARTS;
    &list[cut(part)..cut(part + 1)]
}
