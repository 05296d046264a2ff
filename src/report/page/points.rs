//! Runs as points over two columns.

use super::encode::inert;
use super::fields;
use serde::Serialize;
use serde_json::json;

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
