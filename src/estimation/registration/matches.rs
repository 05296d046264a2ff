//! Residuals of matched surfels and their contribution to the normal equations.
//!
//! `e = n^T (mu_i - mu_j)` with the normal `n` of the common plane. The centre of a surfel moves by `dt + dr x arm` with the
//! correction at that time, and with the range bias (`lidar_model`). There are many more matches than unknowns: they are first
//! summed by the time bins (half knot intervals) of both surfels, with derivatives at the middle of the bins, then distributed
//! to the knots. Residuals are exact; derivatives are evaluated at most a quarter of a knot interval off.

use super::equations::{Equations, PairTerm, SharedTerm, UnaryTerm};
use super::neighbours::ActiveNeighbours;
use super::scene::Scene;
use crate::RegistrationSpec;
use crate::matching::Matcher;
use crate::residual::matched::MIN_SIGNIFICANT_TILT;
use crate::residual::matched::Plane;
use crate::surfel::Patch;
use nalgebra::Vector6;
use rayon::prelude::*;
use zsim_base::geometry::{Matrix, Vector};

/// Number of pairs of bins that are summed before they are distributed to the knots: bounds the memory.
const PAIRS_AT_ONCE: usize = 4096;

/// Statistics of the matches.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct MatchStatistics {
    pub(super) matches: usize,
    /// Sum of weights, and weighted sum of squared distances, m^2.
    pub(super) weights: f64,
    pub(super) squares: f64,
    /// Information about the position by matches between submaps: `sum w n n^T`.
    pub(super) information: Matrix,
    /// Information along the weakest direction, only from normals with a large component along it.
    pub(super) weak_information: f64,
    /// The part of it from matches of revisited surfaces.
    pub(super) revisited_information: f64,
}

impl MatchStatistics {
    fn count(&mut self, plane: &Plane, weight: f64) {
        self.matches += 1;
        self.weights += weight;
        self.squares += weight * plane.distance_m * plane.distance_m;
    }

    /// Adds the information of a match between two submaps.
    fn inform(&mut self, plane: &Plane, weight: f64, weakest: &Vector, is_revisit: bool) {
        self.information += plane.normal * plane.normal.transpose() * weight;
        let component = plane.normal.dot(weakest);
        if component.abs() > MIN_SIGNIFICANT_TILT {
            self.weak_information += weight * component * component;
            self.revisited_information += if is_revisit { weight * component * component } else { 0.0 };
        }
    }

    fn merge(&mut self, other: &Self) {
        self.matches += other.matches;
        self.weights += other.weights;
        self.squares += other.squares;
        self.information += other.information;
        self.weak_information += other.weak_information;
        self.revisited_information += other.revisited_information;
    }

    /// Weighted root mean square distance of the matches, m.
    pub(super) fn rms_m(&self) -> f64 {
        if self.weights > 0.0 { (self.squares / self.weights).sqrt() } else { 0.0 }
    }
}

/// Sums over the matches between two time bins.
#[derive(Debug, Clone, Default)]
pub(super) struct BinPairSums {
    pub(super) pair_term: PairTerm,
    pub(super) shared_term: SharedTerm,
    pub(super) statistics: MatchStatistics,
}

/// The matches of an iteration, from neighbours that agree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matches<'a> {
    pub(super) scene: &'a Scene,
    pub(super) neighbours: &'a ActiveNeighbours,
    pub(super) matcher: &'a Matcher,
    pub(super) spec: &'a RegistrationSpec,
    /// Maximum distance along the normal, m.
    pub(super) gate_m: f64,
    /// Minimum time between the surfels of a match that counts as a revisit, s.
    pub(super) revisit_s: f64,
    /// Direction with the least information in the previous iteration.
    pub(super) weakest: Vector,
}

