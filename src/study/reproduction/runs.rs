//! Experiments whose results are measures of the runs of a study.

use super::spec::{ClaimSpec, ResultSpec, RunsSpec};
use super::{ComparedNumber, Comparison, ExperimentResult};
use crate::study::StudyError;
use crate::study::sweep::{Measure, Sweep};

/// Compares measures of the levels of the finished study with the paper and the goals.
pub(super) fn result(spec: &RunsSpec, sweep: &Sweep) -> Result<ExperimentResult, StudyError> {
    let results = spec.results.iter().map(|result| compared(result, sweep));
    let claims = spec.claims.iter().map(|claim| claimed(spec, claim, sweep));
    let rows = results.chain(claims).collect::<Result<_, StudyError>>()?;
    Ok(ExperimentResult { rows, notes: spec.notes.clone() })
}

/// A measure of a level in its display unit, one number for each seed; infinite for a failed run.
fn values(sweep: &Sweep, level: &str, measure: Measure) -> Result<Vec<f64>, StudyError> {
    let (_, factor) = measure.unit();
    let values = sweep.values_at(level, measure)?;
    Ok(values.into_iter().map(|value| value.map_or(f64::INFINITY, |value| value * factor)).collect())
}

fn compared(result: &ResultSpec, sweep: &Sweep) -> Result<ComparedNumber, StudyError> {
    let (unit, _) = result.measure.unit();
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
    match of.worst {
        Some(worst) => format!("{} {}, worst {} of {seeds} runs", rounded(of.median), of.unit, rounded(worst)),
        None => format!("{} {}, one run", rounded(of.median), of.unit),
    }
}

/// Three significant digits.
fn rounded(x: f64) -> String {
    let digits = if x != 0.0 && x.is_finite() { x.abs().log10().floor() } else { 0.0 };
    let decimals = (2.0 - digits).clamp(0.0, 6.0) as usize;
    format!("{x:.decimals$}")
}

/// The ratio of the medians of two levels, which the paper states to be below 1.
fn claimed(spec: &RunsSpec, claim: &ClaimSpec, sweep: &Sweep) -> Result<ComparedNumber, StudyError> {
    let (unit, _) = claim.measure.unit();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_significant_digits() {
        assert_eq!([0.01234, 1.0, 56.78, 1234.5, 0.0].map(rounded), ["0.0123", "1.00", "56.8", "1234", "0.00"]);
        assert_eq!(rounded(f64::INFINITY), "inf");
    }
}
