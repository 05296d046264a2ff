//! Parts of the window's normal equations: buffers, the robust kernel, and the matches with robust weights.

use super::correspondence::{Counterpart, Match, Matches};
use crate::layout::Layout;
use crate::normal_equations::{Factor, NormalEquations};
use crate::residual::FastMotion;
use crate::residual::matched::{COMMON, COMMON_WITHOUT_EXTRINSICS, Plane, SurfelJacobian};
use crate::residual::sums::{Coupling, SpanSums, SurfelSums};
use crate::spec::SolveSpec;
use crate::spline::Basis;
use crate::surfel::PlacedSurfel;
use crate::vectorised::vectorised;
use crate::views::Views;
use rayon::prelude::*;

/// Buffers that all solves of a window share.
#[derive(Debug)]
pub(super) struct Workspace {
    pub equations: NormalEquations,
    pub factor: Factor,
    pub bases: Vec<Basis>,
    /// By the IMU's scale errors and misalignments.
    pub fast_motion: FastMotion,
}

impl Default for Workspace {
    fn default() -> Self {
        let (equations, factor) = (NormalEquations::new(0), Factor::default());
        Self { equations, factor, bases: Vec::new(), fast_motion: FastMotion::default() }
    }
}

/// Cauchy robust kernel.
#[derive(Debug)]
pub(super) struct Robust {
    threshold: f64,
}

impl Robust {
    /// Creates the kernel of an iteration.
    ///
    /// The threshold shrinks from twice `cauchy` to `cauchy`.
    pub fn of(spec: &SolveSpec, iteration: usize) -> Self {
        let late = (iteration as f64 / (spec.max_iterations as f64 - 1.0).max(1.0)).min(1.0);
        Self { threshold: spec.cauchy * (2.0 - late) }
    }

    /// Returns the weight of a match with residual `residual_m`.
    pub fn weight(&self, plane: &Plane, residual_m: f64) -> f64 {
        let normalised2 = residual_m * residual_m / plane.variance;
        1.0 / (plane.variance * (1.0 + normalised2 / (self.threshold * self.threshold)))
    }
}

/// The matches, with all that their normal equations need.
pub(super) struct WeightedMatches<'a> {
    pub scene: &'a [PlacedSurfel],
    pub matches: &'a Matches,
    /// The views of which the matches have indices.
    pub views: &'a Views,
    pub robust: &'a Robust,
    pub clock_reference_s: f64,
    /// 1 to add the matches, -1 to remove them.
    pub sign: f64,
}

/// The normal equations of all matches, summed by the knot spans of their surfels, in the order of the spans.
pub(super) enum MatchSums {
    WithExtrinsics(SumsBySpan<COMMON>),
    WithoutExtrinsics(SumsBySpan<COMMON_WITHOUT_EXTRINSICS>),
}

/// Sums of spans, each with its first knot, and of pairs of spans.
pub(super) struct SumsBySpan<const B: usize> {
    spans: Vec<(i64, SpanSums<B>)>,
    pairs: Vec<((i64, i64), Coupling)>,
}

impl MatchSums {
    /// Adds the sums to the window's equations.
    pub fn add_to(&self, equations: &mut NormalEquations, layout: &Layout) {
        match self {
            Self::WithExtrinsics(sums) => sums.add_to(equations, layout),
            Self::WithoutExtrinsics(sums) => sums.add_to(equations, layout),
        }
    }
}

impl<const B: usize> SumsBySpan<B> {
    fn add_to(&self, equations: &mut NormalEquations, layout: &Layout) {
        self.spans.iter().for_each(|(span, sum)| sum.add_to(equations, layout, *span));
        self.pairs.iter().for_each(|((early, late), sum)| sum.add_to(equations, layout, *early, *late));
    }
}

