//! The page of a run that is not complete.

use super::page::{blocks_of, links_of, surfaces};
use zsim_report::page::{LivePage, View, Volume};
use zsim_simulation::Simulation;

/// The page of a full run of `simulation`, before its start: the true surfaces, the head and its springs.
pub fn live_page(simulation: &Simulation) -> LivePage {
    let (world, head) = (simulation.world(), &simulation.inputs().head.spec);
    let (surfaces, surfaces_are_partial) = surfaces(world);
    let (lower, upper) = world.bounds();
    LivePage {
        title: world.name().to_owned(),
        view: View {
            surfaces,
            surfaces_are_partial,
            links: links_of(&head.linkage),
            parts: blocks_of(&head.parts),
            ..View::default()
        },
        volume: Volume::around(lower, upper),
    }
}
