//! The sliding window: what is being solved, and how.

use super::border::Border;
use super::clock::Clock;
use super::initial::{Beginning, Rest};
use super::matching::Matcher;
use super::nominal::{Correction, Nominal};
use super::normal_equations::{Factor, NormalEquations};
use super::residual::inertial::Inertial;
use super::residual::matched::{self, Plane};
use super::residual::prior::{self, Start};
use super::residual::{ACCEL_BIAS, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, Layout};
use super::spec::EstimatorSpec;
use super::spline::Basis;
use super::strapdown::{Biases, Interval};
use super::surfel::{Beam, Placed, Surfel, SurfelMaker};
use super::views::Views;
use crate::geometry::{Matrix, Rotation, Vector};
use rayon::prelude::*;
use std::collections::VecDeque;

/// The normal equations are summed in so many parts, whatever the number of threads, so that sums keep their order.
const PARTS: usize = 4;
/// Before the first motion that the IMU shows, the head has begun to move unseen: this long, s.
const REST_MARGIN_S: f64 = 0.3;
/// How still the head is at rest, m/s.
const REST_VELOCITY_SIGMA: f64 = 0.003;
/// A correction beyond this (m, rad) in one solve is not believed.
const BELIEVABLE: (f64, f64) = (2.0, 0.8);

/// A stretch of time in the window.
#[derive(Debug)]
struct Stretch {
    end_tau_s: f64,
    beams: Vec<Beam>,
    surfels: Vec<Surfel>,
}

/// The state of the estimator: trajectory, biases, gravity, clock, and the surfels of the last few seconds.
#[derive(Debug)]
pub(super) struct Window {
    spec: EstimatorSpec,
    maker: SurfelMaker,
    matcher: Matcher,
    pub(super) nominal: Nominal,
    pub(super) clock: Clock,
    pub(super) biases: Biases,
    pub(super) gravity: Vector,
    border: Border,
    stretches: VecDeque<Stretch>,
    start: Start,
    /// While the head has not moved yet: what the IMU says at rest.
    rest: Option<Rest>,
    /// Until when it rested, IMU time, s.
    rested_until_s: f64,
    workspace: Workspace,
}

/// Memory that is used again from solve to solve.
#[derive(Debug)]
struct Workspace {
    inertial: NormalEquations,
    sum: NormalEquations,
    parts: Vec<NormalEquations>,
    factor: Factor,
    bases: Vec<Basis>,
}

/// How a window's solution came out.
#[derive(Debug, Clone, Default)]
pub(super) struct Solved {
    pub(super) surfels: usize,
    pub(super) matches: usize,
    pub(super) view_matches: usize,
    pub(super) views: usize,
    pub(super) residual_rms_m: f64,
    pub(super) iterations: usize,
    pub(super) last_correction_m: f64,
    pub(super) conditioning: f64,
    pub(super) trouble: Option<&'static str>,
}

/// The matches of an iteration.
struct Matches {
    pairs: Vec<(u32, u32, Plane)>,
    fixed: Vec<(u32, Plane)>,
}

impl Window {
    /// A window that begins with the IMU's first interval, at `start_u_s`.
    pub(super) fn new(
        spec: &EstimatorSpec,
        maker: SurfelMaker,
        beginning: &Beginning,
        start_u_s: f64,
        border: Border,
    ) -> Self {
        let clock = Clock { offset_s: spec.clock.start_s, rate: 0.0, at_s: start_u_s };
        let empty = || NormalEquations::new(0);
        let workspace = Workspace {
            inertial: empty(),
            sum: empty(),
            parts: vec![empty(); PARTS],
            factor: Factor::default(),
            bases: Vec::new(),
        };
        Self {
            spec: spec.clone(),
            matcher: Matcher::new(&spec.matching, &spec.surfels),
            maker,
            nominal: Nominal::beginning(start_u_s, beginning.state),
            clock,
            biases: beginning.biases,
            gravity: crate::geometry::gravity_in_world(),
            border,
            stretches: VecDeque::new(),
            start: Start::first(start_u_s, beginning.velocity_sigma),
            rest: beginning.rest,
            rested_until_s: f64::NEG_INFINITY,
            workspace,
        }
    }

