//! The nodes of the trajectory that a window corrects.

use crate::spline::Basis;
use crate::strapdown::{Interval, State};

/// The nodes of the trajectory that a window corrects, and the IMU intervals between them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nodes<'a> {
    pub(crate) states: &'a [State],
    /// The spline basis at each state.
    pub(crate) bases: &'a [Basis],
    pub(crate) intervals: &'a [Interval],
}
