//! The page of a study: its tables, plots and runs.

use super::html::{self, PagePlot, escaped};
use super::points::RunPoints;
use super::scripts::{DATA, POINTS, READY, RUNS, TABLES};
use super::table::PageTable;

const SECTIONS: &str = include_str!("assets/study.html");
/// Maximum number of runs in the table of the page; a row takes about half a kilobyte.
pub const MAX_PAGE_RUNS: usize = 5_000;

/// The page of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StudyPage {
    /// Name of the study.
    pub name: String,
    /// A sentence on the runs.
    pub introduction: String,
    /// The summary, in several tables.
    pub tables: Vec<PageTable>,
    /// Plots.
    pub plots: Vec<PagePlot>,
    /// Settings and figures of each run.
    pub runs: PageTable,
    /// A note on runs that the table does not have.
    pub runs_note: String,
    /// The same runs as points.
    pub points: RunPoints,
}

impl StudyPage {
    /// The HTML of the page; the same data give the same bytes.
    pub fn html(&self) -> String {
        let sections = html::fill(
            SECTIONS,
            &[
                ("tables", &self.tables.iter().map(PageTable::section).collect::<String>()),
                ("figures", &html::plots(&self.plots)),
                ("runs", &self.runs.html()),
                ("runs_note", &escaped(&self.runs_note)),
            ],
        );
        html::Document {
            kind: "study",
            title: &self.name,
            status: "",
            introduction: &html::summary(&self.introduction),
            without_scripts: "Sorting and filtering need scripts; the tables and plots do not.",
            sections: &sections,
            footer: "Click on a column's name to sort by it, and on a run to open or repeat it. Plots are also in the folder plots/, all figures in table.csv and \
                     summary.csv.",
            version: env!("CARGO_PKG_VERSION"),
            data: &self.points.json(),
            scripts: &[DATA, TABLES, RUNS, POINTS, READY],
        }
        .html()
    }
}

#[cfg(test)]
mod tests {
    use super::super::PointColumn;
    use super::*;

    #[test]
    fn names_of_levels_cannot_become_markup() {
        let table = PageTable {
            title: "By <b>".to_owned(),
            header: vec!["scene".to_owned(), "mm".to_owned()],
            rows: vec![vec!["<script>".to_owned(), "{{version}}".to_owned()]],
            links: vec![Some("runs/\"><script>".to_owned())],
        };
        let column = PointColumn { label: "</script><script>".to_owned(), values: vec![1.0] };
        let page = StudyPage {
            name: "a & b".to_owned(),
            introduction: "1 run".to_owned(),
            tables: vec![table.clone()],
            plots: vec![PagePlot { name: "errors".to_owned(), svg: "<svg></svg>".to_owned() }],
            runs: table,
            points: RunPoints { columns: vec![column], folder: Some("<script>".to_owned()), ..RunPoints::default() },
            ..StudyPage::default()
        };
        let html = page.html();
        assert_eq!(html.matches("<script>").count(), 1, "that of the page");
        // In both tables the cell and the address.
        assert_eq!(html.matches("&lt;script&gt;").count(), 4);
        assert_eq!(html.matches("<a href=\"runs/&quot;&gt;&lt;script&gt;\">").count(), 2);
        assert_eq!(html.matches("<td class=\"text\">{{version}}</td>").count(), 2);
        assert!(html.contains("a &amp; b") && html.contains("<svg></svg>"));
    }
}
