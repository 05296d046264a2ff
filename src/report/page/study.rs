//! The page of a study: its tables, plots and runs.

use super::STYLE;
use super::html::{escaped, fill};

const TEMPLATE: &str = include_str!("assets/study.html");
const SCRIPT: &str = include_str!("assets/table.js");
/// Maximum number of runs in the table of the page; a row takes about half a kilobyte.
pub const MAX_PAGE_RUNS: usize = 5_000;

/// The page of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyPage {
    /// Name of the study.
    pub name: String,
    /// A sentence on the runs.
    pub introduction: String,
    /// The summary, in several tables.
    pub tables: Vec<PageTable>,
    /// Plots as SVG, each with its name.
    pub figures: Vec<(String, String)>,
    /// Settings and figures of each run.
    pub runs: PageTable,
    /// A note on runs that the table does not have.
    pub runs_note: String,
}

/// A table of text; rows have as many cells as the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PageTable {
    /// Title.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows; the first cell names the row.
    pub rows: Vec<Vec<String>>,
}

impl StudyPage {
    /// The HTML of the page; the same data give the same bytes.
    pub fn html(&self) -> String {
        let tables: String = self
            .tables
            .iter()
            .map(|table| format!("<section><h2>{}</h2>\n{}</section>\n", escaped(&table.title), table.html()))
            .collect();
        let figure = |(name, svg): &(String, String)| {
            format!(
                "<figure class=\"drawing\" tabindex=\"0\">\n<figcaption>{0}</figcaption>\n{svg}</figure>\n",
                escaped(name)
            )
        };
        fill(
            TEMPLATE,
            &[
                ("title", &escaped(&self.name)),
                ("introduction", &escaped(&self.introduction)),
                ("style", STYLE),
                ("tables", &tables),
                ("figures", &self.figures.iter().map(figure).collect::<String>()),
                ("runs", &self.runs.html()),
                ("runs_note", &escaped(&self.runs_note)),
                ("version", env!("CARGO_PKG_VERSION")),
                ("script", SCRIPT),
            ],
        )
    }
}

impl PageTable {
    fn html(&self) -> String {
        let name = |cell: &String| match cell.as_str() {
            "" => "<td></td>".to_owned(),
            name => format!("<th scope=\"col\">{}</th>", escaped(name)),
        };
        let header: String = self.header.iter().map(name).collect();
        let row = |cells: &Vec<String>| {
            let cells = cells.iter().enumerate().map(|(k, cell)| match k {
                0 => format!("<th scope=\"row\">{}</th>", escaped(cell)),
                _ if is_figure(cell) => format!("<td>{}</td>", escaped(cell)),
                _ => format!("<td class=\"text\">{}</td>", escaped(cell)),
            });
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        format!(
            "<div class=\"wide\" tabindex=\"0\" role=\"group\" aria-label=\"{}\">\n<table class=\"sortable\">\n<thead><tr>{header}</tr></thead>\n\
             <tbody>\n{}</tbody>\n</table>\n</div>\n",
            escaped(&self.title),
            self.rows.iter().map(row).collect::<String>()
        )
    }
}

/// Whether a cell has a number, or the mark of a missing one.
fn is_figure(cell: &str) -> bool {
    matches!(cell, "" | "-" | "lost") || cell.starts_with(|c: char| c.is_ascii_digit() || "+-\u{2212}".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_levels_cannot_become_markup() {
        let table = PageTable {
            title: "By <b>".to_owned(),
            header: vec!["scene".to_owned(), "mm".to_owned()],
            rows: vec![vec!["<script>".to_owned(), "{{version}}".to_owned()]],
        };
        let page = StudyPage {
            name: "a & b".to_owned(),
            introduction: "1 run".to_owned(),
            tables: vec![table.clone()],
            figures: vec![("errors".to_owned(), "<svg></svg>".to_owned())],
            runs: table,
            runs_note: String::new(),
        };
        let html = page.html();
        assert_eq!(html.matches("<script>").count(), 1, "that of the page");
        assert_eq!(html.matches("&lt;script&gt;").count(), 2);
        assert_eq!(html.matches("<td class=\"text\">{{version}}</td>").count(), 2);
        assert!(html.contains("a &amp; b") && html.contains("<svg></svg>"));
    }
}
