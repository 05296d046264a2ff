//! Results of experiments in comparison with the paper.

use super::Extent;
use crate::report;
use serde::{Deserialize, Serialize};

/// A number of the paper and the corresponding result of zsim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComparedNumber {
    /// Number of the figure in the paper.
    pub figure: String,
    /// Name of the quantity.
    pub what: String,
    /// Number in the paper, as accurate as it can be read.
    pub paper: String,
    /// Result of zsim.
    pub ours: String,
}

/// Result of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentResult {
    /// Compared numbers.
    pub rows: Vec<ComparedNumber>,
    /// Notes: assumptions and discrepancies.
    pub notes: Vec<String>,
}

/// First line of [`paper_table`]; identifies a file written by `zsim reproduce`.
pub const TABLE_HEADING: &str = "# The paper's experiments, reproduced";

/// Table of all experiments as Markdown.
///
/// `results` contains the name of each experiment and its result, `None` if unfinished; `options` are appended to the
/// commands in the table.
pub fn paper_table(results: &[(String, Option<ExperimentResult>)], extent: Extent, options: &str) -> String {
    let mut text = TABLE_HEADING.to_owned();
    text += "\n\n\
        Bosse, Zlot and Flick, \"Zebedee: Design of a Spring-Mounted 3-D Range Sensor with Application to Mobile Mapping\", \
        IEEE Transactions on Robotics 28(5), 2012. This file is written by `zsim reproduce`.\n\n";
    if extent == Extent::Quick {
        text += "This is a smoke test with short simulations: its figures are not results.\n\n";
    }
    let rows = results.iter().flat_map(|(name, result)| {
        let command = format!("`zsim reproduce {name}{options}`");
        result.iter().flat_map(|result| &result.rows).map(move |row| {
            vec![row.figure.clone(), row.what.clone(), row.paper.clone(), row.ours.clone(), command.clone()]
        })
    });
    let header = ["figure", "quantity", "paper", "zsim", "command"];
    text += &report::markdown(&header, &rows.collect::<Vec<_>>());
    for (name, result) in results {
        let notes = result.as_ref().map(|result| result.notes.clone());
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
    fn the_table_shows_finished_and_unfinished_experiments() {
        let row =
            ComparedNumber { figure: "3a".into(), what: "gain | peak".into(), paper: "15".into(), ours: "14.9".into() };
        let result = ExperimentResult { rows: vec![row], notes: vec!["Read off a plot.".to_owned()] };
        let text =
            paper_table(&[("fig3".to_owned(), Some(result)), ("fig4".to_owned(), None)], Extent::Quick, " --quick");
        assert!(text.contains("| 3a | gain \\| peak | 15 | 14.9 | `zsim reproduce fig3 --quick` |"), "{text}");
        assert!(text.contains("not results"));
        assert!(
            text.contains("## fig3\n\n- Read off a plot.\n") && text.contains("## fig4\n\n- Not finished yet."),
            "{text}"
        );
    }
}
