//! Gathers the data of the page of a run.

mod charts;
mod run_results;
mod timeline;
mod view;

use super::sampled_truth::SampledTruth;
pub(super) use run_results::RunResults;
use zsim_base::geometry::Pose;
use zsim_base::time::Stamp;
use zsim_report::Metrics;
use zsim_report::page::{RunPage, View, links, static_surfaces};
use zsim_world::World;

impl RunResults<'_> {
    /// Gathers the data of the page.
    pub(super) fn page<'m>(&self, metrics: &'m Metrics, manifest: &'m str) -> RunPage<'m> {
        RunPage {
            metrics,
            manifest,
            parts: self.loops.open.timing.parts().to_vec(),
            view: self.view(),
            charts: charts::all(self),
            timeline: timeline::rows(&self.loops.open, self.integrity.causes()),
        }
    }

    fn view(&self) -> View {
        let of_truth = |poses: fn(&SampledTruth) -> &[(Stamp, Pose)]| {
            self.loops.truth.as_ref().map(|truth| view::truth(self, poses(truth))).unwrap_or_default()
        };
        let world = self.world();
        let (surfaces, surfaces_are_partial) = world.map(static_surfaces).unwrap_or_default();
        let head = self.origin.manifest.run.as_ref().map(|run| &run.head.spec);
        View {
            points: view::points(self),
            materials: world.map_or(&[][..], World::materials).iter().map(|material| material.name.clone()).collect(),
            estimate: view::estimate(self),
            truth: of_truth(|truth| &truth.heads),
            base: of_truth(|truth| &truth.bases),
            surfaces,
            surface_materials: Vec::new(),
            surfaces_are_partial,
            links: head.map(|head| links::of(&head.linkage)).unwrap_or_default(),
            parts: head.map(|head| links::blocks(&head.parts)).unwrap_or_default(),
        }
    }

    /// The true clock offsets, if they are known.
    pub(super) fn true_offsets(&self) -> Option<&[(Stamp, f64)]> {
        self.loops.truth.as_ref().map(|truth| &truth.clock_offsets[..])
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
        stamp.seconds_since(self.loops.open.recorded.0)
    }
}
