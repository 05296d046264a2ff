//! The page of the paper's experiments.

use super::{ComparedNumber, Comparison, Extent, Finding, Verdict};
use crate::StudyError;
use std::path::Path;
use zsim_base::files::FileError;
use zsim_report::page::{ExperimentSection, PageLink, PagePlot, PageTable, PaperPage};

/// The page of all experiments as HTML; `folder` has the folder of each, and the page belongs in it.
///
/// `options` are appended to the commands on the page.
///
/// # Errors
/// If a plot cannot be read.
pub fn paper_page(findings: &[Finding], folder: &Path, extent: Extent, options: &str) -> Result<String, StudyError> {
    let section = |finding: &Finding| section(finding, folder, options);
    let page = PaperPage {
        summary: summary(findings, extent),
        experiments: findings.iter().map(section).collect::<Result<_, _>>()?,
    };
    Ok(page.html())
}

fn summary(findings: &[Finding], extent: Extent) -> String {
    let finished = findings.iter().filter(|finding| finding.result.is_some()).count();
    let verdicts = findings.iter().filter_map(|finding| finding.result.as_ref()).flat_map(|result| &result.rows);
    let verdicts: Vec<Verdict> = verdicts.filter_map(|row| Some(row.comparison.as_ref()?.verdict)).collect();
    let met = verdicts.iter().filter(|verdict| **verdict == Verdict::Met).count();
    let mut text = format!(
        "{finished} of {} experiments are finished; {met} of {} goals are met.",
        findings.len(),
        verdicts.len()
    );
    if extent == Extent::Quick {
        text += " This is a smoke test with short simulations: its figures are not results.";
    }
    text
}

fn section(finding: &Finding, folder: &Path, options: &str) -> Result<ExperimentSection, StudyError> {
    let Finding { experiment, result } = finding;
    let command = format!("zsim reproduce {}{options}", experiment.given);
    let unfinished = ExperimentSection {
        title: experiment.title(),
        command,
        notes: vec!["Not finished yet.".to_owned()],
        ..ExperimentSection::default()
    };
    let Some(result) = result else { return Ok(unfinished) };
    let own = folder.join(&experiment.name);
    let mut plots = Vec::new();
    for (name, title) in experiment.plots() {
        let path = own.join(format!("{name}.svg"));
        if path.is_file() {
            let svg = std::fs::read_to_string(&path).map_err(FileError::at(&path))?;
            plots.push(PagePlot { name: (*title).to_owned(), svg });
        }
    }
    let files = [("page of the study", "report.html"), ("table of the runs", "table.csv")];
    let links = files.into_iter().filter(|(_, file)| own.join(file).is_file()).map(|(name, file)| PageLink {
        name: name.to_owned(),
        address: format!("{}/{file}", address_part(&experiment.name)),
    });
    Ok(ExperimentSection {
        table: table(&experiment.name, &result.rows),
        notes: result.notes.clone(),
        plots,
        links: links.collect(),
        ..unfinished
    })
}

/// A file name as a part of a relative address (RFC 3986): all but unreserved characters are escaped.
fn address_part(name: &str) -> String {
    let escape = |byte: u8| match byte {
        b if b.is_ascii_alphanumeric() || b"-._~".contains(&b) => char::from(b).to_string(),
        b => format!("%{b:02X}"),
    };
    name.bytes().map(escape).collect()
}

fn table(name: &str, rows: &[ComparedNumber]) -> PageTable {
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
    PageTable {
        title: format!("Results of {name}"),
        header: header.map(str::to_owned).to_vec(),
        rows: rows.iter().map(row).collect(),
        ..PageTable::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_name_is_one_part_of_an_address() {
        assert_eq!(address_part("fig3"), "fig3");
        assert_eq!(address_part("a b/../\"?#"), "a%20b%2F..%2F%22%3F%23");
        assert_eq!(address_part("javascript:x"), "javascript%3Ax");
    }
}
