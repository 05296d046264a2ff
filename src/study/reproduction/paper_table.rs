//! The table of the paper's experiments.

use super::{Comparison, Extent, Finding};

/// First line of [`paper_table`]; identifies a file written by `zsim reproduce`.
pub const TABLE_HEADING: &str = "# The paper's experiments, reproduced";

/// Table of all experiments as Markdown.
///
/// `options` are appended to the commands in the table; `label`, such as the date of the program, follows the version.
pub fn paper_table(findings: &[Finding], extent: Extent, options: &str, label: Option<&str>) -> String {
    let mut text = TABLE_HEADING.to_owned();
    text += "\n\n\
        Bosse, Zlot and Flick, \"Zebedee: Design of a Spring-Mounted 3-D Range Sensor with Application to Mobile Mapping\", \
        IEEE Transactions on Robotics 28(5), 2012. Written by `zsim reproduce`, ";
    text +=
        &format!("zsim {}{}.", env!("CARGO_PKG_VERSION"), label.map_or_else(String::new, |label| format!(", {label}")));
    text += " Results are the median and the worst of the seeds; the worst may be twice the goal.\n\n";
    if extent == Extent::Quick {
        text += "This is a smoke test with short simulations: its figures are not results.\n\n";
    }
    let rows = findings.iter().flat_map(|Finding { experiment, result }| {
        let command = format!("`zsim reproduce {}{options}`", experiment.given);
        result.iter().flat_map(|result| &result.rows).map(move |row| {
            let one = || [String::new(), row.ours.clone(), String::new(), String::new(), String::new()];
            let numbers = row.comparison.as_ref().map_or_else(one, Comparison::cells);
            let quantity = [row.figure.clone(), row.what.clone(), row.paper.clone()];
            quantity.into_iter().chain(numbers).chain([command.clone()]).collect::<Vec<_>>()
        })
    });
    let header = ["figure", "quantity", "paper", "goal", "zsim, median", "worst", "zsim / paper", "goal is", "command"];
    text += &zsim_report::markdown(&header, &rows.collect::<Vec<_>>());
    for Finding { experiment, result } in findings {
        let notes = result.as_ref().map(|result| result.notes.clone());
        let notes = notes.unwrap_or_else(|| vec!["Not finished yet.".to_owned()]);
        text += &format!("\n## {}\n\n", experiment.given);
        notes.iter().for_each(|note| text += &format!("- {note}\n"));
        if result.is_some() {
            let file = |name: &str| format!("{}/{}/{name}.svg", extent.folder(), experiment.name);
            experiment
                .plots()
                .iter()
                .for_each(|(name, title)| text += &format!("- Figure: [{title}]({})\n", file(name)));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::{ComparedNumber, Experiment, ExperimentResult};
    use super::*;

    #[test]
    fn the_table_shows_finished_and_unfinished_experiments() {
        let row = ComparedNumber {
            figure: "3a".into(),
            what: "gain | peak".into(),
            paper: "15".into(),
            ours: "14.9".into(),
            comparison: None,
        };
        let result = ExperimentResult { rows: vec![row], notes: vec!["Read off a plot.".to_owned()] };
        let finding = |name: &str, result| Finding { experiment: Experiment::load(name).unwrap(), result };
        let text = paper_table(
            &[finding("fig3", Some(result)), finding("fig4", None)],
            Extent::Quick,
            " --quick",
            Some("2026-11-01"),
        );
        assert!(
            text.contains("| 3a | gain \\| peak | 15 |  | 14.9 |  |  |  | `zsim reproduce fig3 --quick` |"),
            "{text}"
        );
        assert!(text.contains(", 2026-11-01. Results"), "{text}");
        assert!(text.contains("not results"));
        assert!(
            text.contains("## fig3\n\n- Read off a plot.\n- Figure: [Gain curves](paper-quick/fig3/gains.svg)\n")
                && text.contains("## fig4\n\n- Not finished yet."),
            "{text}"
        );
    }
}
