//! Judges the claims of a finished sweep.

use super::claim::{ClaimSpec, Place};
use super::comparison::{Comparison, Goal, Verdict, rounded, with_unit};
use super::runs::{Runs, level_count, level_label};
use super::{Measure, Plan, Setting, Sweep};
use crate::StudyError;
use serde::{Deserialize, Serialize};
use zsim_base::spec::{Source, SpecError};
use zsim_report::quantity_name;
use zsim_run::large_error_m;

/// A quantity of a paper, or a goal, and the corresponding result of zsim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComparedNumber {
    /// Number of the figure in the paper; `-` without one.
    pub figure: String,
    /// Name of the quantity.
    pub what: String,
    /// Number in the paper, as accurate as it can be read; `-` without one.
    pub paper: String,
    /// Result of zsim.
    pub ours: String,
    /// The result as a number with a verdict; `None` where the paper shows no number and no other statement.
    #[serde(default)]
    pub comparison: Option<Comparison>,
}

impl ComparedNumber {
    /// A claim about a place where a sampled study has no run: it is missed.
    fn without_runs(claim: &ClaimSpec, place: &Place) -> Self {
        let one = Goal { is_most: false, median: 1.0, worst: None };
        Self {
            figure: claim.figure().unwrap_or("-").to_owned(),
            what: place_name(claim.what(), place),
            paper: "-".to_owned(),
            ours: "no run is there".to_owned(),
            comparison: Comparison::with_goal("runs", None, one, &[0.0]),
        }
    }

    /// Whether the result misses its goal.
    pub fn is_missed(&self) -> bool {
        self.comparison.as_ref().is_some_and(|comparison| comparison.verdict == Verdict::Missed)
    }
}

impl Plan {
    /// Checks that the claims name levels and measures of the study, and have a goal.
    ///
    /// # Errors
    /// With the position of the claim in `source`.
    pub(super) fn check_claims(&self, source: &Source) -> Result<(), SpecError> {
        for claim in &self.spec().claims {
            let about = |message: String| {
                let message = format!("claim \"{}\": {message}", claim.what());
                Err(SpecError::about_after(source, "claims", &format!("{:?}", claim.what()), message))
            };
            if let Some(missing) = claim.measures().iter().find(|measure| !self.spec().measures.contains(measure)) {
                return about(format!("{} is not in `measures`: add it", missing.key()));
            }
            for place in claim.places() {
                if let Err(message) = place_levels(self, place) {
                    return about(message);
                }
            }
            let ClaimSpec::Median { most, least, worst, paper, .. } = claim else { continue };
            if most.is_some() == least.is_some() {
                return about("needs one of `most` and `least`".to_owned());
            }
            if [most, least, worst, paper].into_iter().flatten().any(|number| !number.is_finite()) {
                return about("has a number that is not finite".to_owned());
            }
        }
        Ok(())
    }
}

/// The axes that a place names, and the level on each.
fn place_levels(plan: &Plan, place: &Place) -> Result<Vec<(usize, usize)>, String> {
    let level_of = |(name, setting): (&String, &Setting)| {
        let Some(axis) = plan.axes().iter().position(|axis| axis.name == *name) else {
            let axes: Vec<&str> = plan.axes().iter().map(|axis| axis.name.as_str()).collect();
            return Err(format!("no axis is named \"{name}\"; the axes are {}", axes.join(", ")));
        };
        let wanted = setting.label();
        let level = (0..level_count(plan, axis)).find(|level| level_label(plan, axis, *level).0 == wanted);
        level.map(|level| (axis, level)).ok_or_else(|| format!("the axis \"{name}\" has no level \"{wanted}\""))
    };
    place.iter().map(level_of).collect()
}

impl Sweep {
    /// Compares the result with each claim of the study.
    ///
    /// # Errors
    /// If the sweep is not merged, or if its tables cannot be read.
    pub(super) fn judged_claims(&self, runs: &Runs) -> Result<Vec<ComparedNumber>, StudyError> {
        self.plan.spec().claims.iter().map(|claim| self.judged(claim, runs)).collect()
    }

