//! Products of inertial residuals, summed in dense blocks before they enter the equations.
//!
//! All samples of a knot span depend on the same unknowns, so their products are summed in one small dense block.

use crate::layout::{GYRO_MATRIX, Layout, RANGE};
use crate::normal_equations::NormalEquations;
use crate::vectorised::vectorised;

/// Maximum number of knots that a residual depends on.
pub(super) const KNOTS: usize = 6;
/// Unknowns of the knots.
const KNOT_UNKNOWNS: usize = 6 * KNOTS;
/// Unknowns at the start of the border that a residual may depend on: biases, tilt, clock offset and rate.
const START: usize = RANGE;
/// Knots, then the start of the border, then both scale and misalignment matrices (end of the border).
const UNKNOWNS: usize = KNOT_UNKNOWNS + START + 18;

/// The derivatives of a residual.
#[derive(Debug)]
pub(super) struct ResidualRow {
    /// Index of the first knot that the residual depends on.
    first: i64,
    by: [f64; UNKNOWNS],
}

impl ResidualRow {
    /// The derivatives of a residual on knots from `first` on, all zero.
    pub(super) fn from(first: i64) -> Self {
        Self { first, by: [0.0; UNKNOWNS] }
    }

    /// The derivative by one of the six unknowns of a knot, counted from the first.
    pub(super) fn knot(&mut self, knot: usize, axis: usize) -> &mut f64 {
        &mut self.by[6 * knot + axis]
    }

    /// The derivative by an unknown of the border: bias, tilt, clock, scale or misalignment.
    pub(super) fn border(&mut self, unknown: usize) -> &mut f64 {
        let index = if unknown < START { unknown } else { START + unknown - GYRO_MATRIX };
        &mut self.by[KNOT_UNKNOWNS + index]
    }
}

/// The sum of the products of some residuals.
#[derive(Debug)]
pub(super) struct ResidualSums {
    /// Index of the first knot of the summed residuals, if any.
    first: Option<i64>,
    square: [[f64; UNKNOWNS]; UNKNOWNS],
    right: [f64; UNKNOWNS],
}

impl ResidualSums {
    /// An empty sum.
    pub(super) fn none() -> Self {
        Self { first: None, square: [[0.0; UNKNOWNS]; UNKNOWNS], right: [0.0; UNKNOWNS] }
    }

    /// Adds a residual; if the knots differ from the previous ones, flushes the sum first.
    pub(super) fn add(
        &mut self,
        row: &ResidualRow,
        residual: f64,
        weight: f64,
        equations: &mut NormalEquations,
        layout: &Layout,
    ) {
        if self.first != Some(row.first) {
            self.flush_to(equations, layout);
            self.first = Some(row.first);
        }
        vectorised!(self.add_products(&row.by, residual, weight));
    }

    #[inline(always)]
    fn add_products(&mut self, by: &[f64; UNKNOWNS], residual: f64, weight: f64) {
        for (k, scale) in by.iter().enumerate().filter(|(_, by)| **by != 0.0) {
            let scaled = weight * scale;
            self.right[k] -= scaled * residual;
            for (sum, other) in self.square[k][..=k].iter_mut().zip(by) {
                *sum += scaled * other;
            }
        }
    }

    /// Adds the products summed since the last call, of rows with the same first knot, to the equations, and clears them.
    pub(super) fn flush_to(&mut self, equations: &mut NormalEquations, layout: &Layout) {
        let Some(first) = self.first.take().map(|first| layout.knot(first)) else { return };
        // Knots after the last used one may be outside of the window.
        let used = self.square[..KNOT_UNKNOWNS].iter().rposition(|row| row.iter().any(|sum| *sum != 0.0));
        let knots = used.map_or(0, |last| last + 1);
        for row in (0..knots).chain(KNOT_UNKNOWNS..UNKNOWNS) {
            let unknown = if row < KNOT_UNKNOWNS { first + row } else { border_index(row, layout) };
            let sums = std::mem::replace(&mut self.square[row], [0.0; UNKNOWNS]);
            if sums[row] == 0.0 {
                continue; // no residual depends on it
            }
            equations.add_right(unknown, std::mem::take(&mut self.right[row]));
            equations.add_row(unknown, first, &sums[..knots.min(row + 1)]);
            for (other, sum) in sums.iter().enumerate().take(row + 1).skip(KNOT_UNKNOWNS) {
                equations.add_entry(unknown, border_index(other, layout), *sum);
            }
        }
    }
}

fn border_index(unknown: usize, layout: &Layout) -> usize {
    let index = unknown - KNOT_UNKNOWNS;
    layout.border() + if index < START { index } else { GYRO_MATRIX + index - START }
}
