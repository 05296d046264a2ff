//! The window's iterations: place the surfels, match, solve; again until nothing moves.

use super::Window;
use super::correspondence::{Matches, Neighbours, With};
use super::equations::Robust;
use super::uncertainty::Linearised;
use crate::estimation::nominal::Correction;
use crate::estimation::residual::matched::Plane;
use crate::estimation::residual::{
    ACCEL_BIAS, ACCEL_MATRIX, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, GYRO_MATRIX, LIDAR_SHIFT, LIDAR_TURN, Layout,
    RANGE,
};
use crate::estimation::spent::{Stopwatch, TimeSpent};
use crate::estimation::strapdown::Exaggerates;
use crate::estimation::surfel::Placed;
use crate::estimation::views::Views;
use crate::geometry::{Matrix, Rotation, Vector};

/// A correction beyond this (m, rad) in one solve is not believed.
const BELIEVABLE: (f64, f64) = (2.0, 0.8);
/// A turn moves a surfel by so much, m a rad: what is farther away is in larger cells.
const ARM_M: f64 = 5.0;
/// A normal that leans to a direction by less than this sine may do so by its error alone.
pub(in crate::estimation) const LEANING: f64 = 0.3;
/// Conditioning below which a window that was just found in a map is not moved along the weakest direction: nothing but
/// a few matches, of which some are false, would hold it there.
const UNTOLD: f64 = 0.01;

/// How a window's solution came out.
#[derive(Debug, Clone, Default)]
pub(in crate::estimation) struct Solved {
    pub surfels: usize,
    pub matches: usize,
    pub view_matches: usize,
    pub views: usize,
    pub residual_rms_m: f64,
    pub iterations: usize,
    pub last_correction_m: f64,
    pub conditioning: f64,
    /// The direction about which the matches say least, in the map.
    pub weakest: Vector,
    pub trouble: Option<&'static str>,
    pub spent: TimeSpent,
}

impl Window {
    /// Solves the window; what it was linearised at, where its solution is believed.
    pub(in crate::estimation) fn solve(&mut self, views: &Views) -> (Solved, Option<Linearised>) {
        if self.nominal.end_s() <= self.start.u_s {
            let trouble = Some("the IMU's samples do not reach it");
            return (Solved { trouble, ..Solved::default() }, None);
        }
        let first = self.nominal.times_s().partition_point(|t| *t < self.start.u_s - 1e-9);
        let layout = self.layout(first);
        let lidar = self.maker.lidar;
        let backup = (self.nominal.clone(), self.clock, self.biases, self.gravity, self.exaggerates);
        self.border.begin_window();
        let mut total = vec![0.0; layout.border()];
        let mut solved = Solved::default();
        let mut neighbours = Neighbours::default();
        let mut chosen = None;
        let mut linearised = None;
        let mut watch = Stopwatch::start();
        for iteration in 0..self.spec.solve.max_iterations {
            let scene = self.scene();
            solved.spent.placing_s += watch.lap_s();
            let chosen = chosen.get_or_insert_with(|| views.choose(&scene));
            solved.spent.views_s += watch.lap_s();
            if !neighbours.are_good_for(&scene) {
                neighbours = self.look_around(&scene, (views, chosen));
            }
            solved.spent.neighbours_s += watch.lap_s();
            let matches = self.match_up(&scene, views, &neighbours, iteration);
            let robust = Robust::of(&self.spec.solve, iteration);
            solved.describe(&matches, &robust);
            (solved.iterations, solved.surfels, solved.views) = (iteration + 1, scene.len(), chosen.len());
            let matches = self.believed(matches, &solved, &scene, views);
            solved.spent.matches_s += watch.lap_s();
            let seen = (&matches, &robust);
            let spent = &mut solved.spent;
            let Some((x, by)) = self.solve_linearised((first, &total), &scene, seen, &layout, spent) else {
                solved.trouble = Some("its equations are singular");
                break;
            };
            watch.lap_s(); // told by the solver itself
            if !(by.shift < BELIEVABLE.0 && by.turn < BELIEVABLE.1) {
                solved.trouble = Some("its correction is too large");
                break;
            }
            self.apply(&x, first, &layout, &mut total);
            self.knows_speed |= !matches.all.is_empty();
            self.sees_rest |= !matches.all.is_empty();
            neighbours.moved(by.shift + ARM_M * by.turn);
            solved.spent.correction_s += watch.lap_s();
            solved.last_correction_m = by.most();
            linearised = Some(Linearised { layout, scene, matches, robust });
            if solved.last_correction_m < self.spec.solve.settled_m {
                break;
            }
        }
        if solved.trouble.is_some() {
            (self.nominal, self.clock, self.biases, self.gravity, self.exaggerates) = backup;
            self.maker.lidar = lidar;
            self.border.take_back();
            linearised = None;
        }
        (solved, linearised)
    }

    /// The matches as far as they tell more than their errors; none of so few that they may all be wrong.
    fn believed(&self, mut matches: Matches, solved: &Solved, scene: &[Placed], views: &Views) -> Matches {
        if matches.all.len() < self.spec.solve.min_matches {
            return Matches::default();
        }
        if self.is_just_found() && solved.conditioning < UNTOLD {
            matches.all.iter_mut().for_each(|found| found.plane.forget(&solved.weakest));
        } else if solved.conditioning < self.spec.solve.weak_conditioning {
            self.straighten(&mut matches, scene, views, &solved.weakest);
        }
        matches
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
        let matrix = |at: usize| Matrix::from_fn(|r, c| border[at + 3 * r + c]);
        let more = Exaggerates { gyro: matrix(GYRO_MATRIX), accel: matrix(ACCEL_MATRIX) };
        self.nominal.measured_without(&more);
        self.exaggerates.add(&more);
        self.maker.lidar.range_m += border[RANGE];
        self.maker.lidar.turn = Rotation::from_scaled_axis(three(LIDAR_TURN)) * self.maker.lidar.turn;
        self.maker.lidar.shift += three(LIDAR_SHIFT);
    }
}

impl Solved {
    /// Number, residual and conditioning of a set of matches.
    fn describe(&mut self, matches: &Matches, robust: &Robust) {
        self.matches = matches.all.iter().filter(|one| matches!(one.with, With::Live(_))).count();
        self.view_matches = matches.all.len() - self.matches;
        let (mut weights, mut squares, mut information) = (0.0, 0.0, Matrix::zeros());
        for plane in matches.planes() {
            let weight = robust.weight(plane, plane.distance_m);
            weights += weight;
            squares += weight * plane.distance_m * plane.distance_m;
            information += plane.normal * plane.normal.transpose() * weight;
        }
        self.residual_rms_m = if weights > 0.0 { (squares / weights).sqrt() } else { 0.0 };
        self.conditioning = 0.0;
        if weights > 0.0 {
            let eigen = information.symmetric_eigen();
            let weakest: Vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
            // In a smooth tunnel no normal leans along it, but for errors: together they would pass for information.
            let along = |plane: &Plane| Some(plane.normal.dot(&weakest)).filter(|lean| lean.abs() > LEANING);
            let held = |plane: &Plane| along(plane).map(|lean| robust.weight(plane, plane.distance_m) * lean * lean);
            let least = matches.planes().filter_map(held).fold(0.0, |sum, term| sum + term);
            (self.conditioning, self.weakest) = (least / eigen.eigenvalues.max(), weakest);
        }
    }
}
