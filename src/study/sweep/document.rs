//! The result of a merged sweep as a document.

use super::levels::{add_tables, digits, heading};
use super::runs::Runs;
use super::{ComparedNumber, Comparison, Measure, Summary, Sweep, SweepStatus};
use crate::StudyError;
use zsim_report::page::{Interactive, MAX_PAGE_RUNS, PointColumn, RunPoints};
use zsim_report::{Content, Document, Plot, Table, axis_label, quantity_name};

/// Maximum number of runs of the front on the page in addition to the first [`MAX_PAGE_RUNS`] runs.
const MAX_LATER_RUNS: usize = 500;

impl Sweep {
    /// The result of the merged runs, with the given plots.
    ///
    /// # Errors
    /// If the table is not merged, or if a file cannot be read.
    pub(super) fn document(
        &self,
        summary: &Summary,
        status: &SweepStatus,
        claims: &[ComparedNumber],
        plots: Vec<Plot>,
    ) -> Result<Document, StudyError> {
        let (points, failed, missing) = (status.points, status.failed, status.missing);
        let version = env!("CARGO_PKG_VERSION");
        let written = format!("Written by zsim {version}: {points} runs, {failed} of them failed, {missing} missing.");
        let mut document = Document::new(self.plan.name(), written);
        if !claims.is_empty() {
            document.heading("Claims");
            document.add(claim_table(claims));
        }
        add_tables(&mut document, summary, &self.plan);
        self.integrity_report()?.iter().for_each(|report| report.add_to(&mut document));
        document.heading("Plots");
        document.add(Content::Plots(plots));
        let runs = Runs::read(self)?;
        let front = self.front(&runs)?.map_or_else(Vec::new, |front| front.optimal);
        let shown = shown_rows(runs.numbers.len(), &front);
        let note = match runs.numbers.len() - shown.len() {
            0 => String::new(),
            left_out => {
                format!("The table has the first {MAX_PAGE_RUNS} runs and the front; {left_out} more are in table.csv.")
            }
        };
        document.add_detail(Interactive::Runs {
            runs: self.page_runs(&summary.measures, &runs, &shown)?,
            note,
            points: self.page_points(&summary.measures, &runs, &shown, &front)?,
        });
        document.footer = "Click on a column's name to sort by it, and on a run to open or repeat it. Plots are also in the folder plots/, all \
                           figures in table.csv and summary.csv."
            .to_owned();
        Ok(document)
    }

    /// Settings and figures of the shown runs; those that are kept link to their pages.
    fn page_runs(&self, measures: &[Measure], runs: &Runs, shown: &[usize]) -> Result<Table, StudyError> {
        let columns: Vec<Vec<f64>> = measures.iter().map(|measure| self.figures(*measure)).collect::<Result<_, _>>()?;
        let has_seeds = !self.plan.spec().seeds.is_empty();
        let header = std::iter::once("run".to_owned())
            .chain(self.plan.axes().iter().map(|axis| quantity_name(&axis.name)))
            .chain(has_seeds.then(|| quantity_name("seed")))
            .chain(measures.iter().map(|measure| heading(*measure)));
        let row = |row: &usize| {
            let number = runs.numbers[*row];
            let settings = self.plan.settings(number).into_iter().map(|setting| setting.label());
            let seed = has_seeds.then(|| self.plan.seed(number).map_or_else(String::new, |seed| seed.to_string()));
            let figures =
                measures.iter().zip(&columns).map(|(measure, column)| digits(column[*row] * measure.unit().1));
            std::iter::once(number.to_string()).chain(settings).chain(seed).chain(figures).collect()
        };
        let links = shown.iter().map(|row| self.page_of_run(runs.numbers[*row])).collect();
        Ok(Table { links, ..Table::new(header, shown.iter().map(row)) })
    }

    /// The shown runs as points: numeric axes, then measures; at first over the goals, or else the first two measures.
    fn page_points(
        &self,
        measures: &[Measure],
        runs: &Runs,
        shown: &[usize],
        front: &[usize],
    ) -> Result<RunPoints, StudyError> {
        let pick = |column: &[f64], per_unit: f64| shown.iter().map(|row| column[*row] * per_unit).collect();
        let mut columns = Vec::new();
        for (axis, values) in self.plan.axes().iter().zip(&runs.settings) {
            let column =
                values.as_ref().map(|values| PointColumn { label: axis_label(&axis.name), values: pick(values, 1.0) });
            columns.extend(column);
        }
        let before = columns.len();
        for measure in measures {
            let values = pick(&self.figures(*measure)?, measure.unit().1);
            columns.push(PointColumn { label: measure.label(), values });
        }
        let goals = self.plan.spec().front.iter().map(|goal| goal.measure);
        let place = |measure| measures.iter().position(|other| *other == measure).map(|place| before + place);
        let mut first: Vec<usize> = goals.filter_map(place).collect();
        first.extend((before..columns.len()).chain(0..before));
        first.dedup();
        let x = first.first().copied().unwrap_or_default();
        let y = first.iter().copied().find(|column| *column != x).unwrap_or(x);
        let front = (0..shown.len()).filter(|k| front.contains(&shown[*k])).collect();
        let folder = self.can_repeat().then(|| format!("results/{}", self.plan.name()));
        Ok(RunPoints { columns, x, y, front, folder })
    }
}

/// Claims with their goals, results and verdicts.
fn claim_table(claims: &[ComparedNumber]) -> Table {
    let row = |claim: &ComparedNumber| {
        let [goal, median, worst, _, verdict] =
            claim.comparison.as_ref().map_or_else(Default::default, Comparison::cells);
        vec![claim.what.clone(), goal, median, worst, verdict]
    };
    Table::new(["claim", "goal", "result, median", "worst", "goal is"], claims.iter().map(row))
}

/// Rows of the table on the page: the first [`MAX_PAGE_RUNS`], and after them those of the front, as far as there is room.
fn shown_rows(count: usize, front: &[usize]) -> Vec<usize> {
    let mut later: Vec<usize> = front.iter().copied().filter(|row| *row >= MAX_PAGE_RUNS).collect();
    later.sort_unstable();
    (0..count.min(MAX_PAGE_RUNS)).chain(later.into_iter().take(MAX_LATER_RUNS)).collect()
}
