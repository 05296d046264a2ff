//! Pages with a three-dimensional view, each one HTML file without external resources.
//!
//! The page of a run has the verdict, the view, interactive charts, the metrics and the manifest; that of a scene the view,
//! the floor plan and the materials; that of a study its tables, plots and runs, without a view. Scripts, style sheets and data are in the file. A content security policy forbids
//! network access.

mod binary;
mod data;
mod encode;
mod html;
mod quantise;
mod scene;
mod study;

use crate::report::rows;
pub use data::{
    Block, Chart, ChartGroup, Curve, CurveStyle, Interval, Level, Link, RunPage, Section, TimedPose, TimelineRow, View,
    ViewPoint,
};

/// Maximum number of points of the cloud on a page.
///
/// A point takes 13 bytes, 17.3 in base64: 300,000 points take 5.2 MB.
pub const MAX_PAGE_POINTS: usize = 300_000;
/// Maximum number of triangles of the true surfaces on a page; one takes 36 bytes, 48 in base64.
pub const MAX_PAGE_TRIANGLES: usize = 30_000;
/// Maximum number of poses of a path on a page; one takes 32 bytes, 43 in base64.
pub const MAX_PAGE_POSES: usize = 20_000;

pub use scene::{MaterialRow, ScenePage};
pub use study::{MAX_PAGE_RUNS, PageTable, StudyPage};

const TEMPLATE: &str = include_str!("assets/page.html");
const RUN_SECTIONS: &str = include_str!("assets/run.html");
const STYLE: &str = concat!(include_str!("assets/vendor/uplot.min.css"), include_str!("assets/style.css"));
/// The script of the page: libraries, then the parts of the page in order of their dependencies.
const SCRIPTS: [&str; 9] = [
    include_str!("assets/vendor/vendor.min.js"),
    include_str!("assets/data.js"),
    include_str!("assets/colour.js"),
    include_str!("assets/cloud.js"),
    include_str!("assets/head.js"),
    include_str!("assets/view.js"),
    include_str!("assets/controls.js"),
    include_str!("assets/charts.js"),
    include_str!("assets/timeline.js"),
];

impl RunPage<'_> {
    /// The HTML of the page; the same data give the same bytes.
    ///
    /// # Errors
    /// When a value cannot be written as JSON.
    pub fn html(&self) -> Result<String, serde_json::Error> {
        let metrics = self.metrics;
        let title = html::escaped(&rows::title(metrics));
        let status = html::escaped(metrics.status.as_deref().unwrap_or_default());
        let sections = html::fill(
            RUN_SECTIONS,
            &[
                ("metrics", &html::metrics_tables(metrics, &self.parts_s)),
                ("events", &html::events(metrics)),
                ("manifest", &html::escaped(self.manifest)),
            ],
        );
        Ok(html::fill(
            TEMPLATE,
            &[
                ("page", "run"),
                ("title", &title),
                ("status", &status),
                ("style", STYLE),
                ("introduction", &html::verdict(metrics)),
                ("without_scripts", "The folder plots/ has the plots as pictures."),
                ("view_title", "Trajectory and cloud"),
                ("path", "estimate"),
                ("path_of", "head"),
                ("sections", &sections),
                ("footer", "Lines of the charts mark the time of the view; click on a chart to move to that time."),
                ("version", &html::escaped(&metrics.version)),
                ("data", &encode::run_json(self)?),
                ("script", &SCRIPTS.join("\n")),
            ],
        ))
    }
}

#[cfg(test)]
mod tests;
