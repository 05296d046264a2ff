//! What a sweep says of the statement of integrity: verdicts and bounds against the true errors.

use super::table::{Held, Table};
use super::{Measure, Plan, Sweep};
use crate::report;
use crate::spec::SpecError;
use crate::study::StudyError;
use crate::study::integrity::large_error_m;

/// The axis of fault lists, and its level without faults.
const FAULTS: (&str, &str) = ("faults", "none");
/// Share of a run's poses that must lie within their bound.
const COVERED: f64 = 0.99;
/// An aligned error below this is small: such a run should not be called lost, m.
const SMALL_M: f64 = 0.02;
/// How many of the worst runs are listed.
const WORST: usize = 10;

/// A run, as far as its statement goes. Without an estimate its figures are NaN.
#[derive(Debug, Clone, PartialEq)]
struct Stated {
    number: u64,
    settings: Vec<String>,
    is_faulted: bool,
    /// 0 good, 1 degraded, 2 lost.
    status: f64,
    aligned_rmse_m: f64,
    within_bound: f64,
    bound_over_error: f64,
    bound_m_99: f64,
    way_m: f64,
}

impl Stated {
    fn is_failed(&self) -> bool {
        self.status.is_nan()
    }

    /// How much more it errs than a good result may.
    fn excess(&self) -> f64 {
        self.aligned_rmse_m / large_error_m(self.way_m)
    }
}

/// What the statements of a sweep's runs are worth.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coverage {
    axes: Vec<String>,
    runs: Vec<Stated>,
}

impl Sweep {
    /// The statements of the merged table's runs; `None` where they were not measured.
    pub(super) fn coverage(&self) -> Result<Option<Coverage>, StudyError> {
        let measures = [
            Measure::Status,
            Measure::AlignedRmseM,
            Measure::WithinBound,
            Measure::BoundOverError,
            Measure::BoundM99,
            Measure::WayM,
        ];
        if !measures.iter().all(|measure| self.plan.spec().measures.contains(measure)) {
            return Ok(None);
        }
        let path = self.table();
        let unmerged = || SpecError::plain(path.display().to_string(), "is not there: merge the sweep first");
        let table = Table::open(&path)?.ok_or_else(unmerged)?;
        let figures = |measure: Measure| {
            let cells = table.column(measure.key(), Held::Numbers)?.numbers();
            Ok(cells.into_iter().map(|cell| cell.unwrap_or(f64::NAN)).collect::<Vec<f64>>())
        };
        let figures: Vec<Vec<f64>> = measures.into_iter().map(figures).collect::<Result<_, StudyError>>()?;
        let numbers = table.column("point", Held::Counts)?.counts();
        let axes = word_axes(&self.plan);
        let words = |axis: &String| Ok(table.column(axis, Held::Words)?.words());
        let words: Vec<Vec<Option<String>>> = axes.iter().map(words).collect::<Result<_, StudyError>>()?;
        let faults = axes.iter().position(|axis| axis == FAULTS.0);
        let stated = |(row, number): (usize, Option<i64>)| {
            let settings: Vec<String> = words.iter().map(|column| column[row].clone().unwrap_or_default()).collect();
            Stated {
                number: number.unwrap_or_default() as u64,
                is_faulted: faults.is_some_and(|axis| settings[axis] != FAULTS.1),
                settings,
                status: figures[0][row],
                aligned_rmse_m: figures[1][row],
                within_bound: figures[2][row],
                bound_over_error: figures[3][row],
                bound_m_99: figures[4][row],
                way_m: figures[5][row],
            }
        };
        Ok(Some(Coverage { axes, runs: numbers.into_iter().enumerate().map(stated).collect() }))
    }
}

fn word_axes(plan: &Plan) -> Vec<String> {
    plan.setting_columns().into_iter().filter(|(_, held)| *held == Held::Words).map(|(name, _)| name).collect()
}

impl Coverage {
    /// Two tables: how the verdicts and bounds held, and the runs that were worst for their verdict.
    pub fn tables(&self) -> [(String, Vec<String>, Vec<Vec<String>>); 2] {
        [self.held(), self.worst()]
    }

    fn held(&self) -> (String, Vec<String>, Vec<Vec<String>>) {
        let clean: Vec<&Stated> = self.runs.iter().filter(|run| !run.is_faulted).collect();
        let faulted: Vec<&Stated> = self.runs.iter().filter(|run| run.is_faulted).collect();
        let row =
            |name: &str, figure: &dyn Fn(&[&Stated]) -> String| vec![name.to_owned(), figure(&clean), figure(&faulted)];
        let with = |status: f64| move |runs: &[&Stated]| count(runs, |run| run.status == status);
        let rows = vec![
            row("runs", &|runs| runs.len().to_string()),
            row("good", &with(0.0)),
            row("degraded", &with(1.0)),
            row("lost", &with(2.0)),
            row("refused with an error", &|runs| count(runs, Stated::is_failed)),
            row("good, but wrong by more than 5 cm and 1 % of the way", &|runs| {
                count(runs, |run| run.status == 0.0 && run.excess() > 1.0)
            }),
            row("at least 99 % of the poses within their bound (%)", &|runs| {
                share(runs, |run| !run.is_failed(), |run| run.within_bound >= COVERED)
            }),
            row("bound over error, good runs, median", &|runs| median_ratio(runs, 0.0)),
            row("bound over error, degraded runs, median", &|runs| median_ratio(runs, 1.0)),
            row("lost, of those that err by less than 2 cm (%)", &|runs| {
                share(runs, |run| run.aligned_rmse_m < SMALL_M, |run| run.status == 2.0)
            }),
        ];
        let header = ["", "without faults", "with faults"].map(str::to_owned).to_vec();
        ("Statement of integrity".to_owned(), header, rows)
    }

