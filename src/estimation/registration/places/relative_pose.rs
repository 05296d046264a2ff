//! Relative poses of submaps.

use super::alignment::Alignment;
use nalgebra::Matrix4;

/// Matching converges from pose errors up to this, m and rad; larger ones need a loop closure.
pub(super) const MATCHING_REACH: (f64, f64) = (0.3, 0.03);

/// Statistics of the loop closure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LoopReport {
    /// Number of similar pairs of nodes that disagree at the open-loop pose.
    pub proposed: usize,
    /// Number of these that were verified by registration.
    pub verified: usize,
    /// Number of applied loop closures that exceed the matching distance.
    pub closed: usize,
}

/// Measured relative pose of two nodes: a constraint of the pose graph.
#[derive(Debug, Clone, Copy)]
pub(in crate::registration) struct RelativePose {
    /// Times of the later and the earlier node, s; the alignment is the pose of the later one in the earlier one.
    pub(in crate::registration) times_s: (f64, f64),
    pub(in crate::registration) alignment: Alignment,
    /// Information about `[yaw, shift]`, 1/rad^2 and 1/m^2.
    pub(in crate::registration) information: Matrix4<f64>,
}
