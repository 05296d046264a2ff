//! The page of a merged sweep.

use super::integrity::IntegrityReport;
use super::output::{digits, heading, tables};
use super::plots::PlotFile;
use super::runs::Runs;
use super::{Measure, Summary, Sweep, SweepStatus};
use crate::report::page::{MAX_PAGE_RUNS, PageTable, StudyPage};
use crate::report::quantity_name;
use crate::study::StudyError;

/// Plots above this total size are left to the folder `plots/`, bytes: the page stays below 12 MB.
const MAX_PLOTS_BYTES: usize = 8_000_000;

impl Sweep {
    /// The page of the merged runs, with the given plots.
    ///
    /// # Errors
    /// If the table is not merged, or if a file cannot be read.
    pub(super) fn page(
        &self,
        summary: &Summary,
        status: &SweepStatus,
        integrity: Option<&IntegrityReport>,
        plots: &[PlotFile],
    ) -> Result<StudyPage, StudyError> {
        let of_axes = tables(summary, &self.plan, true).into_iter();
        let of_integrity = integrity.map(IntegrityReport::tables).into_iter().flatten();
        let tables = of_integrity.chain(of_axes).map(|(title, header, rows)| PageTable { title, header, rows });
        let (runs, runs_note) = self.page_runs(&summary.measures)?;
        Ok(StudyPage {
            name: self.plan.name().to_owned(),
            introduction: format!(
                "{} runs, {} of them failed, {} missing. Medians with quartiles; a ratio is the median over pairs of runs that \
                 differ only in this axis, to its first level.",
                status.points, status.failed, status.missing
            ),
            tables: tables.collect(),
            figures: self.page_figures(plots)?,
            runs,
            runs_note,
        })
    }

    /// The plots as SVG, each with its title, as far as there is room.
    fn page_figures(&self, plots: &[PlotFile]) -> Result<Vec<(String, String)>, StudyError> {
        let (mut figures, mut bytes) = (Vec::new(), 0);
        for PlotFile { name, title } in plots {
            let path = self.folder.join("plots").join(format!("{name}.svg"));
            let svg = std::fs::read_to_string(&path).map_err(StudyError::file(&path))?;
            bytes += svg.len();
            if bytes <= MAX_PLOTS_BYTES {
                figures.push((title.clone(), svg));
            }
        }
        Ok(figures)
    }

    /// Settings and figures of each run, and a note if there are more runs than the page has room for.
    fn page_runs(&self, measures: &[Measure]) -> Result<(PageTable, String), StudyError> {
        let runs = Runs::read(self)?;
        let columns: Vec<Vec<f64>> = measures.iter().map(|measure| self.figures(*measure)).collect::<Result<_, _>>()?;
        let header = std::iter::once("run".to_owned())
            .chain(self.plan.axes().iter().map(|axis| quantity_name(&axis.name)))
            .chain(measures.iter().map(|measure| heading(*measure)));
        let row = |(row, number): (usize, &u64)| {
            let settings = self.plan.settings(*number).into_iter().map(|setting| setting.label());
            let figures = measures.iter().zip(&columns).map(|(measure, column)| digits(column[row] * measure.unit().1));
            std::iter::once(number.to_string()).chain(settings).chain(figures).collect()
        };
        let rows = runs.numbers.iter().enumerate().take(MAX_PAGE_RUNS).map(row).collect();
        let left_out = runs.numbers.len().saturating_sub(MAX_PAGE_RUNS);
        let note = match left_out {
            0 => String::new(),
            _ => format!("The table has the first {MAX_PAGE_RUNS} runs; {left_out} more are in table.csv."),
        };
        Ok((PageTable { title: "Runs".to_owned(), header: header.collect(), rows }, note))
    }
}
