//! What experiments found, beside the paper.

use super::Extent;
use crate::report;
use serde::{Deserialize, Serialize};

/// One number of the paper, and ours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The paper's figure.
    pub figure: String,
    /// What was measured.
    pub what: String,
    /// The paper's number, as it can be read there.
    pub paper: String,
    /// Ours.
    pub ours: String,
}

/// What an experiment found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finding {
    /// The numbers.
    pub rows: Vec<Row>,
    /// What a reader must know of them: what was assumed, and what does not fit.
    pub notes: Vec<String>,
}

/// The first line of [`paper_table`], by which the file is recognised.
pub const TABLE_HEADING: &str = "# The paper's experiments, reproduced";

/// The table of all experiments, as Markdown; `findings` with the names that find them, `None` for one that is not
/// finished. `options` belong to the command that makes them.
pub fn paper_table(findings: &[(String, Option<Finding>)], extent: Extent, options: &str) -> String {
    let mut text = TABLE_HEADING.to_owned();
    text += "\n\n\
        Bosse, Zlot and Flick, \"Zebedee: Design of a Spring-Mounted 3-D Range Sensor with Application to Mobile Mapping\", \
        IEEE Transactions on Robotics 28(5), 2012. This file is written by `zsim reproduce`.\n\n";
    if extent == Extent::Quick {
        text +=
            "So little was simulated here that these figures are no results: they show that the experiments run.\n\n";
    }
    let rows = findings.iter().flat_map(|(name, finding)| {
        let command = format!("`zsim reproduce {name}{options}`");
        finding.iter().flat_map(|finding| &finding.rows).map(move |row| {
            vec![row.figure.clone(), row.what.clone(), row.paper.clone(), row.ours.clone(), command.clone()]
        })
    });
    let header = ["figure", "what", "the paper", "ours", "command"];
    text += &report::markdown(&header, &rows.collect::<Vec<_>>());
    for (name, finding) in findings {
        let notes = finding.as_ref().map(|finding| finding.notes.clone());
        let notes = notes.unwrap_or_else(|| vec!["Not finished yet.".to_owned()]);
        text += &format!("\n## {name}\n\n");
        notes.iter().for_each(|note| text += &format!("- {note}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_tells_what_is_finished_and_what_is_not() {
        let row = Row { figure: "3a".into(), what: "gain | peak".into(), paper: "15".into(), ours: "14.9".into() };
        let finding = Finding { rows: vec![row], notes: vec!["Read off a plot.".to_owned()] };
        let text =
            paper_table(&[("fig3".to_owned(), Some(finding)), ("fig4".to_owned(), None)], Extent::Quick, " --quick");
        assert!(text.contains("| 3a | gain \\| peak | 15 | 14.9 | `zsim reproduce fig3 --quick` |"), "{text}");
        assert!(text.contains("no results"));
        assert!(
            text.contains("## fig3\n\n- Read off a plot.\n") && text.contains("## fig4\n\n- Not finished yet."),
            "{text}"
        );
    }
}
