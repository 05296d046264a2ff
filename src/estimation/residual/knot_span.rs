//! Derivatives by the four knots of a span.

use crate::spline::Basis;

/// Unknowns of the four knots about a span.
pub(super) const SPAN_UNKNOWNS: usize = 24;

/// Converts six derivatives by a surfel's motion to derivatives by the four knots of the span.
#[inline(always)]
pub(super) fn over_knots(by_motion: &[f64], basis: &Basis) -> [f64; SPAN_UNKNOWNS] {
    let mut knots = [0.0; SPAN_UNKNOWNS];
    add_over_knots(&mut knots, by_motion, basis);
    knots
}

/// Adds six derivatives by a surfel's motion, converted to derivatives by the four knots of the span, to `sums`.
///
/// `by_motion` starts with the six.
#[inline(always)]
pub(super) fn add_over_knots(sums: &mut [f64; SPAN_UNKNOWNS], by_motion: &[f64], basis: &Basis) {
    for (knot, value) in sums.chunks_exact_mut(6).zip(basis.value) {
        add_scaled(knot, by_motion, value);
    }
}

#[inline(always)]
pub(super) fn add_scaled(sums: &mut [f64], terms: &[f64], scale: f64) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += scale * term;
    }
}
