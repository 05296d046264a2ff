//! The page of the paper's experiments.

use super::html::{self, PagePlot, escaped};
use super::scripts::{DATA, READY, TABLES};
use super::table::PageTable;

/// The page of the paper's experiments: a section each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PaperPage {
    /// The result in a sentence or two.
    pub summary: String,
    /// The experiments.
    pub experiments: Vec<ExperimentSection>,
}

/// An experiment on the page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExperimentSection {
    /// Title.
    pub title: String,
    /// The command that does the experiment.
    pub command: String,
    /// The published numbers and ours; no rows if the experiment is not finished.
    pub table: PageTable,
    /// Assumptions and differences.
    pub notes: Vec<String>,
    /// Plots.
    pub plots: Vec<PagePlot>,
    /// Files of the experiment, each with its name.
    pub links: Vec<PageLink>,
}

/// A link to a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PageLink {
    /// The words of the link.
    pub name: String,
    /// Address relative to the page.
    pub address: String,
}

impl PaperPage {
    /// The HTML of the page; the same data give the same bytes.
    pub fn html(&self) -> String {
        html::Document {
            kind: "paper",
            title: "The paper's experiments, reproduced",
            status: "",
            introduction: &html::summary(&self.summary),
            without_scripts: "Sorting the tables needs scripts; nothing else does.",
            sections: &self.experiments.iter().map(ExperimentSection::html).collect::<String>(),
            footer: "Bosse, Zlot and Flick, Zebedee: Design of a Spring-Mounted 3-D Range Sensor with Application to Mobile \
                     Mapping, IEEE Transactions on Robotics 28(5), 2012.",
            version: env!("CARGO_PKG_VERSION"),
            data: "{}",
            scripts: &[DATA, TABLES, READY],
        }
        .html()
    }
}

impl ExperimentSection {
    fn html(&self) -> String {
        let table = if self.table.rows.is_empty() { String::new() } else { self.table.html() };
        let notes: String = self.notes.iter().map(|note| format!("<li>{}</li>\n", html::with_code(note))).collect();
        let link = |link: &PageLink| format!("<a href=\"{}\">{}</a>", escaped(&link.address), escaped(&link.name));
        let links: Vec<String> = self.links.iter().map(link).collect();
        let links = if links.is_empty() { String::new() } else { format!("<p>{}</p>\n", links.join(", ")) };
        format!(
            "<section><h2>{}</h2>\n<p><code>{}</code></p>\n{table}{links}<ul>\n{notes}</ul>\n{}</section>\n",
            escaped(&self.title),
            escaped(&self.command),
            html::plots(&self.plots)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_become_markup() {
        let hostile = || "\"><script>".to_owned();
        let table = PageTable { header: vec![hostile()], rows: vec![vec![hostile()]], ..PageTable::default() };
        let experiment = ExperimentSection {
            title: hostile(),
            command: hostile(),
            table,
            notes: vec![hostile()],
            plots: vec![PagePlot { name: hostile(), svg: "<svg></svg>".to_owned() }],
            links: vec![PageLink { name: hostile(), address: hostile() }],
        };
        let html = PaperPage { summary: hostile(), experiments: vec![experiment] }.html();
        assert_eq!(html.matches("<script>").count(), 1, "that of the page");
        assert_eq!(html.matches("&lt;script&gt;").count(), 9);
        assert!(html.contains("<svg></svg>"));
    }
}