impl WeightedMatches<'_> {
    /// Computes the sums of all matches.
    ///
    /// With `extrinsics`, they include the derivatives by the lidar extrinsics.
    pub fn sums(&self, extrinsics: bool) -> MatchSums {
        let weigh = |one: &Match| self.sign * self.robust.weight(&one.plane, one.plane.distance_m);
        let weights: Vec<f64> = self.matches.all.iter().map(weigh).collect();
        if extrinsics {
            MatchSums::WithExtrinsics(self.sums_by_span(&weights))
        } else {
            MatchSums::WithoutExtrinsics(self.sums_by_span(&weights))
        }
    }

    /// Sums run by run. The result has the same bits for any number of threads, and on all machines, because vector units
    /// of any width add in the same order.
    fn sums_by_span<const B: usize>(&self, weights: &[f64]) -> SumsBySpan<B> {
        let matches = self.matches;
        let of_span = |key: &usize| {
            let surfels = matches.spans.group(*key);
            (matches.span(*key), vectorised!(self.of_span::<B>(surfels, weights)))
        };
        let of_pair = |key: &usize| {
            let coupled = matches.couplings.group(*key);
            (matches.pair(*key), vectorised!(self.coupling::<B>(coupled, weights)))
        };
        let spans = || matches.spans.used().par_iter().map(of_span).collect();
        let pairs = || matches.couplings.used().par_iter().map(of_pair).collect();
        let (spans, pairs) = rayon::join(spans, pairs);
        SumsBySpan { spans, pairs }
    }

    /// The normal equations of all matches of the surfels of a span, by the motion of each surfel.
    #[inline(always)]
    fn of_span<const B: usize>(&self, surfels: &[u32], weights: &[f64]) -> SpanSums<B> {
        let mut sum = SpanSums::NONE;
        for index in surfels.iter().map(|index| *index as usize) {
            let surfel = &self.scene[index];
            let mut own = SurfelSums::NONE;
            for k in self.matches.of_surfels.group(index).iter().map(|k| *k as usize) {
                let (one, weight) = (&self.matches.all[k], weights[k]);
                let is_first = one.a as usize == index;
                let side = self.side(one, is_first);
                let side = if one.other().is_some() { side.together_with(&self.side(one, !is_first)) } else { side };
                own.add(&side, one.plane.distance_m, weight);
                // A match of two live surfels is visited from both sides.
                if is_first {
                    sum.common.add(&side, one.plane.distance_m, weight);
                }
            }
            sum.add(&own, &surfel.basis);
        }
        sum
    }

    /// The off-diagonal block of some matches between two spans.
    #[inline(always)]
    fn coupling<const B: usize>(&self, matches: &[u32], weights: &[f64]) -> Coupling {
        let mut sum = Coupling::NONE;
        for k in matches.iter().map(|k| *k as usize) {
            let one = &self.matches.all[k];
            let Some(other) = one.other() else { continue };
            let (a, b) = (&self.scene[one.a as usize], &self.scene[other]);
            let (a_side, b_side) = (self.side::<B>(one, true), self.side(one, false));
            if a.basis.first <= b.basis.first {
                sum.add(a, &a_side, b, &b_side, weights[k]);
            } else {
                sum.add(b, &b_side, a, &a_side, weights[k]);
            }
        }
        sum
    }

    /// The derivative of the match distance by the motion of the first surfel, or of the other one.
    #[inline(always)]
    fn side<const B: usize>(&self, one: &Match, first: bool) -> SurfelJacobian<B> {
        let normal = if first { one.plane.normal } else { -one.plane.normal };
        let surfel = if first { one.a as usize } else { one.other().unwrap_or(one.a as usize) };
        let side = SurfelJacobian::of(&self.scene[surfel], &normal, self.clock_reference_s);
        let Counterpart::Fixed { view, patch } = one.with else { return side };
        let sighting = self.views.view(view as usize).sighting(patch);
        sighting.map_or(side, |sighting| side.against_fixed(&normal, sighting))
    }
}
