//! Evaluation of the integrity statements of a sweep: verdicts and error bounds against the true errors.

use super::table::{Column, ColumnType};
use super::{Measure, Plan, Sweep};
use crate::StudyError;
use zsim_report::{Document, Table};
use zsim_run::large_error_m;

/// Name of the axis of fault lists, and its level without faults.
const FAULT_AXIS: (&str, &str) = ("faults", "none");
/// Required fraction of a run's poses with an error within the bound, which is a 99 % bound.
const REQUIRED_WITHIN_BOUND: f64 = 0.99;
/// Aligned RMSE, m, below which a run should not be reported as lost: well below the 5 cm of a good run.
const SMALL_ERROR_M: f64 = 0.02;
/// Number of worst runs in the table.
const MAX_LISTED_RUNS: usize = 10;

/// Integrity measures of a run; NaN if the run has no estimate.
#[derive(Debug, Clone, PartialEq)]
struct RunIntegrity {
    number: u64,
    settings: Vec<String>,
    is_faulted: bool,
    /// 0 good, 1 degraded, 2 lost.
    status: f64,
    aligned_rmse_m: f64,
    within_bound: f64,
    bound_over_error: f64,
    bound_m_99: f64,
    path_length_m: f64,
}

impl RunIntegrity {
    fn is_failed(&self) -> bool {
        self.status.is_nan()
    }

    /// Aligned RMSE over the largest error of a good result.
    fn error_ratio(&self) -> f64 {
        self.aligned_rmse_m / large_error_m(self.path_length_m)
    }
}

/// The measures of which the statements consist.
const MEASURES: [Measure; 6] = [
    Measure::STATUS,
    Measure::named("aligned_rmse_m"),
    Measure::named("within_bound"),
    Measure::named("bound_over_error"),
    Measure::named("bound_m_99"),
    Measure::named("way_m"),
];

/// Integrity statements of all runs of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct IntegrityReport {
    axes: Vec<String>,
    runs: Vec<RunIntegrity>,
}

impl Sweep {
    /// Integrity statements of the runs in the merged table; `None` if the sweep does not measure them.
    pub(super) fn integrity_report(&self) -> Result<Option<IntegrityReport>, StudyError> {
        if !MEASURES.iter().all(|measure| self.plan.spec().measures.contains(measure)) {
            return Ok(None);
        }
        let axes = text_axes(&self.plan);
        let mut columns = vec![("point", ColumnType::Counts)];
        columns.extend(MEASURES.iter().map(|measure| (measure.key(), ColumnType::Numbers)));
        columns.extend(axes.iter().map(|axis| (axis.as_str(), ColumnType::Text)));
        let mut columns = self.read_merged(&self.table(), &columns)?.into_iter();
        let numbers = columns.next().map_or_else(Vec::new, Column::counts);
        let filled = |column: Column| column.numbers().into_iter().map(|cell| cell.unwrap_or(f64::NAN)).collect();
        let figures: Vec<Vec<f64>> = columns.by_ref().take(MEASURES.len()).map(filled).collect();
        let texts: Vec<Vec<Option<String>>> = columns.map(Column::texts).collect();
        let faults = axes.iter().position(|axis| axis == FAULT_AXIS.0);
        let run = |(row, number): (usize, Option<i64>)| {
            let settings: Vec<String> = texts.iter().map(|column| column[row].clone().unwrap_or_default()).collect();
            RunIntegrity {
                number: number.unwrap_or_default() as u64,
                is_faulted: faults.is_some_and(|axis| settings[axis] != FAULT_AXIS.1),
                settings,
                status: figures[0][row],
                aligned_rmse_m: figures[1][row],
                within_bound: figures[2][row],
                bound_over_error: figures[3][row],
                bound_m_99: figures[4][row],
                path_length_m: figures[5][row],
            }
        };
        Ok(Some(IntegrityReport { axes, runs: numbers.into_iter().enumerate().map(run).collect() }))
    }
}

/// Names of the axes whose values are text.
fn text_axes(plan: &Plan) -> Vec<String> {
    plan.setting_columns()
        .into_iter()
        .filter(|(_, column_type)| *column_type == ColumnType::Text)
        .map(|(name, _)| name)
        .collect()
}

impl IntegrityReport {
    /// Adds two tables: reliability of verdicts and bounds, and the worst runs that are not lost.
    pub fn add_to(&self, document: &mut Document) {
        document.heading("Integrity: verdicts and bounds against true errors");
        document.add(self.reliability());
        document.heading(format!("The {MAX_LISTED_RUNS} worst runs that are not lost"));
        document.add(self.worst_runs());
    }

