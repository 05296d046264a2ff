//! The page of a run that is not complete.

use super::data::View;
use super::update::Volume;
use super::{MAX_PAGE_POINTS, MAX_PAGE_POSES, encode, html, links, scripts, stage, static_surfaces};
use serde_json::json;
use zsim_simulation::Simulation;

const SECTIONS: &str = include_str!("assets/live.html");
const EVENTS: &str = "<section id=\"events\"><h2>Events</h2>\n<ul id=\"event-list\"></ul></section>\n";
const SCRIPT: &str = include_str!("assets/live.js");

/// The page of a run that is not complete. It requests [`super::LiveUpdate`]s from its server.
pub struct LivePage {
    /// Name of the run.
    pub title: String,
    /// What is known before the run: the true surfaces, the parts of the head, and its springs.
    pub view: View,
    /// The volume of the points.
    pub volume: Volume,
}

impl LivePage {
    /// The page of an estimate from a recording: nothing else is known before.
    pub fn of_recording(title: &str) -> Self {
        Self { title: title.to_owned(), view: View::default(), volume: Volume::default() }
    }

    /// Creates the page of a full run of `simulation`: the true surfaces, the head and its springs are known before.
    pub fn of_simulation(simulation: &Simulation) -> Self {
        let (world, head) = (simulation.world(), &simulation.inputs().head.spec);
        let (surfaces, surfaces_are_partial) = static_surfaces(world);
        let (lower, upper) = world.bounds();
        let (links, parts) = (links::of(&head.linkage), links::blocks(&head.parts));
        Self {
            title: world.name().to_owned(),
            view: View { surfaces, surfaces_are_partial, links, parts, ..View::default() },
            volume: Volume::around(lower, upper),
        }
    }

    /// The HTML of the page.
    pub fn html(&self) -> String {
        let view = stage::view_section("Trajectory and map so far", "estimate", "head");
        let verdicts: String = ["good", "degraded", "lost"].map(|status| html::verdict_line(status, "")).concat();
        let scripts = [&scripts::VIEW[..], &[SCRIPT]].concat();
        html::Page {
            kind: html::LIVE,
            title: &self.title,
            introduction: html::fill(SECTIONS, &[("verdicts", &verdicts)]),
            without_scripts: "This page needs scripts.",
            sections: view + EVENTS,
            footer: "Points are thinned for this page; the report and cloud.ply have all of them.",
            data: self.data(),
            scripts: &scripts,
            ..html::Page::default()
        }
        .html()
    }

    /// The data of the view, without points; their codes refer to the volume.
    fn data(&self) -> String {
        let mut data = self.view.json();
        data["cloud"]["lower"] = json!(self.volume.lower);
        data["cloud"]["upper"] = json!(self.volume.upper);
        data["cloud"]["duration"] = json!(Volume::duration_s());
        data["capacity"] = json!({ "points": MAX_PAGE_POINTS, "poses": MAX_PAGE_POSES });
        encode::inert(&data.to_string())
    }
}
