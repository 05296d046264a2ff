//! The window's normal equations: the IMU's part and what is known before, then the matches with their robust weights.

use super::Window;
use super::correspondence::{Match, Matches};
use crate::estimation::normal_equations::{Factor, NormalEquations};
use crate::estimation::residual::Layout;
use crate::estimation::residual::inertial::add_inertial;
use crate::estimation::residual::matched::{self, ALWAYS, Beside, Own, Plane, SHARED, Side};
use crate::estimation::residual::prior;
use crate::estimation::spec::SolveSpec;
use crate::estimation::spent::{Stopwatch, TimeSpent};
use crate::estimation::spline::Basis;
use crate::estimation::surfel::Placed;
use crate::geometry::Vector;
use pulp::Arch;
use rayon::prelude::*;

/// The normal equations are summed in so many parts, whatever the number of threads, so that sums keep their order.
const PARTS: usize = 4;
/// How still the head is at rest, m/s.
const REST_VELOCITY_SIGMA: f64 = 0.003;

/// Memory that is used again from solve to solve.
#[derive(Debug)]
pub(super) struct Workspace {
    inertial: NormalEquations,
    /// Each with its share of the matches, the first with the inertial part as well; all are added to the first.
    parts: [NormalEquations; PARTS],
    /// How far the solution before moves each surfel, m.
    moved: Vec<Vector>,
    /// The weight of each match.
    weights: Vec<f64>,
    pub factor: Factor,
    pub bases: Vec<Basis>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self {
            inertial: NormalEquations::new(0),
            parts: std::array::from_fn(|_| NormalEquations::new(0)),
            moved: Vec::new(),
            weights: Vec::new(),
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

/// The most that a solution moves a knot.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Moved {
    /// m.
    pub shift: f64,
    /// rad.
    pub turn: f64,
}

impl Moved {
    /// Of six unknowns a knot.
    pub fn greatest(knots: &[f64]) -> Self {
        let norm = |v: &[f64]| Vector::new(v[0], v[1], v[2]).norm();
        // NaN must not pass for small.
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        knots.chunks_exact(6).fold(Self { shift: 0.0, turn: 0.0 }, |most, knot| Self {
            shift: larger(most.shift, norm(&knot[3..])),
            turn: larger(most.turn, norm(&knot[..3])),
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

    /// The part of the normal equations that robust weights do not change: IMU and priors.
    pub(super) fn assemble_inertial(&mut self, first: usize, layout: &Layout, total: &[f64]) {
        let Workspace { inertial, bases, .. } = &mut self.workspace;
        inertial.reset(layout.size());
        let states = self.nominal.states();
        let known = (&self.biases, &self.gravity);
        add_inertial(inertial, layout, (&states[first..], bases), &self.nominal.intervals()[first..], known);
        self.start.add_to(inertial, layout, (total, self.border.moved_so_far()), self.spec.knot_spacing_s);
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

    /// Solves the linearised window, with robust weights from the residuals that the solution before leaves, and again while
    /// it moves; adds the time to `spent`. The solution, and by how much it moves a knot.
    pub(super) fn solve_robustly(
        &mut self,
        scene: &[Placed],
        matches: &Matches,
        layout: &Layout,
        robust: &Robust,
        spent: &mut TimeSpent,
    ) -> Option<(Vec<f64>, Moved)> {
        let mut solution: Option<(Vec<f64>, Moved)> = None;
        let mut watch = Stopwatch::start();
        for _ in 0..self.spec.solve.reweightings {
            let before = solution.as_ref().map(|(x, _)| x.as_slice());
            self.assemble_matches(scene, matches, layout, robust, before);
            spent.equations_s += watch.lap_s();
            let Workspace { parts: [sum, ..], factor, .. } = &mut self.workspace;
            sum.factor(factor).ok()?;
            let x = sum.solve(factor);
            spent.solve_s += watch.lap_s();
            let moved = Moved::greatest(&x[..layout.border()]);
            let settled = moved.most() < self.spec.solve.settled_m;
            solution = Some((x, moved));
            if settled {
                break; // weights would hardly change
            }
        }
        solution
    }

    /// Adds the matches to the inertial part, weighted by what the solution `x` leaves of them.
    fn assemble_matches(
        &mut self,
        scene: &[Placed],
        matches: &Matches,
        layout: &Layout,
        robust: &Robust,
        x: Option<&[f64]>,
    ) {
        let (at_s, extrinsics) = (self.clock.at_s, self.spec.extrinsics.estimated);
        let Workspace { inertial, parts, moved, weights, .. } = &mut self.workspace;
        let movement = |surfel: &Placed| x.map_or_else(Vector::zeros, |x| matched::moved(surfel, layout, x, at_s));
        scene.par_iter().with_min_len(512).map(movement).collect_into_vec(moved);
        let weigh = |one: &Match| {
            let apart = moved[one.a as usize] - one.other().map_or_else(Vector::zeros, |b| moved[b]);
            robust.weight(&one.plane, one.plane.distance_m + one.plane.normal.dot(&apart))
        };
        matches.all.par_iter().with_min_len(512).map(weigh).collect_into_vec(weights);
        parts.par_iter_mut().enumerate().for_each(|(part, equations)| {
            if part == 0 {
                equations.copy_from(inertial);
            } else {
                equations.reset(layout.size());
            }
            let mut sums = Sums { equations, layout, placed: scene, matches, weights, at_s };
            let surfels = matches.part(part, PARTS);
            // The widest vector units of the machine: the order of the sums, and so each bit, is the same on all.
            Arch::new().dispatch(|| {
                if extrinsics { sums.add_surfels::<SHARED>(surfels) } else { sums.add_surfels::<ALWAYS>(surfels) }
            });
            equations.settle();
        });
        let [sum, others @ ..] = parts;
        for equations in others {
            sum.add(equations);
        }
    }
}

/// The matches of some surfels on their way into the normal equations.
struct Sums<'a> {
    equations: &'a mut NormalEquations,
    layout: &'a Layout,
    placed: &'a [Placed],
    matches: &'a Matches,
    weights: &'a [f64],
    at_s: f64,
}

impl Sums<'_> {
    /// Adds the matches of `surfels`: what each surfel says of itself, and how it hangs together with those no later.
    #[inline(always)]
    fn add_surfels<const B: usize>(&mut self, surfels: std::ops::Range<usize>) {
        let mut beside = Beside::<B>::NONE;
        for index in surfels {
            let mut own = Own::NONE;
            for k in self.matches.of_surfel(index) {
                self.add_match((index, &mut own), *k as usize, &mut beside);
            }
            own.add_to(self.equations, self.layout, &self.placed[index]);
        }
        beside.add_to(self.equations, self.layout);
    }

    /// Adds match `k`, seen from the surfel `index`.
    #[inline(always)]
    fn add_match<const B: usize>(&mut self, (index, own): (usize, &mut Own<B>), k: usize, beside: &mut Beside<B>) {
        let (one, weight) = (&self.matches.all[k], self.weights[k]);
        let is_first = one.a as usize == index;
        let normal = if is_first { one.plane.normal } else { -one.plane.normal };
        let distance_m = one.plane.distance_m;
        let surfel = &self.placed[index];
        let alone = Side::of(surfel, &normal, self.at_s);
        let Some(other) = (if is_first { one.other() } else { Some(one.a as usize) }) else {
            own.add(&alone, distance_m, weight);
            beside.add(&alone, distance_m, weight);
            return;
        };
        let partner = &self.placed[other];
        let partner_side = Side::of(partner, &-normal, self.at_s);
        let side = alone.together_with(&partner_side);
        own.add(&side, distance_m, weight);
        // Each match is met from both sides; what concerns both is added from the later one.
        if (partner.basis.first, other) < (surfel.basis.first, index) {
            beside.add(&side, distance_m, weight);
            matched::add_coupling(self.equations, self.layout, (partner, &partner_side), (surfel, &side), weight);
        }
    }
}
