//! The page of a gain measurement.

use super::data::{Chart, ChartGroup, Section};
use super::encode;
use super::html::{self, PagePlot, escaped};
use super::scripts::{CHARTS, DATA, LIBRARIES, READY, TABLES};
use super::table::PageTable;
use crate::plot::PlotError;

/// The page of a gain measurement: gain, phase and coherence of each axis over frequency.
pub struct GainsPage {
    /// Name of the head.
    pub name: String,
    /// The result in a sentence or two.
    pub summary: String,
    /// Tables of peaks and modes.
    pub tables: Vec<PageTable>,
    /// The axes.
    pub axes: Vec<AxisGains>,
    /// Plots.
    pub plots: Vec<PagePlot>,
}

/// Charts of the gains along or about one axis.
pub struct AxisGains {
    /// Name of the axis in `gains.csv`.
    pub axis: &'static str,
    /// Title.
    pub title: String,
    /// Charts side by side; of a group, one is shown at a time.
    pub charts: Vec<Vec<Chart>>,
}

impl GainsPage {
    /// The HTML of the page; the same data give the same bytes.
    ///
    /// # Errors
    /// When a value cannot be written as JSON.
    pub fn html(self) -> Result<String, PlotError> {
        let of_axis = |axis: &AxisGains| {
            format!(
                "<section data-charts=\"{}\" hidden><h2>{}</h2><div class=\"charts\"></div></section>\n",
                axis.axis,
                escaped(&axis.title)
            )
        };
        let sections = [
            self.tables.iter().map(PageTable::section).collect::<String>(),
            self.axes.iter().map(of_axis).collect(),
            html::plots(&self.plots),
        ];
        let groups = self.axes.into_iter().flat_map(|axis| {
            let section = Section::Axis(axis.axis);
            axis.charts.into_iter().map(move |charts| ChartGroup { section, charts })
        });
        let data = encode::charts_json(&groups.collect::<Vec<_>>());
        Ok(html::Document {
            kind: "gains",
            title: &format!("Gains of {}", self.name),
            status: "",
            introduction: &html::summary(&self.summary),
            without_scripts: "The charts need scripts. The folder plots/ has them as pictures.",
            sections: &sections.concat(),
            footer: "Charts: drag to zoom, double-click to zoom out, arrow keys move the cursor. All values are in gains.csv.",
            version: env!("CARGO_PKG_VERSION"),
            data: &data.map_err(|error| PlotError::Drawing(error.to_string()))?,
            scripts: &[LIBRARIES, DATA, CHARTS, TABLES, READY],
        }
        .html())
    }
}
