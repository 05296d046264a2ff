//! Experiments whose results are measures of the runs of a study.

use super::comparison::{rounded, with_unit};
use super::spec::{ClaimSpec, ResultSpec, RunsSpec, WarningSpec};
use super::{ComparedNumber, Comparison, ExperimentResult, clock_plot};
use crate::StudyError;
use crate::sweep::{Measure, Sweep};
use std::path::Path;
use zsim_run::large_error_m;

/// Draws the figure of an experiment that has one in `folder`.
pub(super) fn plot(spec: &RunsSpec, sweep: &Sweep, folder: &Path) -> Result<(), StudyError> {
    if !spec.plots_clock {
        return Ok(());
    }
    if let Some(figure) = clock_plot::figure(sweep)? {
        figure.save(folder, "clock")?;
    }
    Ok(())
}

/// Compares measures of the levels of the finished study with the paper and the goals.
pub(super) fn result(spec: &RunsSpec, sweep: &Sweep) -> Result<ExperimentResult, StudyError> {
    let results = spec.results.iter().map(|result| compared(result, sweep));
    let claims = spec.claims.iter().map(|claim| claimed(spec, claim, sweep));
    let warns = spec.warns.iter().map(|warning| warned(spec, warning, sweep));
    let rows = results.chain(claims).chain(warns).collect::<Result<_, StudyError>>()?;
    Ok(ExperimentResult { rows, notes: spec.notes.clone() })
}

/// Display unit of a measure, empty for a ratio, and the factor from the unit of files to it.
fn display_unit(measure: Measure) -> (&'static str, f64) {
    let (unit, factor) = measure.unit();
    (if unit == "1" { "" } else { unit }, factor)
}

/// A measure of a level in its display unit, one number for each seed; infinite for a failed run.
fn values(sweep: &Sweep, level: &str, measure: Measure) -> Result<Vec<f64>, StudyError> {
    let (_, factor) = display_unit(measure);
    let values = sweep.values_at(level, measure)?;
    Ok(values.into_iter().map(|value| value.map_or(f64::INFINITY, |value| value * factor)).collect())
}

fn compared(result: &ResultSpec, sweep: &Sweep) -> Result<ComparedNumber, StudyError> {
    let (unit, _) = display_unit(result.measure);
    let values = values(sweep, &result.level, result.measure)?;
    let comparison = Comparison::at_most(unit, result.paper, result.goal, &values);
    let paper = match (&result.paper_text, result.paper) {
        (Some(text), _) => text.clone(),
        (None, Some(number)) => format!("{number} {unit}"),
        (None, None) => "-".to_owned(),
    };
    Ok(ComparedNumber {
        figure: result.figure.clone(),
        what: format!("{}, {}", result.what, result.level),
        paper,
        ours: comparison.as_ref().map_or_else(String::new, |of| in_words(of, values.len())),
        comparison,
    })
}

fn in_words(of: &Comparison, seeds: usize) -> String {
    let median = with_unit(of.median, &of.unit);
    match of.worst {
        Some(worst) => format!("{median}, worst {} of {seeds} runs", rounded(worst)),
        None => format!("{median}, one run"),
    }
}

/// The ratio of the medians of two levels, which the paper states to be below 1.
fn claimed(spec: &RunsSpec, claim: &ClaimSpec, sweep: &Sweep) -> Result<ComparedNumber, StudyError> {
    let (unit, _) = display_unit(claim.measure);
    let median = |level: &str| -> Result<f64, StudyError> {
        let values = values(sweep, level, claim.measure)?;
        Ok(Comparison::at_most(unit, None, 0.0, &values).map_or(f64::NAN, |of| of.median))
    };
    let (smaller, larger) = (median(&claim.smaller)?, median(&claim.larger)?);
    Ok(ComparedNumber {
        figure: spec.figure.clone(),
        what: claim.what.clone(),
        paper: "smaller".to_owned(),
        ours: format!("{} against {} {unit}", rounded(smaller), rounded(larger)),
        comparison: Comparison::at_most("", None, 1.0, &[smaller / larger]),
    })
}

