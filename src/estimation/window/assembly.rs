//! Assembly and solution of the window's normal equations.

use super::Window;
use super::equations::{WeightedMatches, Workspace};
use super::linearised::Linearised;
use crate::displacement::Displacement;
use crate::layout::Layout;
use crate::nominal::Correction;
use crate::residual::inertial::add_inertial;
use crate::residual::{FastMotion, Nodes, prior};
use crate::spline::Basis;
use crate::timing::{Stopwatch, Timing};
use crate::unknowns::Unknowns;
use crate::views::Views;

/// Standard deviation of the zero-velocity measurement at rest, m/s.
const REST_VELOCITY_SIGMA: f64 = 0.003;

/// Standard deviation of the zero-rate measurement at rest, rad/s.
const REST_RATE_SIGMA: f64 = 0.003;

impl Window {
    /// The order of the window's unknowns; also computes the spline bases and the fast motion at the nodes from `first` on.
    pub(super) fn layout(&mut self, first: usize) -> Layout {
        let spacing = self.spec.knot_spacing_s;
        let Workspace { bases, fast_motion, .. } = &mut self.workspace;
        bases.clear();
        bases.extend(self.nominal.times_s()[first..].iter().map(|t| Basis::at(*t, spacing)));
        let first_knot = Basis::at(self.start.u_s, spacing).first;
        let last_knot = Basis::at(self.nominal.end_s(), spacing).first + 3;
        let layout = Layout { first_knot, knots: (last_knot - first_knot + 1) as usize };
        let (states, intervals) = (&self.nominal.states()[first..], &self.nominal.intervals()[first..]);
        *fast_motion = FastMotion::of(&Nodes { states, bases, intervals }, &layout);
        layout
    }

    /// Solves the window linearised `at` the current states, whose corrections so far sum up to `total`.
    ///
    /// Returns the solution with the displacement; adds the run time to `timing`.
    pub(super) fn solve_linearised(
        &mut self,
        first: usize,
        total: &[f64],
        at: &Linearised,
        views: &Views,
        timing: &mut Timing,
    ) -> Option<(Vec<f64>, Displacement)> {
        let mut watch = Stopwatch::start();
        let Linearised { layout, scene, matches, robust, .. } = at;
        let (clock_reference_s, extrinsics) = (self.unknowns.clock.at_s, self.spec.extrinsics.estimated);
        let weighted = WeightedMatches { scene, matches, views, robust, clock_reference_s, sign: 1.0 };
        let ((), sums) = rayon::join(|| self.assemble_inertial(first, layout, total), || weighted.sums(extrinsics));
        sums.add_to(&mut self.workspace.equations, layout);
        timing.equations_s += watch.lap_s();
        let Workspace { equations, factor, bases, .. } = &mut self.workspace;
        equations.factor(factor).ok()?;
        let x = equations.solve(factor);
        let moved = Displacement::max_of(bases.iter().map(|basis| {
            let correction = Correction::of_spline(basis, layout.first_knot, &x);
            (correction.rotation, correction.translation)
        }));
        timing.solve_s += watch.lap_s();
        Some((x, moved))
    }

    /// Resets the equations and adds the terms that do not depend on matches: IMU and priors.
    fn assemble_inertial(&mut self, first: usize, layout: &Layout, total: &[f64]) {
        let Workspace { equations, bases, fast_motion, .. } = &mut self.workspace;
        equations.reset(layout.size());
        let states = self.nominal.states();
        let nodes = Nodes { states: &states[first..], bases, intervals: &self.nominal.intervals()[first..] };
        let Unknowns { biases, gravity, .. } = &self.unknowns;
        add_inertial(equations, layout, &nodes, fast_motion, biases, gravity);
        self.start.add_to(equations, layout, total, self.border.total_step(), self.spec.knot_spacing_s);
        self.border.add_to(equations, layout);
        let nodes = self.nominal.times_s().iter().zip(states).skip(first);
        for ((_, state), basis) in nodes.zip(&*bases).take_while(|((time, _), _)| **time < self.rested_until_s) {
            prior::add_zero_velocity(equations, layout, basis, &state.velocity, REST_VELOCITY_SIGMA);
        }
        for k in (first..self.nominal.intervals().len()).filter(|k| self.rests.at(self.nominal.times_s()[*k])) {
            let (state, next, basis) = (&states[k], &states[k + 1], &bases[k - first]);
            let turn = (next.rotation * state.rotation.inverse()).scaled_axis() / self.nominal.intervals()[k].h;
            prior::add_zero_velocity(equations, layout, basis, &state.velocity, REST_VELOCITY_SIGMA);
            prior::add_zero_rotation_rate(equations, layout, basis, &turn, REST_RATE_SIGMA);
        }
        // The outermost knots are hardly observed: a weak prior of 1 m and 1 rad keeps the system regular.
        for unknown in 0..layout.border() {
            equations.add_entry(unknown, unknown, 1.0);
        }
    }
}
