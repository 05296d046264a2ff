//! Verdict on a result in comparison with a paper and a goal.

use serde::{Deserialize, Serialize};

/// Maximum factor between a result and a number that is read off a plot of the paper.
const READING_FACTOR: f64 = 1.5;
/// By default the worst of several runs may be this factor beyond the goal for the median.
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

/// A goal for the median of several runs, and a limit of the worst of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Whether the results should be at most the goal, not at least.
    pub is_most: bool,
    /// Goal for the median.
    pub median: f64,
    /// Limit of the worst; by default twice the goal, or half of it where results should be at least the goal.
    pub worst: Option<f64>,
}

impl Goal {
    /// A goal that the median should not exceed.
    pub fn at_most(median: f64) -> Self {
        Self { is_most: true, median, worst: None }
    }

    fn worst(self) -> f64 {
        let factor = if self.is_most == (self.median >= 0.0) { WORST_FACTOR } else { 1.0 / WORST_FACTOR };
        self.worst.unwrap_or(factor * self.median)
    }

    fn accepts(self, result: f64, limit: f64) -> bool {
        if self.is_most { result <= limit } else { result >= limit }
    }

    fn in_words(self, unit: &str) -> String {
        let bound = if self.is_most { "at most" } else { "at least" };
        let goal = format!("{bound} {} {unit}", self.median);
        let worst = self.worst.map_or_else(String::new, |worst| format!(", worst {worst} {unit}"));
        format!("{}{}", goal.trim_end(), worst.trim_end())
    }
}

/// The median of sorted numbers.
fn median(sorted: &[f64]) -> Option<f64> {
    let middle = [sorted.len().checked_sub(1)? / 2, sorted.len() / 2];
    Some(0.5 * middle.map(|k| sorted[k]).iter().sum::<f64>())
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

    /// Results of several runs in comparison with a goal; `None` without results.
    ///
    /// A result is infinite if a run failed.
    pub fn with_goal(unit: &str, paper: Option<f64>, goal: Goal, results: &[f64]) -> Option<Self> {
        let mut sorted = results.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let worst = if goal.is_most { *sorted.last()? } else { *sorted.first()? };
        let median = median(&sorted)?;
        Some(Self {
            unit: unit.to_owned(),
            paper,
            goal: goal.in_words(unit),
            median,
            worst: (sorted.len() > 1).then_some(worst),
            verdict: Verdict::of(goal.accepts(median, goal.median) && goal.accepts(worst, goal.worst())),
        })
    }

    /// Goal, median, worst, ratio to the paper and verdict as cells of a table; empty where there is none.
    pub(crate) fn cells(&self) -> [String; 5] {
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
        let seeds = Comparison::with_goal("mm", Some(6.9), Goal::at_most(0.5), &[0.9, 0.3, 0.5, 0.4]).unwrap();
        assert_eq!((seeds.median, seeds.worst, seeds.verdict), (0.45, Some(0.9), Verdict::Met));
        let worst_beyond_twice = Comparison::with_goal("mm", None, Goal::at_most(0.5), &[0.4, 0.4, 1.1]).unwrap();
        assert_eq!(worst_beyond_twice.verdict, Verdict::Missed);
        assert!(Comparison::with_goal("mm", None, Goal::at_most(0.5), &[]).is_none());
        let least = Goal { is_most: false, median: 0.98, worst: Some(0.9) };
        let within = |results: &[f64]| Comparison::with_goal("", None, least, results).unwrap();
        assert_eq!(
            (within(&[1.0, 0.91, 0.99]).verdict, within(&[1.0, 0.89, 0.99]).verdict),
            (Verdict::Met, Verdict::Missed)
        );
        assert_eq!((within(&[1.0, 0.5]).worst, within(&[1.0]).goal.as_str()), (Some(0.5), "at least 0.98, worst 0.9"));
        assert_eq!(within(&[f64::NEG_INFINITY, 0.99, 0.99]).verdict, Verdict::Missed);
    }
}