/// The number of runs that are wrong without a warning, which should be 0.
fn warned(spec: &RunsSpec, warning: &WarningSpec, sweep: &Sweep) -> Result<ComparedNumber, StudyError> {
    let [status, error_m, path_m] = WarningSpec::MEASURES.map(|measure| sweep.values_at(&warning.level, measure));
    let runs: Vec<RunStatement> = (status?.into_iter().zip(error_m?).zip(path_m?))
        .map(|((status, error_m), path_m)| RunStatement { status, error_m, path_m })
        .collect();
    let unwarned = runs.iter().filter(|run| run.is_wrong_without_warning()).count() as f64;
    Ok(ComparedNumber {
        figure: spec.figure.clone(),
        what: format!("{}, {}: runs wrong without warning", warning.what, warning.level),
        paper: "stated as a limitation".to_owned(),
        ours: statuses(&runs),
        comparison: Comparison::at_most("runs", None, 0.0, &[unwarned]),
    })
}

/// What a run states of itself, and how wrong it is.
struct RunStatement {
    /// 0 good, 1 degraded, 2 lost; `None` if the run failed with an error.
    status: Option<f64>,
    /// Position error, aligned over the start, m; `None` if it is unknown.
    error_m: Option<f64>,
    /// Length of the path, m.
    path_m: Option<f64>,
}

impl RunStatement {
    fn is_wrong_without_warning(&self) -> bool {
        let limit_m = large_error_m(self.path_m.unwrap_or(0.0));
        self.status == Some(0.0) && self.error_m.is_none_or(|error_m| error_m > limit_m)
    }
}

/// Counts of the statuses, and the errors.
fn statuses(runs: &[RunStatement]) -> String {
    let count = |status: Option<f64>| runs.iter().filter(|run| run.status == status).count();
    let counts = [(Some(0.0), "good"), (Some(1.0), "degraded"), (Some(2.0), "lost"), (None, "failed")];
    let counts = counts.map(|(status, name)| (count(status), name)).into_iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> = counts.map(|(count, name)| format!("{count} {name}")).collect();
    let errors: Vec<f64> = runs.iter().map(|run| run.error_m.map_or(f64::INFINITY, |error_m| error_m * 1e3)).collect();
    let errors = Comparison::at_most("mm", None, 0.0, &errors).map(|of| in_words(&of, runs.len())).unwrap_or_default();
    format!("{}; error {errors}", counts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_wrong_without_warning_if_it_is_good_with_an_error_above_5_cm_and_1_percent_of_the_path() {
        let run = |status, error_m, path_m| RunStatement { status, error_m: Some(error_m), path_m: Some(path_m) };
        let wrong = |run: RunStatement| run.is_wrong_without_warning();
        assert!(wrong(run(Some(0.0), 0.06, 4.0)) && wrong(run(Some(0.0), 0.41, 40.0)));
        assert!(!wrong(run(Some(0.0), 0.04, 1.0)) && !wrong(run(Some(0.0), 0.39, 40.0)));
        assert!(!wrong(run(Some(1.0), 9.0, 40.0)) && !wrong(run(None, 9.0, 40.0)));
        let runs = [run(Some(0.0), 0.01, 40.0), run(Some(0.0), 0.03, 40.0), run(Some(2.0), 5.0, 40.0)];
        assert_eq!(statuses(&runs), "2 good, 1 lost; error 30.0 mm, worst 5000 of 3 runs");
    }

    #[test]
    fn a_ratio_has_no_unit() {
        let ratio =
            Comparison::at_most(display_unit(Measure::named("cloud_over_truth")).0, None, 1.02, &[1.0, 1.01]).unwrap();
        assert_eq!((in_words(&ratio, 2).as_str(), ratio.goal.as_str()), ("1.00, worst 1.01 of 2 runs", "at most 1.02"));
    }
}