    pub(super) fn matcher(&self) -> &Matcher {
        &self.matcher
    }

    /// Appends a stretch: integrates its intervals, and makes surfels of its beams.
    pub(super) fn extend(&mut self, intervals: &[(f64, Interval)], beams: Vec<Beam>, end_tau_s: f64) {
        for (_, interval) in intervals.iter() {
            self.nominal.extend(*interval, &self.biases, &self.gravity);
            self.rest = self.rest.filter(|rest| rest.goes_on(interval));
            if self.rest.is_some() {
                self.rested_until_s = self.nominal.end_s() - REST_MARGIN_S;
            }
        }
        let surfels = self.maker.build(&beams, &self.nominal, &self.clock, &self.biases);
        self.stretches.push_back(Stretch { end_tau_s, beams, surfels });
        // The clock is told from the middle of the window, where offset and rate are least correlated.
        let length_s = self.spec.step_s * self.stretches.len() as f64;
        let middle_s = end_tau_s - 0.5 * length_s;
        self.border.clock_told_from(middle_s - self.clock.at_s);
        self.clock = self.clock.told_from(middle_s);
    }

    /// Makes the newest stretch's surfels again, with the trajectory as it has become.
    pub(super) fn remake_newest(&mut self) {
        if let Some(newest) = self.stretches.back_mut() {
            newest.surfels = self.maker.build(&newest.beams, &self.nominal, &self.clock, &self.biases);
            newest.beams = Vec::new();
        }
    }

    /// Whether the oldest stretch is to leave.
    pub(super) fn is_full(&self) -> bool {
        self.stretches.len() as f64 * self.spec.step_s > self.spec.window_s - 1e-9
    }

    /// Lets the oldest stretch go: what is before its end is final. Its surfels as they stand in the map, and its end.
    pub(super) fn let_go(&mut self) -> Option<(Vec<Placed>, f64)> {
        let oldest = self.stretches.pop_front()?;
        let placed = self.place(oldest.surfels.iter());
        self.start = Start::held(self.clock.imu_s(oldest.end_tau_s).max(self.start.u_s));
        self.border.remember(self.spec.step_s / self.spec.window_s, self.spec.step_s);
        Some((placed, oldest.end_tau_s))
    }

    /// Where the window begins, IMU time, s: before it the trajectory is final.
    pub(super) fn start_s(&self) -> f64 {
        self.start.u_s
    }

