//! Normal equations of matches, summed by the knot spans of their surfels.
//!
//! All surfels of a span depend on the same four knots. Their terms are summed in small dense blocks, which fit into
//! the L1 cache, and enter the equations a block at a time.

use super::knot_span::{SPAN_UNKNOWNS, add_over_knots, add_scaled, over_knots};
use super::matched::SurfelJacobian;
use crate::layout::{CLOCK, Layout};
use crate::normal_equations::NormalEquations;
use crate::spline::Basis;
use crate::surfel::PlacedSurfel;

/// The terms of all matches of a surfel by the motion of that surfel.
///
/// `sum w g v^T`, with `g` the derivative of `e` by rotation and translation, and `v` in turn `g`, the derivative by
/// the border, and `e`.
///
/// A surfel has several matches, and its motion depends on many unknowns: this intermediate sum keeps a match cheap.
#[derive(Debug)]
pub(crate) struct SurfelSums<const B: usize> {
    square: [[f64; WIDTH]; 6],
    common: [[f64; WIDTH]; B],
    right: [f64; WIDTH],
}

/// The six derivatives by the motion, and two zeros that fill the vector units.
const WIDTH: usize = 8;

impl<const B: usize> SurfelSums<B> {
    /// No match yet.
    pub(crate) const NONE: Self = Self { square: [[0.0; WIDTH]; 6], common: [[0.0; WIDTH]; B], right: [0.0; WIDTH] };

    /// Adds a match with derivatives `side`.
    #[inline(always)]
    pub(crate) fn add(&mut self, side: &SurfelJacobian<B>, distance_m: f64, weight: f64) {
        let [a, b, c, d, e, f] = side.own;
        let own = [a, b, c, d, e, f, 0.0, 0.0];
        for (square, by) in self.square.iter_mut().zip(side.own) {
            add_scaled(square, &own, weight * by);
        }
        for (sums, by) in self.common.iter_mut().zip(side.common) {
            add_scaled(sums, &own, weight * by);
        }
        add_scaled(&mut self.right, &own, weight * distance_m);
    }
}

/// The terms of all matches of the surfels of a span, by their motion and by the common unknowns.
#[derive(Debug)]
pub(crate) struct SpanSums<const B: usize> {
    /// Up to the diagonal, by knots.
    square: [[f64; SPAN_UNKNOWNS]; SPAN_UNKNOWNS],
    by_border: [[f64; SPAN_UNKNOWNS]; B],
    right: [f64; SPAN_UNKNOWNS],
    pub(crate) common: CommonSums<B>,
}

impl<const B: usize> SpanSums<B> {
    /// No surfel yet.
    pub(crate) const NONE: Self = Self {
        square: [[0.0; SPAN_UNKNOWNS]; SPAN_UNKNOWNS],
        by_border: [[0.0; SPAN_UNKNOWNS]; B],
        right: [0.0; SPAN_UNKNOWNS],
        common: CommonSums::NONE,
    };

    /// Adds the terms of a surfel; `basis` is the spline basis at the time of the surfel.
    #[inline(always)]
    pub(crate) fn add(&mut self, own: &SurfelSums<B>, basis: &Basis) {
        let mut square = [[0.0; SPAN_UNKNOWNS]; 6];
        for (row, by_motion) in square.iter_mut().zip(&own.square) {
            add_over_knots(row, by_motion, basis);
        }
        for (knot, (rows, value)) in self.square.chunks_exact_mut(6).zip(basis.value).enumerate() {
            for (sums, row) in rows.iter_mut().zip(&square) {
                add_scaled(&mut sums[..6 * (knot + 1)], row, value);
            }
        }
        for (sums, row) in self.by_border.iter_mut().zip(&own.common) {
            add_over_knots(sums, row, basis);
        }
        add_scaled(&mut self.right, &over_knots(&own.right, basis), -1.0);
    }

    /// Adds the sum to the window's equations; `span` is the index of the first knot.
    pub(crate) fn add_to(&self, equations: &mut NormalEquations, layout: &Layout, span: i64) {
        let (first, common) = (layout.knot(span), layout.border() + CLOCK);
        for (row, sums) in self.square.iter().enumerate() {
            equations.add_row(first + row, first, &sums[..=row]);
            equations.add_right(first + row, self.right[row]);
        }
        for (unknown, sums) in self.by_border.iter().enumerate() {
            equations.add_row(common + unknown, first, sums);
        }
        self.common.add_to(equations, common);
    }
}

/// The terms of all matches by the common unknowns: `sum w b v^T`, with `b` the derivative of `e` by them, and `v` in
/// turn `b` and `e`.
#[derive(Debug)]
pub(crate) struct CommonSums<const B: usize> {
    square: [[f64; B]; B],
    right: [f64; B],
}

impl<const B: usize> CommonSums<B> {
    const NONE: Self = Self { square: [[0.0; B]; B], right: [0.0; B] };

    /// Adds a match; `side` has the derivatives of both surfels.
    #[inline(always)]
    pub(crate) fn add(&mut self, side: &SurfelJacobian<B>, distance_m: f64, weight: f64) {
        for (square, by) in self.square.iter_mut().zip(side.common) {
            add_scaled(square, &side.common, weight * by);
        }
        add_scaled(&mut self.right, &side.common, -weight * distance_m);
    }

    /// Adds the sum to the equations, in which the common unknowns start at `first`.
    fn add_to(&self, equations: &mut NormalEquations, first: usize) {
        for (row, sums) in self.square.iter().enumerate() {
            equations.add_row(first + row, first, &sums[..=row]);
            equations.add_right(first + row, self.right[row]);
        }
    }
}

/// The off-diagonal block of the matches between two spans: rows by the unknowns of the later span.
#[derive(Debug)]
pub(crate) struct Coupling([[f64; SPAN_UNKNOWNS]; SPAN_UNKNOWNS]);

impl Coupling {
    /// No match yet.
    pub(crate) const NONE: Self = Self([[0.0; SPAN_UNKNOWNS]; SPAN_UNKNOWNS]);

    /// Adds a match of a surfel of the earlier span with one of the later.
    #[inline(always)]
    pub(crate) fn add<const B: usize>(
        &mut self,
        early: &PlacedSurfel,
        early_side: &SurfelJacobian<B>,
        late: &PlacedSurfel,
        late_side: &SurfelJacobian<B>,
        weight: f64,
    ) {
        let row = over_knots(&early_side.own, &early.basis);
        for (sums, by) in self.0.iter_mut().zip(over_knots(&late_side.own, &late.basis)) {
            add_scaled(sums, &row, weight * by);
        }
    }

    /// Adds the block to the window's equations; `early` and `late` are the first knots of the spans.
    pub(crate) fn add_to(&self, equations: &mut NormalEquations, layout: &Layout, early: i64, late: i64) {
        let (first_column, first_row) = (layout.knot(early), layout.knot(late));
        for (row, sums) in self.0.iter().enumerate().map(|(k, sums)| (first_row + k, sums)) {
            // If the spans have common knots, the columns reach the diagonal; those after it belong to the mirrored
            // block.
            let below = row.saturating_sub(first_column).min(SPAN_UNKNOWNS);
            equations.add_row(row, first_column, &sums[..below]);
            for (column, sum) in sums.iter().enumerate().skip(below).map(|(k, sum)| (first_column + k, sum)) {
                equations.add_entry(row, column, if row == column { 2.0 * sum } else { *sum });
            }
        }
    }
}
