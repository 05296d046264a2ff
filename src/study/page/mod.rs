//! Gathers the data of the page of a run.

mod charts;
mod cloud;
pub(super) mod links;
mod paths;
mod run_results;
mod timeline;

use super::sampled_truth::SampledTruth;
pub(super) use links::{blocks as blocks_of, of as links_of};
pub(super) use run_results::RunResults;
use zsim_base::geometry::{Pose, Vector};
use zsim_base::time::Stamp;
use zsim_report::Metrics;
use zsim_report::page::{MAX_PAGE_TRIANGLES, RunPage, View};
use zsim_world::World;

impl RunResults<'_> {
    /// Gathers the data of the page.
    pub(super) fn page<'m>(&self, metrics: &'m Metrics, manifest: &'m str) -> RunPage<'m> {
        RunPage {
            metrics,
            manifest,
            parts: self.open.timing.parts().to_vec(),
            view: self.view(),
            charts: charts::all(self),
            timeline: timeline::rows(self.open, &metrics.integrity.causes),
        }
    }

    fn view(&self) -> View {
        let of_truth = |poses: fn(&SampledTruth) -> &[(Stamp, Pose)]| {
            self.truth.map(|truth| paths::truth(self, poses(truth))).unwrap_or_default()
        };
        let world = self.world();
        let (surfaces, surfaces_are_partial) = world.map(surfaces).unwrap_or_default();
        let head = self.origin.manifest.run.as_ref().map(|run| &run.head.spec);
        View {
            points: cloud::points(self),
            materials: world.map_or(&[][..], World::materials).iter().map(|material| material.name.clone()).collect(),
            estimate: paths::estimate(self),
            truth: of_truth(|truth| &truth.heads),
            base: of_truth(|truth| &truth.bases),
            surfaces,
            surface_materials: Vec::new(),
            surfaces_are_partial,
            links: head.map(|head| links::of(&head.linkage)).unwrap_or_default(),
            parts: head.map(|head| links::blocks(&head.parts)).unwrap_or_default(),
        }
    }

    /// The scene, if it is known and the estimate is aligned with it.
    fn world(&self) -> Option<&World> {
        self.alignment().and(self.origin.surroundings.map(|surroundings| surroundings.world))
    }

    fn alignment(&self) -> Option<Pose> {
        self.best.comparison.and_then(|comparison| comparison.world_from_map)
    }

    /// The transform from the map to the frame of the view; the identity without truth.
    fn view_from_map(&self) -> Pose {
        self.alignment().unwrap_or_else(Pose::identity)
    }

    /// Time since the first measurement, s.
    fn seconds(&self, stamp: Stamp) -> f64 {
        stamp.seconds_since(self.open.recorded.0)
    }
}

/// The triangles of the scene: the largest ones, and whether others are missing.
pub(super) fn surfaces(world: &World) -> (Vec<[Vector; 3]>, bool) {
    let mut triangles: Vec<_> = world.triangles().map(|(triangle, _)| triangle).collect();
    let are_partial = triangles.len() > MAX_PAGE_TRIANGLES;
    if are_partial {
        let twice_area = |[a, b, c]: &[Vector; 3]| (b - a).cross(&(c - a)).norm();
        triangles.sort_by(|a, b| twice_area(b).total_cmp(&twice_area(a)));
        triangles.truncate(MAX_PAGE_TRIANGLES);
    }
    (triangles, are_partial)
}
