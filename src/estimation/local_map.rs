//! The local map: the fixed views, and their joint covariance with the start of the window.

use super::consider::ConsiderCovariance;
use super::matching::Matcher;
use super::spec::EstimatorSpec;
use super::views::{SeenSegment, Views};

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

    /// Adds a segment that ends at the window start.
    pub(super) fn add_segment(&mut self, segment: &SeenSegment, matcher: &Matcher) {
        let update = self.views.add_segment(segment, matcher, self.consider.pivot());
        self.consider.update_views(update);
    }
}
