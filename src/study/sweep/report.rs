//! Report of a merged sweep: summary tables and plots.

use super::levels::{csv, trends_csv};
use super::runs::Runs;
use super::{ComparedNumber, Summary, Sweep, SweepStatus};
use crate::StudyError;
use crate::latency::LatencyResult;
use zsim_base::files::write_text;

/// Report of a merged sweep.
#[derive(Debug, Clone)]
pub struct MergedReport {
    /// Progress of the sweep.
    pub status: SweepStatus,
    /// Summary of the runs.
    pub summary: Summary,
    /// The result for the terminal.
    pub text: String,
    /// The claims of the study in comparison with the result; none before all runs are finished.
    pub claims: Vec<ComparedNumber>,
    /// The latency study; `None` if the runs have no timing errors, or if a run failed or is missing.
    pub latency: Option<LatencyResult>,
}

impl Sweep {
    /// [Merges](Self::merge) the finished runs and reports them.
    ///
    /// Writes `summary.csv`, `trends.csv` (for sampled axes), `study.md`, `report.html`, `latency.csv` and `metrics.json`
    /// (with timing errors), and plots to `plots/`.
    ///
    /// # Errors
    /// If no run is finished, or if a file cannot be read or written.
    pub fn merge_and_report(&self) -> Result<MergedReport, StudyError> {
        let status = self.merge()?;
        if status.done == 0 {
            let message = "no run is finished: run it with `zsim sweep run`".to_owned();
            return Err(StudyError::Plan { what: "sweep", message });
        }
        let summary = self.summary()?;
        let claims = if status.missing == 0 { self.judged_claims(&Runs::read(self)?)? } else { Vec::new() };
        let document = self.document(&summary, &status, &claims, self.draw(&summary)?)?;
        let mut files =
            vec![("summary.csv", csv(&summary)), ("study.md", document.markdown("")), ("report.html", document.html())];
        if !summary.trends.is_empty() {
            files.push(("trends.csv", trends_csv(&summary)));
        }
        for (name, text) in files {
            write_text(&self.temporary(), &self.folder.join(name), &text)?;
        }
        let latency = self.latency_result()?;
        latency.as_ref().map_or(Ok(()), |study| self.write_latency(study))?;
        Ok(MergedReport { status, summary, text: document.text(), claims, latency })
    }
}
