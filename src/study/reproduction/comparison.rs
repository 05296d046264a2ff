//! Verdict on a result in comparison with the paper and the goal.

use serde::{Deserialize, Serialize};

/// Maximum factor between a result and a number that is read off a plot of the paper.
const READING_FACTOR: f64 = 1.5;
/// The worst of several seeds may be this factor above a goal for the median.
const WORST_FACTOR: f64 = 2.0;

/// Whether a result agrees with the paper, or meets the goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Agrees with the paper, or meets the goal.
    Met,
    /// Differs from the paper, or misses the goal.
    Missed,
}

impl Verdict {
    fn of(is_met: bool) -> Self {
        if is_met { Self::Met } else { Self::Missed }
    }

    /// Whether the goal is met, in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Missed => "missed",
        }
    }
}

/// A result as a number, with its goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// Unit of the numbers.
    pub unit: String,
    /// Number in the paper; `None` if it has none.
    pub paper: Option<f64>,
    /// The goal in words.
    pub goal: String,
    /// Median of the seeds, or the result of a single run.
    pub median: f64,
    /// Worst of several seeds; `None` for a single run.
    pub worst: Option<f64>,
    /// Whether the goal is met.
    pub verdict: Verdict,
}

impl Comparison {
    /// A single result, which should be near the number in the paper.
    pub fn near(unit: &str, paper: f64, result: f64) -> Self {
        let factor = (result / paper).max(paper / result);
        Self {
            unit: unit.to_owned(),
            paper: Some(paper),
            goal: format!("within a factor of {READING_FACTOR}"),
            median: result,
            worst: None,
            verdict: Verdict::of(factor <= READING_FACTOR),
        }
    }

    /// A single result, which should be at least `factor` times `reference`.
    pub fn above(unit: &str, reference: f64, factor: f64, result: f64) -> Self {
        Self {
            unit: unit.to_owned(),
            paper: None,
            goal: format!("above {factor} x {reference:.1} {unit}"),
            median: result,
            worst: None,
            verdict: Verdict::of(result > factor * reference),
        }
    }

    /// Results of several seeds, whose median should be at most `goal` and whose worst at most twice; `None` without results.
    pub fn at_most(unit: &str, paper: Option<f64>, goal: f64, results: &[f64]) -> Option<Self> {
        let mut sorted = results.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let worst = *sorted.last()?;
        let median = 0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]);
        Some(Self {
            unit: unit.to_owned(),
            paper,
            goal: format!("at most {goal} {unit}").trim_end().to_owned(),
            median,
            worst: (sorted.len() > 1).then_some(worst),
            verdict: Verdict::of(median <= goal && worst <= WORST_FACTOR * goal),
        })
    }

    /// Goal, median, worst, ratio to the paper and verdict as cells of a table; empty where there is none.
    pub(super) fn cells(&self) -> [String; 5] {
        let number = |x: f64| with_unit(x, &self.unit);
        [
            self.goal.clone(),
            number(self.median),
            self.worst.map_or_else(String::new, number),
            self.ratio().filter(|ratio| ratio.is_finite()).map_or_else(String::new, |ratio| format!("{ratio:.2}")),
            self.verdict.name().to_owned(),
        ]
    }

    /// Ratio of the result to the number in the paper.
    pub fn ratio(&self) -> Option<f64> {
        self.paper.filter(|paper| *paper != 0.0).map(|paper| self.median / paper)
    }
}

/// A number with its unit, which may be empty.
pub(super) fn with_unit(x: f64, unit: &str) -> String {
    let unit = if x.is_finite() { unit } else { "" };
    format!("{} {unit}", rounded(x)).trim_end().to_owned()
}

/// Three significant digits; an infinite number is that of a run without a result.
pub(super) fn rounded(x: f64) -> String {
    if x.is_infinite() {
        return "no result".to_owned();
    }
    let digits = if x != 0.0 && x.is_finite() { x.abs().log10().floor() } else { 0.0 };
    let decimals = (2.0 - digits).clamp(0.0, 6.0) as usize;
    format!("{x:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_significant_digits() {
        assert_eq!([0.01234, 1.0, 56.78, 1234.5, 0.0].map(rounded), ["0.0123", "1.00", "56.8", "1234", "0.00"]);
        assert_eq!([2.0, f64::INFINITY].map(|x| with_unit(x, "mm")), ["2.00 mm", "no result"]);
    }

    #[test]
    fn a_result_is_compared_with_the_paper_or_the_goal() {
        let near = Comparison::near("", 15.0, 12.0);
        assert_eq!((near.verdict, near.ratio()), (Verdict::Met, Some(0.8)));
        assert_eq!(Comparison::near("", 15.0, 9.0).verdict, Verdict::Missed);
        assert_eq!(Comparison::near("", 15.0, f64::NAN).verdict, Verdict::Missed);
        assert_eq!(Comparison::above("mm", 10.0, 1.2, 11.0).verdict, Verdict::Missed);
        assert_eq!(Comparison::above("mm", 10.0, 1.2, 13.0).verdict, Verdict::Met);
        let seeds = Comparison::at_most("mm", Some(6.9), 0.5, &[0.9, 0.3, 0.5, 0.4]).unwrap();
        assert_eq!((seeds.median, seeds.worst, seeds.verdict), (0.45, Some(0.9), Verdict::Met));
        assert_eq!(Comparison::at_most("mm", None, 0.5, &[0.4, 0.4, 1.1]).unwrap().verdict, Verdict::Missed);
        assert!(Comparison::at_most("mm", None, 0.5, &[]).is_none());
    }
}