    fn place<'a>(&self, surfels: impl Iterator<Item = &'a Surfel>) -> Vec<Placed> {
        surfels.map(|surfel| surfel.place(&self.nominal, &self.clock, &self.biases, self.spec.knot_spacing_s)).collect()
    }

    /// Solves the window: place the surfels, match, solve; again until nothing moves.
    pub(super) fn solve(&mut self, views: &Views) -> Solved {
        let first = self.nominal.times_s().partition_point(|t| *t < self.start.u_s - 1e-9);
        let layout = self.layout(first);
        let backup = (self.nominal.clone(), self.clock, self.biases, self.gravity);
        self.border.begin_window();
        let mut total = vec![0.0; layout.border()];
        let mut solved = Solved::default();
        let mut chosen = None;
        for iteration in 0..self.spec.solve.max_iterations {
            let placed = self.place_all();
            let chosen = chosen.get_or_insert_with(|| views.choose(&placed));
            let matches = self.match_up(&placed, (views, chosen), iteration);
            solved.iterations = iteration + 1;
            (solved.surfels, solved.views) = (placed.len(), chosen.len());
            (solved.matches, solved.view_matches) = (matches.pairs.len(), matches.fixed.len());
            let few = matches.pairs.len() + matches.fixed.len() < self.spec.solve.min_matches;
            let matches = if few { Matches { pairs: Vec::new(), fixed: Vec::new() } } else { matches };
            self.assemble_inertial(first, &layout, &total);
            let Some(x) = self.solve_robustly(&placed, &matches, &layout, iteration, &mut solved) else {
                solved.trouble = Some("its equations are singular");
                break;
            };
            let (shift, turn) = greatest(&x[..layout.border()]);
            if !(shift < BELIEVABLE.0 && turn < BELIEVABLE.1) {
                solved.trouble = Some("its correction is too large");
                break;
            }
            self.apply(&x, first, &layout, &mut total);
            solved.last_correction_m = shift.max(turn);
            if solved.last_correction_m < self.spec.solve.settled_m {
                break;
            }
        }
        if solved.trouble.is_some() {
            (self.nominal, self.clock, self.biases, self.gravity) = backup;
            self.border.begin_window();
        }
        solved
    }

    fn layout(&mut self, first: usize) -> Layout {
        let spacing = self.spec.knot_spacing_s;
        self.workspace.bases.clear();
        self.workspace.bases.extend(self.nominal.times_s()[first..].iter().map(|t| Basis::at(*t, spacing)));
        let first_knot = Basis::at(self.start.u_s, spacing).first;
        let last_knot = Basis::at(self.nominal.end_s(), spacing).first + 3;
        Layout { first_knot, knots: (last_knot - first_knot + 1) as usize }
    }

    /// The window's surfels in the map; those that a change of clock has moved out of the window's knots stay out.
    fn place_all(&self) -> Vec<Placed> {
        let (from, to) = (self.start.u_s, self.nominal.end_s());
        let surfels: Vec<&Surfel> = self.stretches.iter().flat_map(|stretch| &stretch.surfels).collect();
        let spacing = self.spec.knot_spacing_s;
        let placed: Vec<Option<Placed>> = surfels
            .par_iter()
            .with_min_len(512)
            .map(|surfel| {
                let u_s = self.clock.imu_s(surfel.tau_s);
                (from..=to).contains(&u_s).then(|| surfel.place(&self.nominal, &self.clock, &self.biases, spacing))
            })
            .collect();
        placed.into_iter().flatten().collect()
    }

    fn match_up(&self, placed: &[Placed], (views, chosen): (&Views, &[usize]), iteration: usize) -> Matches {
        let settled = self.spec.matching.max_plane_distance_m;
        let gate_m = settled * if iteration == 0 { 3.0 } else { 1.5 };
        let sigma_m = self.spec.solve.match_sigma_m;
        let pairs = self.matcher.among(placed, gate_m);
        let pairs = pairs
            .into_par_iter()
            .with_min_len(512)
            .map(|(a, b)| (a, b, Plane::of(&placed[a as usize].patch, &placed[b as usize].patch, sigma_m)))
            .collect();
        let count = self.spec.views.neighbours;
        let fixed: Vec<Vec<(u32, Plane)>> = placed
            .par_iter()
            .enumerate()
            .with_min_len(256)
            .map(|(index, surfel)| {
                let (mut found, mut planes) = (Vec::with_capacity(count), Vec::new());
                for view in chosen.iter().map(|index| views.view(*index)) {
                    found.clear();
                    self.matcher.neighbours(&view.forest, &surfel.patch, count, &mut found);
                    let patches = found.iter().map(|k| &view.patches[*k as usize]);
                    let agreeing = patches.filter(|patch| self.matcher.agree(&surfel.patch, patch, gate_m));
                    planes.extend(agreeing.map(|patch| (index as u32, Plane::of(&surfel.patch, patch, sigma_m))));
                }
                planes
            })
            .collect();
        Matches { pairs, fixed: fixed.into_iter().flatten().collect() }
    }

    /// The part of the normal equations that robust weights do not change: IMU and priors.
    fn assemble_inertial(&mut self, first: usize, layout: &Layout, total: &[f64]) {
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

    /// Solves the linearised window, with Cauchy weights from the residuals that the solution before leaves.
    fn solve_robustly(
        &mut self,
        placed: &[Placed],
        matches: &Matches,
        layout: &Layout,
        iteration: usize,
        solved: &mut Solved,
    ) -> Option<Vec<f64>> {
        let settings = &self.spec.solve;
        let late = iteration as f64 / (settings.max_iterations as f64 - 1.0).max(1.0);
        let threshold = settings.cauchy_start + (settings.cauchy_end - settings.cauchy_start) * late;
        let cauchy = |plane: &Plane, residual_m: f64| {
            let normalised2 = residual_m * residual_m / plane.variance;
            settings.match_weight / (plane.variance * (1.0 + normalised2 / (threshold * threshold)))
        };
        let at_s = self.clock.at_s;
        let Workspace { inertial, sum, parts, factor, .. } = &mut self.workspace;
        let mut x: Option<Vec<f64>> = None;
        for _ in 0..settings.reweightings {
            let residual = |a: &Placed, b: Option<&Placed>, plane: &Plane| {
                let Some(x) = x.as_deref() else { return plane.distance_m };
                let moved = |surfel: &Placed| matched::moved_m(surfel, &plane.normal, layout, x, at_s);
                plane.distance_m + moved(a) - b.map_or(0.0, moved)
            };
            parts.par_iter_mut().enumerate().for_each(|(part, equations)| {
                equations.reset(layout.size());
                for (a, b, plane) in part_of(&matches.pairs, part) {
                    let ends = (&placed[*a as usize], &placed[*b as usize]);
                    let weight = cauchy(plane, residual(ends.0, Some(ends.1), plane));
                    matched::add_pair(equations, layout, ends, plane, (weight, at_s));
                }
                for (a, plane) in part_of(&matches.fixed, part) {
                    let surfel = &placed[*a as usize];
                    let weight = cauchy(plane, residual(surfel, None, plane));
                    matched::add_fixed(equations, layout, surfel, plane, (weight, at_s));
                }
            });
            sum.copy_from(inertial);
            for part in parts.iter() {
                sum.add(part);
            }
            sum.factor(factor).ok()?;
            x = Some(sum.solve(factor));
        }
        let planes = || matches.pairs.iter().map(|(_, _, plane)| plane).chain(matches.fixed.iter().map(|(_, p)| p));
        describe(planes, cauchy, solved);
        x
    }

    /// Moves the window's unknowns by a solution.
    fn apply(&mut self, x: &[f64], first: usize, layout: &Layout, total: &mut [f64]) {
        let bases = &self.workspace.bases;
        self.nominal.correct(first, |node| Correction::of_spline(&bases[node - first], layout.first_knot, x));
        for (sum, term) in total.iter_mut().zip(x) {
            *sum += term;
        }
        let border = &x[layout.border()..];
        let three = |at: usize| Vector::new(border[at], border[at + 1], border[at + 2]);
        self.biases.gyro += three(GYRO_BIAS);
        self.biases.accel += three(ACCEL_BIAS);
        let tilt = Vector::new(border[GRAVITY], border[GRAVITY + 1], 0.0);
        self.gravity = Rotation::from_scaled_axis(tilt) * self.gravity;
        self.clock.offset_s += border[CLOCK];
        self.clock.rate += border[CLOCK_RATE];
        self.border.moved(border, &self.workspace.factor);
    }
}

