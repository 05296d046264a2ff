//! The report of a run as one HTML file without external resources.
//!
//! The page has the verdict, a three-dimensional view, interactive charts, the metrics and the manifest. Scripts, style
//! sheets and data are in the file. A content security policy forbids network access.

mod binary;
mod data;
mod encode;
mod html;
mod quantise;

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

const TEMPLATE: &str = include_str!("assets/page.html");
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
        let data = encode::inert_json(self)?;
        let script = SCRIPTS.join("\n");
        Ok(html::fill(
            TEMPLATE,
            &[
                ("title", &title),
                ("status", &status),
                ("style", STYLE),
                ("verdict", &html::verdict(metrics)),
                ("metrics", &html::metrics_tables(metrics, &self.parts_s)),
                ("events", &html::events(metrics)),
                ("manifest", &html::escaped(self.manifest)),
                ("version", &html::escaped(&metrics.version)),
                ("data", &data),
                ("script", &script),
            ],
        ))
    }
}

#[cfg(test)]
mod tests;
