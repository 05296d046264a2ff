//! The parts of a document that need scripts.

use super::data::{ChartGroup, ShownMode, SpringView};
use super::encode::inert;
use super::fields;
use super::html::{self, escaped};
use super::scripts::{CHARTS, DATA, LIBRARIES, MODES, POINTS, READY, RUNS, TABLES};
use super::stage::Stage;
use super::table;
use crate::{Table, capitalised};
use serde::Serialize;
use serde_json::json;

const SPRING: &str = include_str!("assets/spring.html");
const MODES_CONTROLS: &str = include_str!("assets/modes.html");
const RUNS_SECTIONS: &str = include_str!("assets/runs.html");
/// Maximum number of runs in the table of a page; a row takes about half a kilobyte.
pub const MAX_PAGE_RUNS: usize = 5_000;

/// A part of a document that needs scripts; a document has one at most.
pub enum Interactive {
    /// Gains along or about each axis over frequency.
    Gains(Vec<AxisGains>),
    /// A head and its linkage to scale, with its modes.
    Spring(SpringView),
    /// The runs of a study.
    Runs {
        /// Settings and figures of each run.
        runs: Table,
        /// A note on runs that the table does not have.
        note: String,
        /// The same runs as points.
        points: RunPoints,
    },
}

/// Charts of the gains along or about one axis.
pub struct AxisGains {
    /// Name of the axis in `gains.csv`.
    pub axis: &'static str,
    /// Title.
    pub title: String,
    /// Groups of charts side by side.
    pub groups: Vec<ChartGroup>,
}

impl Interactive {
    /// The page with the kind, the data and the scripts of the part; the tests read the kind.
    pub(crate) fn complete<'a>(&self, page: html::Page<'a>) -> html::Page<'a> {
        match self {
            Self::Gains(axes) => {
                let charts: Vec<&ChartGroup> = axes.iter().flat_map(|axis| &axis.groups).collect();
                html::Page {
                    kind: "gains",
                    without_scripts: "The charts need scripts. The folder plots/ has them as pictures.",
                    data: inert(&json!({ "charts": charts }).to_string()),
                    scripts: &[LIBRARIES, DATA, CHARTS, TABLES, READY],
                    ..page
                }
            }
            Self::Spring(view) => html::Page {
                kind: "spring",
                without_scripts: "The three-dimensional view needs scripts; the tables do not.",
                data: inert(&json!(view).to_string()),
                scripts: &MODES,
                ..page
            },
            Self::Runs { points, .. } => html::Page {
                kind: "study",
                without_scripts: "Sorting and filtering need scripts; the tables and plots do not.",
                data: points.json(),
                scripts: &[DATA, TABLES, RUNS, POINTS, READY],
                ..page
            },
        }
    }

    /// The sections.
    pub(crate) fn html(&self) -> String {
        match self {
            Self::Gains(axes) => axes.iter().map(AxisGains::html).collect(),
            Self::Spring(view) => view.html(),
            Self::Runs { runs, note, .. } => {
                let values = [("runs", table::table(runs, "Runs")), ("runs_note", escaped(note))];
                html::fill(RUNS_SECTIONS, &values.each_ref().map(|(name, value)| (*name, value.as_str())))
            }
        }
    }
}

impl AxisGains {
    fn html(&self) -> String {
        let title = escaped(&self.title);
        format!(
            "<section data-charts=\"{}\" hidden><h2>{title}</h2><div class=\"charts\"></div></section>\n",
            self.axis
        )
    }
}

impl SpringView {
    fn html(&self) -> String {
        let stage = Stage {
            title: "Head and spring",
            overlays: "<p id=\"scale\" class=\"tag\"></p>\n",
            slider: "Phase",
            speeds: "<option value=\"slow\" selected>2 s a cycle</option><option value=\"0.1\">real time / 10</option>\
                     <option value=\"1\">real time</option>",
        };
        let mode = |(k, mode): (usize, &ShownMode)| {
            format!(
                "<li><label><input type=\"radio\" name=\"mode\" value=\"{k}\"> <span>{}<small>{}</small></span></label></li>\n",
                escaped(&capitalised(&mode.name)),
                escaped(&mode.details),
            )
        };
        let modes: String = self.modes.iter().enumerate().map(mode).collect();
        let (title, player, controls) = match self.modes.is_empty() {
            true => ("Without load", String::new(), "<p>No modes: the head has no rest pose.</p>\n".to_owned()),
            false => (
                "At rest and in its modes",
                stage.playbar(),
                html::fill(MODES_CONTROLS, &[("modes", &modes), ("shake", &escaped(&self.shake))]),
            ),
        };
        let note = escaped(&self.note);
        let values = [("view_title", title), ("player", &player), ("controls", &controls), ("note", &note)];
        stage.fill(SPRING, &values)
    }
}

/// The runs of a study as points: any two columns can be plotted against each other.
///
/// The rows are those of the table of the runs on the same page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RunPoints {
    /// Numeric columns.
    pub columns: Vec<PointColumn>,
    /// Index of the column along the abscissa at first.
    pub x: usize,
    /// Index of the column along the ordinate at first.
    pub y: usize,
    /// Rows of the Pareto front, in any order.
    pub front: Vec<usize>,
    /// Folder of the study in commands if the page cannot find its own; `None` if runs cannot be repeated.
    pub folder: Option<String>,
}

/// A numeric column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointColumn {
    /// Label, with the unit.
    pub label: String,
    /// One value per row; not finite if it is missing.
    #[serde(serialize_with = "fields::numbers")]
    pub values: Vec<f64>,
}

impl RunPoints {
    /// The points as JSON that is inert within a `<script>` element.
    pub(super) fn json(&self) -> String {
        inert(&json!(self).to_string())
    }
}
