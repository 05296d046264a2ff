//! The results of the paper's experiments as a document.

use super::{Extent, Finding};
use crate::StudyError;
use crate::sweep::{ComparedNumber, Comparison, Verdict};
use std::path::Path;
use zsim_base::files::FileError;
use zsim_report::{Content, Document, Plot, Table};

/// Title of [`paper_document`]; identifies a file written by `zsim reproduce`.
pub const PAPER_TITLE: &str = "The paper's experiments, reproduced";

/// The results of experiments; `folder` has the folder of each, and the page belongs in it.
///
/// `options` are appended to the commands; `label`, such as the date of the program, follows the version.
///
/// # Errors
/// If a plot cannot be read.
pub fn paper_document(
    findings: &[Finding],
    folder: &Path,
    extent: Extent,
    options: &str,
    label: Option<&str>,
) -> Result<Document, StudyError> {
    let mut document = Document::new(PAPER_TITLE, summary(findings, extent, label));
    for Finding { experiment, result } in findings {
        document.heading(experiment.title());
        document.add_detail(format!("`zsim reproduce {}{options}`", experiment.given));
        let Some(result) = result else {
            document.add_detail("Not finished yet.");
            continue;
        };
        document.add(table(&result.rows));
        let own = folder.join(&experiment.name);
        let address = |file: &str| format!("{}/{file}", address_part(&experiment.name));
        let files = [("page of the study", "report.html"), ("table of the runs", "table.csv")];
        let files = files.into_iter().filter(|(_, file)| own.join(file).is_file());
        document.add(Content::Links(files.map(|(name, file)| (name.to_owned(), address(file))).collect()));
        document.add_detail(Content::List(result.notes.clone()));
        let mut plots = Vec::new();
        for (file, name) in experiment.plots() {
            let (file, name) = (format!("{file}.svg"), (*name).to_owned());
            let path = own.join(&file);
            if path.is_file() {
                let svg = std::fs::read_to_string(&path).map_err(FileError::at(&path))?;
                plots.push(Plot { name, address: address(&file), svg });
            }
        }
        document.add(Content::Plots(plots));
    }
    Ok(document)
}

/// The paper, as a reference.
const PAPER: &str = "Bosse, Zlot and Flick, \"Zebedee: Design of a Spring-Mounted 3-D Range Sensor with Application to Mobile \
                     Mapping\", IEEE Transactions on Robotics 28(5), 2012";

fn summary(findings: &[Finding], extent: Extent, label: Option<&str>) -> String {
    let finished = findings.iter().filter(|finding| finding.result.is_some()).count();
    let verdicts = findings.iter().filter_map(|finding| finding.result.as_ref()).flat_map(|result| &result.rows);
    let verdicts: Vec<Verdict> = verdicts.filter_map(|row| Some(row.comparison.as_ref()?.verdict)).collect();
    let met = verdicts.iter().filter(|verdict| **verdict == Verdict::Met).count();
    let quick = match extent {
        Extent::Whole => "",
        Extent::Quick => " This is a smoke test with short simulations: its figures are not results.",
    };
    format!(
        "{PAPER}. {finished} of {} experiments are finished; {met} of {} goals are met. Written by `zsim reproduce`, zsim {}{}. \
         Results are the median and the worst of the seeds; the worst may be twice the goal.{quick}",
        findings.len(),
        verdicts.len(),
        env!("CARGO_PKG_VERSION"),
        label.map_or_else(String::new, |label| format!(", {label}")),
    )
}

/// A file name as a part of a relative address (RFC 3986): all but unreserved characters are escaped.
fn address_part(name: &str) -> String {
    let escape = |byte: u8| match byte {
        b if b.is_ascii_alphanumeric() || b"-._~".contains(&b) => char::from(b).to_string(),
        b => format!("%{b:02X}"),
    };
    name.bytes().map(escape).collect()
}

fn table(rows: &[ComparedNumber]) -> Table {
    let header = ["quantity", "paper", "goal", "result, median", "worst", "ratio to the paper", "goal is", "in words"];
    let row = |row: &ComparedNumber| {
        // A dash is a quantity without a figure in the paper.
        let quantity = if row.figure == "-" { row.what.clone() } else { format!("{} {}", row.figure, row.what) };
        let paper = if row.paper == "-" { String::new() } else { row.paper.clone() };
        let [goal, numbers @ ..] = row.comparison.as_ref().map_or_else(Default::default, Comparison::cells);
        // A number and its unit stay on one line.
        let numbers = numbers.map(|cell| if cell.is_empty() { "-".to_owned() } else { cell.replace(' ', "\u{a0}") });
        [quantity, paper, goal].into_iter().chain(numbers).chain([row.ours.clone()]).collect()
    };
    Table { details: (2..7).collect(), ..Table::new(header, rows.iter().map(row)) }
}

#[cfg(test)]
mod tests {
    use super::super::{Experiment, ExperimentResult};
    use super::*;

    #[test]
    fn a_file_name_is_one_part_of_an_address() {
        assert_eq!(address_part("fig3"), "fig3");
        assert_eq!(address_part("a b/../\"?#"), "a%20b%2F..%2F%22%3F%23");
        assert_eq!(address_part("javascript:x"), "javascript%3Ax");
    }

    #[test]
    fn the_document_has_finished_and_unfinished_experiments() {
        let row = ComparedNumber {
            figure: "3a".into(),
            what: "gain | peak".into(),
            paper: "15".into(),
            ours: "14.9".into(),
            comparison: None,
        };
        let result = ExperimentResult { rows: vec![row], notes: vec!["Read off a plot.".to_owned()] };
        let finding = |name: &str, result| Finding { experiment: Experiment::load(name).unwrap(), result };
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("fig3")).unwrap();
        std::fs::write(folder.path().join("fig3/gains.svg"), "<svg></svg>").unwrap();
        let findings = [finding("fig3", Some(result)), finding("fig4", None)];
        let document = paper_document(&findings, folder.path(), Extent::Quick, " --quick", Some("2026-11-01")).unwrap();
        let text = document.markdown("paper-quick/");
        let table = "`zsim reproduce fig3 --quick`\n\n| quantity | paper |";
        assert!(
            text.contains(table) && text.contains("\n| 3a gain \\| peak | 15 |  | - | - | - | - | 14.9 |\n"),
            "{text}"
        );
        assert!(text.contains(", 2026-11-01. Results") && text.contains("not results"), "{text}");
        assert!(text.contains("\n\n- Read off a plot.\n\n- [Gain curves](paper-quick/fig3/gains.svg)\n"), "{text}");
        assert!(text.contains("`zsim reproduce fig4 --quick`\n\nNot finished yet."), "{text}");
        assert!(!document.text().contains("Not finished yet") && document.text().contains("14.9"));
    }
}