impl Matches<'_> {
    /// Adds all matches to the equations.
    pub(super) fn add_to(&self, equations: &mut Equations) -> MatchStatistics {
        let mut statistics = MatchStatistics::default();
        let mut unary = vec![UnaryTerm::default(); self.scene.bin_bases.len()];
        for runs in self.neighbours.runs.chunks(PAIRS_AT_ONCE) {
            let sums: Vec<BinPairSums> =
                runs.par_iter().map(|run| self.sum(&self.neighbours.pairs[run.clone()])).collect();
            for (run, BinPairSums { pair_term, shared_term, statistics: of_run }) in
                runs.iter().zip(&sums).filter(|(_, sum)| sum.statistics.matches > 0)
            {
                let (i, j) = self.neighbours.pairs[run.start];
                let bins = (self.scene.bins[i as usize] as usize, self.scene.bins[j as usize] as usize);
                unary[bins.0].merge(&pair_term.first);
                unary[bins.1].merge(&pair_term.second);
                equations.add_cross(&self.scene.bin_bases[bins.0], &self.scene.bin_bases[bins.1], &pair_term.cross);
                equations.shared_term.merge(shared_term);
                statistics.merge(of_run);
            }
        }
        for (unary, basis) in unary.iter().zip(&self.scene.bin_bases) {
            equations.add_unary(basis, unary);
        }
        statistics
    }

    /// Sums the matches among `pairs`, which are of the same two time bins.
    pub(super) fn sum(&self, pairs: &[(u32, u32)]) -> BinPairSums {
        let mut sum = BinPairSums::default();
        for (i, j) in pairs.iter().map(|(i, j)| (*i as usize, *j as usize)) {
            let (a, b) = (&self.scene.patches[i], &self.scene.patches[j]);
            if !self.matcher.pass_gates(a, b, self.gate_m) {
                continue;
            }
            let mut plane = Plane::of(a, b, self.spec.match_sigma_m);
            plane.variance +=
                self.variance_of_few_points(a, &plane.normal) + self.variance_of_few_points(b, &plane.normal);
            let weight = self.weight(&plane, i, j);
            let by = |arm: &Vector, normal: &Vector| {
                let turn = arm.cross(normal);
                Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z)
            };
            let (by_a, by_b) = (by(&self.scene.arms[i], &plane.normal), -by(&self.scene.arms[j], &plane.normal));
            let by_shared = self.scene.rays[i].derivative(&plane.normal) - self.scene.rays[j].derivative(&plane.normal);
            sum.pair_term.add(&by_a, &by_b, plane.distance_m, weight);
            sum.pair_term.first.add_shared(&by_a, &by_shared, weight);
            sum.pair_term.second.add_shared(&by_b, &by_shared, weight);
            sum.shared_term.add(&by_shared, plane.distance_m, weight);
            sum.statistics.count(&plane, weight);
            if !self.scene.are_of_one_submap(i, j) {
                let is_revisit = self.scene.time_difference_s(i, j) > self.revisit_s;
                sum.statistics.inform(&plane, weight, &self.weakest, is_revisit);
            }
        }
        sum
    }

    /// Additional variance along `normal` of a surfel with few points, m^2: the noise of its mean is inversely proportional
    /// to their number.
    fn variance_of_few_points(&self, patch: &Patch, normal: &Vector) -> f64 {
        let excess = (self.spec.full_weight_points as f64 / patch.points - 1.0).max(0.0);
        excess * normal.dot(&(patch.covariance * normal)).max(0.0)
    }

    /// Weight of a match with a Cauchy kernel.
    ///
    /// The error of a surfel is common to all matches of the surfel; together they have the weight of one match.
    fn weight(&self, plane: &Plane, i: usize, j: usize) -> f64 {
        let weight_share = |k: usize| 1.0 / f64::from(self.neighbours.counts[k].max(1));
        let normalised2 = plane.distance_m * plane.distance_m / plane.variance;
        let robust = 1.0 / (1.0 + normalised2 / (self.spec.cauchy * self.spec.cauchy));
        (weight_share(i) + weight_share(j)) * robust / plane.variance
    }
}
