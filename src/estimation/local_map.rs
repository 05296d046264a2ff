//! The local map: the fixed views, and their joint covariance with the start of the window.

use super::consider::ConsiderCovariance;
use super::matching::Matcher;
use super::spec::EstimatorSpec;
use super::views::{SeenPatch, Views};
use crate::measurement::LidarCorrection;

/// The surfaces with which windows are matched, and the errors of these surfaces and of the window start.
#[derive(Debug)]
pub(super) struct LocalMap {
    pub(super) views: Views,
    /// Joint covariance of the window start and of the views.
    pub(super) consider: ConsiderCovariance,
}

impl LocalMap {
    /// A map without views; `consider` is the covariance of the window start.
    pub(super) fn without_views(spec: &EstimatorSpec, consider: ConsiderCovariance) -> Self {
        Self { views: Views::new(&spec.views, spec.fixed_views), consider }
    }

    /// Adds the patches of a segment of `seconds` that ends at the window start, placed with `lidar`.
    pub(super) fn add_segment(
        &mut self,
        patches: &[SeenPatch],
        lidar: LidarCorrection,
        seconds: f64,
        matcher: &Matcher,
    ) {
        let update = self.views.add_segment(patches, lidar, seconds, matcher, self.consider.pivot());
        self.consider.update_views(update);
    }
}