    /// Runs that are not lost, by how little the bound covers and by how far they err.
    fn worst(&self) -> (String, Vec<String>, Vec<Vec<String>>) {
        let mut runs: Vec<&Stated> = self.runs.iter().filter(|run| run.status < 2.0).collect();
        runs.sort_by(|a, b| {
            let uncovered = a.within_bound.min(COVERED).total_cmp(&b.within_bound.min(COVERED));
            uncovered.then(b.excess().total_cmp(&a.excess()))
        });
        let row = |run: &&Stated| {
            let mut cells = vec![run.number.to_string()];
            cells.extend(run.settings.iter().cloned());
            cells.push(if run.status == 0.0 { "good" } else { "degraded" }.to_owned());
            cells.push(format!("{:.1}", run.aligned_rmse_m * 1e3));
            cells.push(format!("{:.1}", run.bound_m_99 * 1e3));
            cells.push(format!("{:.1}", run.within_bound * 1e2));
            cells
        };
        let mut header = vec!["run".to_owned()];
        header.extend(self.axes.iter().cloned());
        header.extend(["verdict", "error mm", "bound mm", "within %"].map(str::to_owned));
        (format!("The {WORST} worst runs that are not lost"), header, runs.iter().take(WORST).map(row).collect())
    }

    /// As text for a terminal.
    pub fn words(&self) -> String {
        let text = |(title, header, rows): (String, Vec<String>, Vec<Vec<String>>)| {
            let header: Vec<&str> = header.iter().map(String::as_str).collect();
            format!("{title}\n{}\n", report::table(&header, &rows, true))
        };
        self.tables().map(text).concat()
    }

    /// As Markdown.
    pub fn markdown(&self) -> String {
        let text = |(title, header, rows): (String, Vec<String>, Vec<Vec<String>>)| {
            let header: Vec<&str> = header.iter().map(String::as_str).collect();
            format!("\n{title}\n\n{}", report::markdown(&header, &rows))
        };
        self.tables().map(text).concat()
    }
}

fn count(runs: &[&Stated], is_so: impl Fn(&Stated) -> bool) -> String {
    runs.iter().filter(|run| is_so(run)).count().to_string()
}

/// Percentage of the runs that are `of` which are also `is_so`.
fn share(runs: &[&Stated], of: impl Fn(&Stated) -> bool, is_so: impl Fn(&Stated) -> bool) -> String {
    let all: Vec<&&Stated> = runs.iter().filter(|run| of(run)).collect();
    let some = all.iter().filter(|run| is_so(run)).count();
    if all.is_empty() { "-".to_owned() } else { format!("{:.1}", 1e2 * some as f64 / all.len() as f64) }
}

fn median_ratio(runs: &[&Stated], status: f64) -> String {
    let of_status = runs.iter().filter(|run| run.status == status && run.bound_over_error.is_finite());
    let mut ratios: Vec<f64> = of_status.map(|run| run.bound_over_error).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.1}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(number: u64, faults: &str, status: f64, aligned_rmse_m: f64, within_bound: f64) -> Stated {
        Stated {
            number,
            is_faulted: faults != FAULTS.1,
            settings: vec![faults.to_owned()],
            status,
            aligned_rmse_m,
            within_bound,
            bound_over_error: 4.0,
            bound_m_99: 0.01,
            way_m: 20.0,
        }
    }

    #[test]
    fn a_wrong_run_that_is_called_good_is_counted_and_listed_first() {
        let coverage = Coverage {
            axes: vec!["faults".to_owned()],
            runs: vec![
                run(0, "none", 0.0, 0.002, 1.0),
                run(1, "none", 0.0, 0.3, 0.4),
                run(2, "gap", 2.0, 0.01, 1.0),
                run(3, "gap", 1.0, 0.01, 0.995),
                run(4, "gap", f64::NAN, f64::NAN, f64::NAN),
            ],
        };
        let (_, _, rows) = coverage.held();
        let figures =
            |name: &str| rows.iter().find(|row| row[0].starts_with(name)).map(|row| row[1..].to_vec()).unwrap();
        assert_eq!(figures("runs"), ["2", "3"]);
        assert_eq!(figures("refused"), ["0", "1"]);
        assert_eq!(figures("good, but wrong"), ["1", "0"]);
        assert_eq!(figures("at least 99 %"), ["50.0", "100.0"]);
        assert_eq!(figures("lost, of those"), ["0.0", "50.0"]);
        let (_, _, worst) = coverage.worst();
        assert_eq!(worst.iter().map(|row| row[0].as_str()).collect::<Vec<_>>(), ["1", "3", "0"]);
    }
}