    fn judged(&self, claim: &ClaimSpec, runs: &Runs) -> Result<ComparedNumber, StudyError> {
        for place in claim.places() {
            if self.figures_at(runs, place, claim.measures()[0])?.is_empty() {
                return Ok(ComparedNumber::without_runs(claim, place));
            }
        }
        let (what, paper, ours, comparison) = match claim {
            ClaimSpec::Median { at, measure, most, least, worst, paper, paper_text, .. } => {
                let (unit, factor) = display_unit(*measure);
                let shown = |x: f64| without_rounding_error(x * factor);
                let goal = Goal {
                    is_most: most.is_some(),
                    median: shown(most.or(*least).unwrap_or(f64::NAN)),
                    worst: worst.map(shown),
                };
                let values =
                    self.values_at(runs, at, *measure, if goal.is_most { f64::INFINITY } else { f64::NEG_INFINITY })?;
                let comparison = Comparison::with_goal(unit, paper.map(shown), goal, &values);
                let number = paper.map_or_else(|| "-".to_owned(), |paper| format!("{} {unit}", shown(paper)));
                let ours = comparison.as_ref().map_or_else(String::new, |of| in_words(of, values.len()));
                (place_name(claim.what(), at), paper_text.clone().unwrap_or(number), ours, comparison)
            }
            ClaimSpec::Smaller { at, than, measure, .. } => {
                let (unit, _) = display_unit(*measure);
                let median = |place: &Place| -> Result<f64, StudyError> {
                    let values = self.values_at(runs, place, *measure, f64::INFINITY)?;
                    let compared = Comparison::with_goal(unit, None, Goal::at_most(0.0), &values);
                    Ok(compared.map_or(f64::NAN, |of| of.median))
                };
                let (smaller, larger) = (median(at)?, median(than)?);
                let ours = format!("{} against {} {unit}", rounded(smaller), rounded(larger));
                let ratio = Comparison::with_goal("", None, Goal::at_most(1.0), &[smaller / larger]);
                (claim.what().to_owned(), "smaller".to_owned(), ours, ratio)
            }
            ClaimSpec::Warned { at, .. } => {
                let statements = self.statements(runs, at)?;
                let unwarned = statements.iter().filter(|run| run.is_wrong_without_warning()).count() as f64;
                let what = format!("{}: runs wrong without warning", place_name(claim.what(), at));
                let none = Comparison::with_goal("runs", None, Goal::at_most(0.0), &[unwarned]);
                (what, "stated as a limitation".to_owned(), statuses(&statements), none)
            }
        };
        Ok(ComparedNumber { figure: claim.figure().unwrap_or("-").to_owned(), what, paper, ours, comparison })
    }

    /// A measure of the runs at a place, in its display unit; `of_failed` for one without a figure.
    fn values_at(&self, runs: &Runs, at: &Place, measure: Measure, of_failed: f64) -> Result<Vec<f64>, StudyError> {
        let (_, factor) = display_unit(measure);
        let values = self.figures_at(runs, at, measure)?;
        Ok(values.into_iter().map(|value| value.map_or(of_failed, |value| value * factor)).collect())
    }

    /// A measure of the runs at a place, in the unit of files; `None` for a failed run.
    fn figures_at(&self, runs: &Runs, at: &Place, measure: Measure) -> Result<Vec<Option<f64>>, StudyError> {
        let levels = place_levels(&self.plan, at).map_err(|message| StudyError::Plan { what: "claims", message })?;
        let is_there = |row: usize| levels.iter().all(|(axis, level)| runs.levels[*axis][row] as usize == *level);
        let values = self.read_measure(measure)?.into_iter().enumerate();
        Ok(values.filter(|(row, _)| is_there(*row)).map(|(_, value)| value).collect())
    }

    fn statements(&self, runs: &Runs, at: &Place) -> Result<Vec<RunStatement>, StudyError> {
        let [status, error_m, path_m] = ClaimSpec::OF_WARNED.map(|measure| self.figures_at(runs, at, measure));
        let runs = status?.into_iter().zip(error_m?).zip(path_m?);
        Ok(runs.map(|((status, error_m), path_m)| RunStatement { status, error_m, path_m }).collect())
    }
}

/// The quantity and the levels of its place.
fn place_name(what: &str, at: &Place) -> String {
    let level = |(axis, setting): (&String, &Setting)| match setting.number() {
        Some(_) => format!("{} {}", quantity_name(axis), setting.label()),
        None => setting.label(),
    };
    std::iter::once(what.to_owned()).chain(at.iter().map(level)).collect::<Vec<_>>().join(", ")
}

/// Display unit of a measure, empty for a ratio, and the factor from the unit of files to it.
fn display_unit(measure: Measure) -> (&'static str, f64) {
    let (unit, factor) = measure.unit();
    (if unit == "1" { "" } else { unit }, factor)
}

/// The number with at most twelve significant digits: 35.00000000000001 becomes 35.
fn without_rounding_error(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

fn in_words(of: &Comparison, runs: usize) -> String {
    let median = with_unit(of.median, &of.unit);
    match of.worst {
        Some(worst) => format!("{median}, worst {} of {runs} runs", rounded(worst)),
        None => format!("{median}, one run"),
    }
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
    let errors = Comparison::with_goal("mm", None, Goal::at_most(0.0), &errors)
        .map(|of| in_words(&of, runs.len()))
        .unwrap_or_default();
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
        let unit = display_unit(Measure::named("cloud_over_truth")).0;
        let ratio = Comparison::with_goal(unit, None, Goal::at_most(1.02), &[1.0, 1.01]).unwrap();
        assert_eq!((in_words(&ratio, 2).as_str(), ratio.goal.as_str()), ("1.00, worst 1.01 of 2 runs", "at most 1.02"));
    }
}