    /// Reliability of verdicts and bounds, without and with faults.
    fn reliability(&self) -> Table {
        let clean: Vec<&RunIntegrity> = self.runs.iter().filter(|run| !run.is_faulted).collect();
        let faulted: Vec<&RunIntegrity> = self.runs.iter().filter(|run| run.is_faulted).collect();
        let row = |name: &str, figure: &dyn Fn(&[&RunIntegrity]) -> String| {
            vec![name.to_owned(), figure(&clean), figure(&faulted)]
        };
        let with = |status: f64| move |runs: &[&RunIntegrity]| count(runs, |run| run.status == status);
        let rows = vec![
            row("runs", &|runs| runs.len().to_string()),
            row("good", &with(0.0)),
            row("degraded", &with(1.0)),
            row("lost", &with(2.0)),
            row("failed with an error", &|runs| count(runs, RunIntegrity::is_failed)),
            row("good, but error above 5 cm and 1 % of the path", &|runs| {
                count(runs, |run| run.status == 0.0 && run.error_ratio() > 1.0)
            }),
            row("runs with at least 99 % of the poses within the bound (%)", &|runs| {
                percentage(runs, |run| !run.is_failed(), |run| run.within_bound >= REQUIRED_WITHIN_BOUND)
            }),
            row("bound over error, good runs, median", &|runs| median_ratio(runs, 0.0)),
            row("bound over error, degraded runs, median", &|runs| median_ratio(runs, 1.0)),
            row("lost, of runs with an error below 2 cm (%)", &|runs| {
                percentage(runs, |run| run.aligned_rmse_m < SMALL_ERROR_M, |run| run.status == 2.0)
            }),
        ];
        Table::new(["", "without faults", "with faults"], rows)
    }

    /// Runs that are not lost, ordered by the fraction within the bound, then by error.
    fn worst_runs(&self) -> Table {
        let mut runs: Vec<&RunIntegrity> = self.runs.iter().filter(|run| run.status < 2.0).collect();
        runs.sort_by(|a, b| {
            let uncovered =
                a.within_bound.min(REQUIRED_WITHIN_BOUND).total_cmp(&b.within_bound.min(REQUIRED_WITHIN_BOUND));
            uncovered.then(b.error_ratio().total_cmp(&a.error_ratio()))
        });
        let row = |run: &&RunIntegrity| {
            let mut cells = vec![run.number.to_string()];
            cells.extend(run.settings.iter().cloned());
            cells.push(if run.status == 0.0 { "good" } else { "degraded" }.to_owned());
            cells.push(format!("{:.1}", run.aligned_rmse_m * 1e3));
            cells.push(format!("{:.1}", run.bound_m_99 * 1e3));
            cells.push(format!("{:.1}", run.within_bound * 1e2));
            cells
        };
        let header = ["run"].into_iter().chain(self.axes.iter().map(String::as_str));
        let header = header.chain(["verdict", "error mm", "median bound mm", "within %"]);
        Table::new(header, runs.iter().take(MAX_LISTED_RUNS).map(row))
    }
}

fn count(runs: &[&RunIntegrity], has: impl Fn(&RunIntegrity) -> bool) -> String {
    runs.iter().filter(|run| has(run)).count().to_string()
}

/// Percentage of the runs with `condition` that also have `property`.
fn percentage(
    runs: &[&RunIntegrity],
    condition: impl Fn(&RunIntegrity) -> bool,
    property: impl Fn(&RunIntegrity) -> bool,
) -> String {
    let all: Vec<&&RunIntegrity> = runs.iter().filter(|run| condition(run)).collect();
    let some = all.iter().filter(|run| property(run)).count();
    if all.is_empty() { "-".to_owned() } else { format!("{:.1}", 1e2 * some as f64 / all.len() as f64) }
}

fn median_ratio(runs: &[&RunIntegrity], status: f64) -> String {
    let of_status = runs.iter().filter(|run| run.status == status && run.bound_over_error.is_finite());
    let mut ratios: Vec<f64> = of_status.map(|run| run.bound_over_error).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.1}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(number: u64, faults: &str, status: f64, aligned_rmse_m: f64, within_bound: f64) -> RunIntegrity {
        RunIntegrity {
            number,
            is_faulted: faults != FAULT_AXIS.1,
            settings: vec![faults.to_owned()],
            status,
            aligned_rmse_m,
            within_bound,
            bound_over_error: 4.0,
            bound_m_99: 0.01,
            path_length_m: 20.0,
        }
    }

    #[test]
    fn a_run_with_a_large_error_and_the_verdict_good_is_counted_and_listed_first() {
        let report = IntegrityReport {
            axes: vec!["faults".to_owned()],
            runs: vec![
                run(0, "none", 0.0, 0.002, 1.0),
                run(1, "none", 0.0, 0.3, 0.4),
                run(2, "gap", 2.0, 0.01, 1.0),
                run(3, "gap", 1.0, 0.01, 0.995),
                run(4, "gap", f64::NAN, f64::NAN, f64::NAN),
            ],
        };
        let rows = report.reliability().rows;
        let figures =
            |name: &str| rows.iter().find(|row| row[0].starts_with(name)).map(|row| row[1..].to_vec()).unwrap();
        assert_eq!(figures("runs"), ["2", "3"]);
        assert_eq!(figures("failed"), ["0", "1"]);
        assert_eq!(figures("good, but error"), ["1", "0"]);
        assert_eq!(figures("runs with at least 99 %"), ["50.0", "100.0"]);
        assert_eq!(figures("lost, of runs"), ["0.0", "50.0"]);
        let worst = report.worst_runs().rows;
        assert_eq!(worst.iter().map(|row| row[0].as_str()).collect::<Vec<_>>(), ["1", "3", "0"]);
    }
}
