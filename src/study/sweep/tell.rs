//! What a merged sweep leaves for people.

use super::integrity::Coverage;
use super::output::{csv, markdown, trends_csv, words};
use super::{Status, Summary, Sweep};
use crate::study::StudyError;
use crate::study::atomic_file::write_text;

/// A merged sweep.
#[derive(Debug, Clone)]
pub struct Merged {
    /// How far it was.
    pub status: Status,
    /// What its runs say together.
    pub summary: Summary,
    /// The same in words.
    pub words: String,
}

impl Sweep {
    /// [Merges](Self::merge) what is done, sums it up in `summary.csv`, `trends.csv` (of sampled axes) and `study.md`,
    /// and draws `plots/`.
    ///
    /// # Errors
    /// When nothing is done yet, or a file cannot be read or written.
    pub fn tell(&self) -> Result<Merged, StudyError> {
        let status = self.merge()?;
        if status.done == 0 {
            let message = "no run is done yet: zsim sweep run".to_owned();
            return Err(StudyError::Plan { what: "the sweep", message });
        }
        let summary = self.summary()?;
        let coverage = self.coverage()?;
        let statement = coverage.as_ref().map_or_else(String::new, Coverage::markdown);
        let told = markdown(&summary, &self.plan, &status) + &statement;
        let mut files = vec![("summary.csv", csv(&summary)), ("study.md", told)];
        if !summary.trends.is_empty() {
            files.push(("trends.csv", trends_csv(&summary)));
        }
        for (name, text) in files {
            write_text(&self.temporary(), &self.folder.join(name), &text)?;
        }
        self.draw(&summary)?;
        let words = words(&summary, &self.plan) + &coverage.map_or_else(String::new, |coverage| coverage.words());
        Ok(Merged { status, summary, words })
    }
}
