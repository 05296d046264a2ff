//! The alignment that a covariance is relative to, and the window starts that it is built from.

use nalgebra::Matrix6;
use zsim_base::geometry::Vector;
use zsim_base::time::Stamp;

/// The rigid transform that aligns the first window starts with the truth by least squares.
///
/// A pose error relative to it is that of a trajectory aligned over the first seconds of the recording. The right-hand
/// side, a sum over the errors of the window starts, is stored as a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gauge {
    /// Pivot of the rotation, m.
    pub(super) pivot: Vector,
    /// The normal matrix, which depends only on the positions of the window starts.
    pub(super) normal: Matrix6<f64>,
}

/// A window start stored as a view until the gauge is complete.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    pub(super) number: u64,
    pub(super) pivot: Vector,
    pub(super) stamp: Stamp,
}
