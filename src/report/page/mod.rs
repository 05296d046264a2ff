//! Interactive pages, each one HTML file without external resources.
//!
//! The page of a run has the verdict, a three-dimensional view, interactive charts, the metrics and the manifest; that of a
//! scene the view, the floor plan and the materials; that of a document its parts, of which one may be interactive.
//! Scripts, style sheets and data are in the file. A content security policy forbids network access. The page of a run that is not complete is an exception: it requests updates from the server that it is from.

mod data;
pub(crate) mod encode;
mod fields;
pub(crate) mod html;
pub(crate) mod interactive;
pub mod links;
mod live;
mod quantise;
pub(crate) mod scripts;
pub(crate) mod stage;
pub(crate) mod table;
mod update;

use crate::rows;
pub use data::{
    Abscissa, Block, Chart, ChartGroup, CoilLink, Curve, CurveStyle, Interval, Link, Ordinate, RunPage, Section,
    ShownMode, SpringView, TimelineRow, View,
};
pub use encode::TimedPose;
pub use interactive::{AxisGains, Interactive, MAX_PAGE_RUNS, PointColumn, RunPoints};
pub use live::LivePage;
pub use quantise::ViewPoint;
use serde_json::json;

/// Maximum number of points of the cloud on a page.
///
/// A point takes 13 bytes, 17.3 in base64: 300,000 points take 5.2 MB.
pub const MAX_PAGE_POINTS: usize = 300_000;
/// Maximum number of triangles of the true surfaces on a page; one takes 36 bytes, 48 in base64.
pub const MAX_PAGE_TRIANGLES: usize = 30_000;
/// Maximum number of poses of a path on a page; one takes 32 bytes, 43 in base64.
pub const MAX_PAGE_POSES: usize = 20_000;

pub use links::static_surfaces;
pub(crate) use links::{Triangle, area_m2, largest};
pub use update::{Increment, LiveEnd, LivePoint, LiveScan, LiveUpdate, LiveVerdict, TruePoses, Volume};

const RUN_SECTIONS: &str = include_str!("assets/run.html");
impl RunPage<'_> {
    /// The HTML of the page; the same data give the same bytes.
    pub fn html(&self) -> String {
        let metrics = self.metrics;
        let mut data = self.view.json();
        data["charts"] = json!(self.charts);
        data["timeline"] = self.timeline.iter().map(TimelineRow::json).collect();
        let sections = html::fill(
            RUN_SECTIONS,
            &[
                ("metrics", &table::metrics_tables(metrics, &self.parts)),
                ("events", &html::events(metrics)),
                ("manifest", &html::escaped(self.manifest)),
            ],
        );
        html::Page {
            kind: "run",
            title: &rows::title(metrics),
            status: metrics.status.as_deref().unwrap_or_default(),
            introduction: html::verdict(metrics),
            without_scripts: "The three-dimensional view and the charts need scripts. The folder plots/ has the plots as pictures.",
            sections: stage::view_section("Trajectory and cloud", "estimate", "head") + &sections,
            footer: "Lines of the charts mark the time of the view; click on a chart to move to that time.",
            version: Some(&metrics.version),
            data: encode::inert(&data.to_string()),
            scripts: &scripts::VIEW,
        }
        .html()
    }
}

#[cfg(test)]
mod tests;
