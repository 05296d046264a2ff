//! The window's iterations: place the surfels, match, solve, until the correction converges.

use super::Window;
use super::correspondence::{Counterpart, Match, Matches, Neighbours};
use super::equations::{Robust, Workspace};
use super::linearised::Linearised;
use crate::layout::Layout;
use crate::nominal::Correction;
use crate::residual::matched::MIN_SIGNIFICANT_TILT;
use crate::surfel::{FINE, PlacedSurfel};
use crate::timing::{Stopwatch, Timing};
use crate::unknowns::scale_misalignment_step;
use crate::views::Views;
use zsim_base::geometry::{Matrix, Vector};

/// A correction above this (m, rad) in one iteration is rejected.
const MAX_CORRECTION: (f64, f64) = (2.0, 0.8);
/// A window with a shock or a bridged gap is solved further if its last correction is larger than this, m or rad: the matches
/// change until it has converged.
const FAR_FROM_SETTLED: f64 = 0.005;
/// The most iterations then, as a multiple of the usual number.
const MOST_ITERATIONS: usize = 4;
/// Lever arm that converts a rotation of the head into surfel motion, m; more distant surfaces are in larger cells.
const LEVER_ARM_M: f64 = 5.0;
/// Conditioning below which a just relocalised window is not corrected along the weakest direction. Only a few matches
/// constrain it, and some of them are false.
const UNCONSTRAINED: f64 = 0.01;

/// Statistics of a window's solution.
#[derive(Debug, Clone, Default)]
pub(crate) struct WindowSolution {
    pub surfels: usize,
    pub matches: usize,
    pub view_matches: usize,
    pub views: usize,
    pub residual_rms_m: f64,
    pub iterations: usize,
    /// Correction in the last iteration of the usual number: evidence of several solutions.
    pub last_correction_m: f64,
    pub conditioning: f64,
    /// The least constrained direction, in the map frame.
    pub weakest: Vector,
    pub failure: Option<&'static str>,
    pub timing: Timing,
}

impl Window {
    /// Solves the window; returns the last linearisation if the solution is accepted.
    pub(crate) fn solve(&mut self, views: &Views) -> (WindowSolution, Option<Linearised>) {
        if self.nominal.end_s() <= self.start.u_s {
            let failure = Some("the IMU samples do not reach the window");
            return (WindowSolution { failure, ..WindowSolution::default() }, None);
        }
        let first = self.nominal.times_s().partition_point(|t| *t < self.start.u_s - 1e-9);
        let layout = self.layout(first);
        let backup = (self.nominal.clone(), self.unknowns);
        self.border.start_window();
        let mut total = vec![0.0; layout.border()];
        let mut solved = WindowSolution::default();
        let mut neighbours = Neighbours::default();
        let mut chosen = None;
        let mut linearised = None;
        let mut watch = Stopwatch::start();
        for iteration in 0..MOST_ITERATIONS * self.spec.solve.max_iterations {
            let scene = self.scene();
            solved.timing.placing_s += watch.lap_s();
            let chosen = chosen.get_or_insert_with(|| views.select(&scene));
            solved.timing.views_s += watch.lap_s();
            if !neighbours.are_valid_for(&scene) {
                neighbours = self.search_neighbours(&scene, views, chosen);
            }
            solved.timing.neighbours_s += watch.lap_s();
            let matches = Matches::of(self.match_up(&scene, views, &neighbours, iteration), &scene, &layout);
            let robust = Robust::of(&self.spec.solve, iteration);
            solved.record(&matches, &robust, &scene);
            (solved.iterations, solved.surfels, solved.views) = (iteration + 1, scene.len(), chosen.len());
            let matches = self.significant(matches, &solved, &scene, views);
            solved.timing.matches_s += watch.lap_s();
            let total_before = total.clone();
            let at = Linearised { layout, scene, matches, robust, total_before, step: Vec::new() };
            let Some((x, by)) = self.solve_linearised(first, &total, &at, views, &mut solved.timing) else {
                solved.failure = Some("the normal equations are singular");
                break;
            };
            watch.lap_s(); // the solver records this time
            if !(by.translation_m < MAX_CORRECTION.0 && by.rotation_rad < MAX_CORRECTION.1) {
                solved.failure = Some("the correction is too large");
                break;
            }
            self.apply(&x, first, &layout, &mut total);
            self.speed_is_known |= !at.matches.all.is_empty();
            self.sees_rest |= !at.matches.all.is_empty();
            neighbours.moved(by.translation_m + LEVER_ARM_M * by.rotation_rad);
            solved.timing.correction_s += watch.lap_s();
            linearised = Some(Linearised { step: x, ..at });
            if self.has_settled(&mut solved, by.max()) {
                break;
            }
        }
        if solved.failure.is_some() {
            (self.nominal, self.unknowns) = backup;
            self.border.reset_to_window_start();
            linearised = None;
        }
        self.choose_detail(&solved);
        (solved, linearised)
    }

