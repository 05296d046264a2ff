//! The page of a benchmark: the errors of several systems on a suite of recordings.

use super::PageTable;
use super::html;
use super::scripts::{DATA, READY, TABLES};

/// The page of a benchmark.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BenchmarkPage {
    /// The result in a sentence or two.
    pub summary: String,
    /// One row per system: medians over the recordings.
    pub systems: PageTable,
    /// One row per recording and system.
    pub runs: PageTable,
}

impl BenchmarkPage {
    /// The HTML of the page; the same data give the same bytes.
    pub fn html(&self) -> String {
        let sections = [self.systems.section(), self.runs.section()].concat();
        html::Document {
            kind: "paper",
            title: "Benchmark",
            status: "",
            introduction: &html::summary(&self.summary),
            without_scripts: "Sorting the tables needs scripts; nothing else does.",
            sections: &sections,
            footer: "APE: position error after a rigid alignment, as evo_ape -a. RPE: over 1 m of path. Drift: after an alignment over the first \
                     20 s.",
            version: env!("CARGO_PKG_VERSION"),
            data: "{}",
            scripts: &[DATA, TABLES, READY],
        }
        .html()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_become_markup() {
        let hostile = || "\"><script>".to_owned();
        let table =
            || PageTable { header: vec![hostile()], rows: vec![vec![hostile()]], title: hostile(), links: Vec::new() };
        let page = BenchmarkPage { summary: hostile(), systems: table(), runs: table() };
        let html = page.html();
        assert_eq!(html.matches("<script>").count(), 1, "that of the page");
        assert_eq!(html.matches("&lt;script&gt;").count(), 9);
    }
}
