//! Residuals that hang on a few knots and on what is unknown of the IMU, summed before they go into the equations.
//!
//! All samples of a knot's span hang on the same unknowns: as long as they do, their products are summed in a small
//! dense block.

use super::{CLOCK, GYRO_MATRIX, Layout};
use crate::estimation::normal_equations::NormalEquations;
use pulp::Arch;

/// Most knots that a residual hangs on.
pub(super) const KNOTS: usize = 6;
/// Unknowns of the knots.
const OF_KNOTS: usize = 6 * KNOTS;
/// Biases and tilt, which begin the border, then both exaggerations, which end it.
const UNKNOWNS: usize = OF_KNOTS + CLOCK + 18;

/// The derivatives of a residual.
#[derive(Debug)]
pub(super) struct Row {
    /// Index of the first knot that it hangs on.
    first: i64,
    by: [f64; UNKNOWNS],
}

impl Row {
    /// A residual that hangs on nothing yet, and on no knots before `first`.
    pub(super) fn from(first: i64) -> Self {
        Self { first, by: [0.0; UNKNOWNS] }
    }

    /// By one of the six unknowns of a knot, counted from the first.
    pub(super) fn knot(&mut self, knot: usize, axis: usize) -> &mut f64 {
        &mut self.by[6 * knot + axis]
    }

    /// By an unknown of the border: a bias, the tilt, or an exaggeration.
    pub(super) fn border(&mut self, unknown: usize) -> &mut f64 {
        let place = if unknown < CLOCK { unknown } else { CLOCK + unknown - GYRO_MATRIX };
        &mut self.by[OF_KNOTS + place]
    }
}

/// The sum of some residuals' products.
#[derive(Debug)]
pub(super) struct Rows {
    /// Index of the first knot that those in it hang on, if there are any.
    first: Option<i64>,
    square: [[f64; UNKNOWNS]; UNKNOWNS],
    right: [f64; UNKNOWNS],
}

impl Rows {
    /// None yet.
    pub(super) fn none() -> Self {
        Self { first: None, square: [[0.0; UNKNOWNS]; UNKNOWNS], right: [0.0; UNKNOWNS] }
    }

    /// Adds a residual; where it hangs on other knots than those before, they go into the equations.
    pub(super) fn add(
        &mut self,
        row: &Row,
        (residual, weight): (f64, f64),
        equations: &mut NormalEquations,
        layout: &Layout,
    ) {
        if self.first != Some(row.first) {
            self.move_to(equations, layout);
            self.first = Some(row.first);
        }
        Arch::new().dispatch(|| self.add_products(&row.by, residual, weight));
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

    /// All go into the equations; none is left.
    pub(super) fn move_to(&mut self, equations: &mut NormalEquations, layout: &Layout) {
        let Some(first) = self.first.take().map(|first| layout.knot(first)) else { return };
        // Behind the last knot that any hangs on there may be no more.
        let used = self.square[..OF_KNOTS].iter().rposition(|row| row.iter().any(|sum| *sum != 0.0));
        let knots = used.map_or(0, |last| last + 1);
        for row in (0..knots).chain(OF_KNOTS..UNKNOWNS) {
            let unknown = if row < OF_KNOTS { first + row } else { place_in_border(row, layout) };
            let sums = std::mem::replace(&mut self.square[row], [0.0; UNKNOWNS]);
            if sums[row] == 0.0 {
                continue; // none hangs on it
            }
            equations.add_right(unknown, std::mem::take(&mut self.right[row]));
            equations.add_row(unknown, first, &sums[..knots.min(row + 1)]);
            for (other, sum) in sums.iter().enumerate().take(row + 1).skip(OF_KNOTS) {
                equations.add_entry(unknown, place_in_border(other, layout), *sum);
            }
        }
    }
}

fn place_in_border(unknown: usize, layout: &Layout) -> usize {
    let place = unknown - OF_KNOTS;
    layout.border() + if place < CLOCK { place } else { GYRO_MATRIX + place - CLOCK }
}