    /// Records the correction of an iteration, m or rad; whether it is the last one.
    fn has_settled(&self, solved: &mut WindowSolution, correction: f64) -> bool {
        let usual = self.spec.solve.max_iterations;
        if solved.iterations <= usual {
            solved.last_correction_m = correction;
        }
        let goes_on = self.bridged_gap && correction >= FAR_FROM_SETTLED;
        correction < self.spec.solve.settled_m || solved.iterations >= usual && !goes_on
    }

    /// Builds fine surfels for the next window's time if the geometry of this one is weak.
    fn choose_detail(&mut self, solved: &WindowSolution) {
        let is_weak = solved.conditioning < self.spec.surfels.fine.below_conditioning;
        // At the start the geometry is weak because the head hardly sweeps yet; small surfels are then lines.
        let is_swept = self.rested_until_s <= self.start.u_s && !self.wide_matching;
        if is_weak && is_swept && solved.matches + solved.view_matches >= self.spec.solve.min_matches {
            self.fine_until_s = self.nominal.end_s() + self.spec.window_s;
        }
    }

    /// Removes matches and match components that are not significant; too few matches are removed entirely.
    fn significant(
        &self,
        mut matches: Matches,
        solved: &WindowSolution,
        scene: &[PlacedSurfel],
        views: &Views,
    ) -> Matches {
        if matches.all.len() < self.spec.solve.min_matches {
            return Matches::default();
        }
        if self.is_just_relocalised() && solved.conditioning < UNCONSTRAINED {
            matches.all.iter_mut().for_each(|found| found.plane.remove_component(&solved.weakest));
        } else if solved.conditioning < self.spec.solve.weak_conditioning {
            self.remove_insignificant_tilt(&mut matches, scene, views, &solved.weakest);
        }
        matches
    }

    /// Applies a solution to the window's unknowns.
    fn apply(&mut self, x: &[f64], first: usize, layout: &Layout, total: &mut [f64]) {
        let (Workspace { bases, fast_motion, .. }, border) = (&self.workspace, &x[layout.border()..]);
        self.nominal.correct(first, |node| {
            let slow = Correction::of_spline(&bases[node - first], layout.first_knot, x);
            slow.plus(&fast_motion.at(node - first, border))
        });
        for (sum, term) in total.iter_mut().zip(x) {
            *sum += term;
        }
        self.unknowns = self.unknowns.plus(border);
        self.nominal.correct_readings(&scale_misalignment_step(border));
        self.border.add_step(border, &self.workspace.factor);
    }
}

impl WindowSolution {
    /// Records number, residual and conditioning of the matches of `scene`.
    fn record(&mut self, matches: &Matches, robust: &Robust, scene: &[PlacedSurfel]) {
        self.matches = matches.all.iter().filter(|one| matches!(one.with, Counterpart::Live(_))).count();
        self.view_matches = matches.all.len() - self.matches;
        let weights: Vec<f64> = matches.planes().map(|plane| robust.weight(plane, plane.distance_m)).collect();
        let squares =
            matches.planes().zip(&weights).map(|(plane, weight)| weight * plane.distance_m * plane.distance_m);
        let (squares, sum) = (squares.sum::<f64>(), weights.iter().sum::<f64>());
        self.residual_rms_m = if sum > 0.0 { (squares / sum).sqrt() } else { 0.0 };
        let of = |is_used: &dyn Fn(&Match) -> bool| {
            let used = matches.all.iter().zip(&weights).filter(|(one, _)| is_used(one));
            conditioning(used.map(|(one, weight)| (one.plane.normal, *weight)))
        };
        (self.conditioning, self.weakest) = of(&|_| true);
        // Fine surfels add to the strong directions too. They must not make a direction that the usual ones constrain weak.
        let is_usual = |one: &Match| scene[one.a as usize].patch.level != FINE;
        if !matches.all.iter().all(is_usual) {
            self.conditioning = self.conditioning.max(of(&is_usual).0);
        }
    }
}

/// Smallest over largest eigenvalue of the position information of planes, and the least constrained direction.
///
/// `planes` are normals and weights.
fn conditioning(planes: impl Iterator<Item = (Vector, f64)> + Clone) -> (f64, Vector) {
    let outer = |(normal, weight): (Vector, f64)| normal * (normal * weight).transpose();
    let information = planes.clone().map(outer).fold(Matrix::zeros(), |sum, term| sum + term);
    let eigen = information.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    if largest <= 0.0 {
        return (0.0, Vector::zeros());
    }
    let weakest: Vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    // In a smooth tunnel normals tilt along the axis only by error; the sum of the errors would count as information.
    let along = |(normal, weight): (Vector, f64)| (normal.dot(&weakest), weight);
    let significant = planes.map(along).filter(|(tilt, _)| tilt.abs() > MIN_SIGNIFICANT_TILT);
    (significant.map(|(tilt, weight)| weight * tilt * tilt).sum::<f64>() / largest, weakest)
}
