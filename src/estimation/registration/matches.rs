//! What matched surfels say of the corrections.
//!
//! `e = n^T (mu_i - mu_j)`, `n` the normal of the plane that both have in common. A surfel's centre moves by `dt + dr x
//! arm` with the correction at its time, and with what the lidar is found to be: `lidar`. There are many more matches
//! than unknowns: they are summed first by the slots (halves of knot intervals) in which their two surfels were seen,
//! as if in their middle, then spread to the knots. Residuals are exact; their derivatives are those of an instant at
//! most a quarter of an interval away.

use super::RegistrationSpec;
use super::equations::{Beside, Equations, Link, Own};
use super::neighbours::InUse;
use super::scene::Scene;
use crate::estimation::matching::Matcher;
use crate::estimation::residual::matched::Plane;
use crate::estimation::window::MIN_SIGNIFICANT_TILT;
use crate::geometry::{Matrix, Vector};
use nalgebra::Vector6;
use rayon::prelude::*;

/// So many sums are made before they are spread to the knots: the bound of their memory.
const AT_ONCE: usize = 4096;

/// What was matched, in figures.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Tally {
    pub(super) matches: usize,
    /// Sums of weights, and of weighted squares of distances, m^2.
    pub(super) weights: f64,
    pub(super) squares: f64,
    /// What the matches know of the position: `sum w n n^T`.
    pub(super) information: Matrix,
    /// What they know of it along the weakest direction so far, by normals that lean to it.
    pub(super) held: f64,
    /// So much of that by matches of what was seen again.
    pub(super) held_again: f64,
}

impl Tally {
    fn count(&mut self, plane: &Plane, weight: f64, (weakest, again): (&Vector, bool)) {
        self.matches += 1;
        self.weights += weight;
        self.squares += weight * plane.distance_m * plane.distance_m;
        self.information += plane.normal * plane.normal.transpose() * weight;
        let lean = plane.normal.dot(weakest);
        if lean.abs() > MIN_SIGNIFICANT_TILT {
            self.held += weight * lean * lean;
            self.held_again += if again { weight * lean * lean } else { 0.0 };
        }
    }

    fn merge(&mut self, other: &Self) {
        self.matches += other.matches;
        self.weights += other.weights;
        self.squares += other.squares;
        self.information += other.information;
        self.held += other.held;
        self.held_again += other.held_again;
    }

    /// Weighted root mean square of the matches' distances, m.
    pub(super) fn rms_m(&self) -> f64 {
        if self.weights > 0.0 { (self.squares / self.weights).sqrt() } else { 0.0 }
    }
}

/// What some matches say, summed.
#[derive(Debug, Clone, Default)]
pub(super) struct Sum {
    pub(super) link: Link,
    pub(super) beside: Beside,
    pub(super) tally: Tally,
}

/// The matches of an iteration: which neighbours agree, and how much each counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matches<'a> {
    pub(super) scene: &'a Scene,
    pub(super) neighbours: &'a InUse,
    pub(super) matcher: &'a Matcher,
    pub(super) spec: &'a RegistrationSpec,
    /// Greatest distance along the normal, m.
    pub(super) gate_m: f64,
    /// The direction of which the matches before said least.
    pub(super) weakest: Vector,
}

impl Matches<'_> {
    /// Adds what all matches say to the equations.
    pub(super) fn add_to(&self, equations: &mut Equations) -> Tally {
        let mut tally = Tally::default();
        let mut own = vec![Own::default(); self.scene.middles.len()];
        for runs in self.neighbours.runs.chunks(AT_ONCE) {
            let sums: Vec<Sum> = runs.par_iter().map(|run| self.sum(&self.neighbours.pairs[run.clone()])).collect();
            for (run, Sum { link, beside, tally: of_run }) in
                runs.iter().zip(&sums).filter(|(_, sum)| sum.tally.matches > 0)
            {
                let (i, j) = self.neighbours.pairs[run.start];
                let slots = (self.scene.slots[i as usize] as usize, self.scene.slots[j as usize] as usize);
                own[slots.0].merge(&link.first);
                own[slots.1].merge(&link.second);
                equations.add_cross(&self.scene.middles[slots.0], &self.scene.middles[slots.1], &link.cross);
                equations.beside.merge(beside);
                tally.merge(of_run);
            }
        }
        for (own, middle) in own.iter().zip(&self.scene.middles) {
            equations.add_own(middle, own);
        }
        tally
    }

    /// What the matches among `pairs`, of the same two slots, say.
    pub(super) fn sum(&self, pairs: &[(u32, u32)]) -> Sum {
        let mut sum = Sum::default();
        for (i, j) in pairs.iter().map(|(i, j)| (*i as usize, *j as usize)) {
            let (a, b) = (&self.scene.patches[i], &self.scene.patches[j]);
            if !self.matcher.agree(a, b, self.gate_m) {
                continue;
            }
            let plane = Plane::of(a, b, self.spec.match_sigma_m);
            let weight = self.weight(&plane, (i, j));
            let by = |arm: &Vector, normal: &Vector| {
                let turn = arm.cross(normal);
                Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z)
            };
            let (by_a, by_b) = (by(&self.scene.arms[i], &plane.normal), -by(&self.scene.arms[j], &plane.normal));
            let by_shared = self.scene.sights[i].by(&plane.normal) - self.scene.sights[j].by(&plane.normal);
            sum.link.add((&by_a, &by_b), plane.distance_m, weight);
            sum.link.first.add_shared(&by_a, &by_shared, weight);
            sum.link.second.add_shared(&by_b, &by_shared, weight);
            sum.beside.add(&by_shared, plane.distance_m, weight);
            let again = self.scene.apart_s((i, j)) > self.spec.again_after_s;
            sum.tally.count(&plane, weight, (&self.weakest, again));
        }
        sum
    }

    /// Cauchy's weight of a match. A surfel's error is in all its matches: together they count as one.
    fn weight(&self, plane: &Plane, (i, j): (usize, usize)) -> f64 {
        let share = |k: usize| 1.0 / f64::from(self.neighbours.counts[k].max(1));
        let normalised2 = plane.distance_m * plane.distance_m / plane.variance;
        let robust = 1.0 / (1.0 + normalised2 / (self.spec.cauchy * self.spec.cauchy));
        self.spec.match_weight * (share(i) + share(j)) * robust / plane.variance
    }
}