/// Part `part` of a list, the same whatever the number of threads.
fn part_of<T>(list: &[T], part: usize) -> &[T] {
    let cut = |k: usize| list.len() * k / PARTS;
    &list[cut(part)..cut(part + 1)]
}

/// Greatest translation and rotation of a knot.
fn greatest(knots: &[f64]) -> (f64, f64) {
    let norm = |v: &[f64]| Vector::new(v[0], v[1], v[2]).norm();
    knots.chunks_exact(6).fold((0.0, 0.0), |(shift, turn): (f64, f64), knot| {
        // NaN must not pass for small.
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        (larger(shift, norm(&knot[3..])), larger(turn, norm(&knot[..3])))
    })
}

/// Residual and conditioning of a set of matches.
fn describe<'a, I: Iterator<Item = &'a Plane>>(
    planes: impl Fn() -> I,
    cauchy: impl Fn(&Plane, f64) -> f64,
    solved: &mut Solved,
) {
    let (mut weights, mut squares, mut information) = (0.0, 0.0, Matrix::zeros());
    for plane in planes() {
        let weight = cauchy(plane, plane.distance_m);
        weights += weight;
        squares += weight * plane.distance_m * plane.distance_m;
        information += plane.normal * plane.normal.transpose() * weight;
    }
    let eigenvalues = information.symmetric_eigenvalues();
    solved.residual_rms_m = if weights > 0.0 { (squares / weights).sqrt() } else { 0.0 };
    solved.conditioning = if weights > 0.0 { (eigenvalues.min() / eigenvalues.max()).max(0.0) } else { 0.0 };
}
