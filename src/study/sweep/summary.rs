//! Summary of a sweep: statistics of each measure per axis and level.

use super::paired::{holm, signed_rank_p};
use super::runs::{Runs, level_count, level_label};
use super::table::{Column, ColumnType};
use super::trend::rank_correlation;
use super::{Measure, Plan, Sampling, Sweep};
use crate::StudyError;
use serde::Serialize;
use zsim_run::Needs;

/// Significance level of corrected p-values, for differences between levels and for trends.
pub const SIGNIFICANCE_LEVEL: f64 = 0.05;

/// Statistics of a measure at one level of an axis, over all runs or within one level of the axis `by`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LevelSummary {
    /// Name of the axis.
    pub axis: String,
    /// Label of the level; of a continuous axis the centre of a bin.
    pub level: String,
    /// The level as a number; `None` if it is not numeric.
    pub value: Option<f64>,
    /// Level of the axis `by` that the runs are restricted to; `None` for all runs.
    pub within: Option<String>,
    /// The measure.
    pub measure: Measure,
    /// Number of runs.
    pub runs: usize,
    /// Number of runs without a finite figure. The statistics below take a lost estimate as infinite and omit other
    /// missing figures.
    pub lost: usize,
    /// Median, in the unit of the measure's key.
    pub median: f64,
    /// Lower quartile.
    pub quarter: f64,
    /// Upper quartile.
    pub three_quarters: f64,
    /// Maximum.
    pub greatest: f64,
    /// Comparison with the axis's first level, over pairs of runs that differ only in this axis; only in a grid.
    pub against_first: Option<RatioToFirst>,
}

/// Paired comparison of a level with the first level of its axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RatioToFirst {
    /// Median ratio over the pairs.
    pub ratio: f64,
    /// Minimum ratio.
    pub least: f64,
    /// Maximum ratio.
    pub greatest: f64,
    /// p-value of the Wilcoxon signed-rank test of the log ratios.
    pub p: f64,
    /// p-value, Holm-corrected over all levels of the axis.
    pub corrected_p: f64,
}

/// Rank correlation of a measure with a sampled numeric axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// Name of the axis.
    pub axis: String,
    /// The measure.
    pub measure: Measure,
    /// Spearman's rank correlation.
    pub correlation: f64,
    /// p-value of the correlation.
    pub p: f64,
    /// p-value, Holm-corrected over all axes.
    pub corrected_p: f64,
}

/// Summary of all runs of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of finished runs.
    pub runs: usize,
    /// Names of the axes.
    pub axes: Vec<String>,
    /// The measures, the most important first.
    pub measures: Vec<Measure>,
    /// Statistics, ordered by measure, axis, level of the axis `by` (all runs first), and level.
    pub lines: Vec<LevelSummary>,
    /// Trends along numeric axes; empty for a grid.
    pub trends: Vec<Trend>,
}

impl RatioToFirst {
    /// Whether the level differs significantly from the first.
    pub fn is_significant(&self) -> bool {
        self.corrected_p < SIGNIFICANCE_LEVEL
    }
}

impl Trend {
    /// Whether the trend is significant.
    pub fn is_significant(&self) -> bool {
        self.corrected_p < SIGNIFICANCE_LEVEL
    }
}

impl Summary {
    /// Statistics of a level, over all runs or within a level of the axis `by`.
    pub fn line(&self, axis: &str, level: &str, within: Option<&str>, measure: Measure) -> Option<&LevelSummary> {
        self.lines.iter().find(|line| {
            line.axis == axis && line.level == level && line.within.as_deref() == within && line.measure == measure
        })
    }

    /// Statistics of all levels of an axis.
    pub fn of_axis<'a>(
        &'a self,
        axis: &'a str,
        within: Option<&'a str>,
        measure: Measure,
    ) -> impl Iterator<Item = &'a LevelSummary> {
        self.lines
            .iter()
            .filter(move |line| line.axis == axis && line.within.as_deref() == within && line.measure == measure)
    }
}

impl Sweep {
    /// Summarises the merged table.
    ///
    /// # Errors
    /// If there is no merged table, or if it cannot be read.
    pub fn summary(&self) -> Result<Summary, StudyError> {
        let runs = Runs::read(self)?;
        let mut summary = Summary {
            runs: runs.numbers.len(),
            axes: self.plan.axes().iter().map(|axis| axis.name.clone()).collect(),
            measures: self.plan.spec().measures.clone(),
            lines: Vec::new(),
            trends: Vec::new(),
        };
        for measure in &self.plan.spec().measures {
            let figures = self.figures(*measure)?;
            for axis in 0..self.plan.axes().len() {
                summary.lines.extend(lines(&self.plan, &runs, &figures, *measure, axis));
            }
            if self.plan.spec().sampling != Sampling::Grid {
                summary.trends.extend(trends(&self.plan, &runs, &figures, *measure));
            }
        }
        Ok(summary)
    }

    /// A measure of all rows of the merged table.
    ///
    /// A missing figure is infinite for a failed estimate, and against a reference that is lost; else it is NaN, as the drift of a
    /// run that is too short for it.
    pub(super) fn figures(&self, measure: Measure) -> Result<Vec<f64>, StudyError> {
        if measure.is_time() {
            let missing = if measure.is_of_estimate() { f64::INFINITY } else { f64::NAN };
            return Ok(self.read_measure(measure)?.into_iter().map(|cell| cell.unwrap_or(missing)).collect());
        }
        let columns = [(measure.key(), ColumnType::Numbers), ("error", ColumnType::Text)];
        let mut columns = self.read_merged(&self.table(), &columns)?.into_iter();
        let cells = columns.next().map_or_else(Vec::new, Column::numbers);
        let errors = columns.next().map_or_else(Vec::new, Column::texts);
        let missing = |is_failed: bool| match measure.needs() {
            Needs::Reference => f64::INFINITY,
            _ if is_failed && measure.is_of_estimate() => f64::INFINITY,
            _ => f64::NAN,
        };
        let figure = |(cell, error): (Option<f64>, Option<String>)| cell.unwrap_or_else(|| missing(error.is_some()));
        Ok(cells.into_iter().zip(errors).map(figure).collect())
    }
}

/// Statistics of an axis's levels, over all runs and within each level of the axis `by`.
fn lines(plan: &Plan, runs: &Runs, figures: &[f64], measure: Measure, axis: usize) -> Vec<LevelSummary> {
    let by = plan.axes().iter().position(|other| Some(&other.name) == plan.spec().by.as_ref());
    let by = by.filter(|by| *by != axis);
    let withins = std::iter::once(None)
        .chain(by.into_iter().flat_map(|by| (0..level_count(plan, by)).map(move |k| Some((by, k)))));
    let firsts = first_level_rows(plan, runs, axis);
    let mut all = Vec::new();
    for within in withins {
        let is_in = |row: usize| within.is_none_or(|(by, level)| runs.levels[by][row] as usize == level);
        let mut rows_by_level: Vec<Vec<usize>> = vec![Vec::new(); level_count(plan, axis)];
        for row in (0..runs.numbers.len()).filter(|row| is_in(*row)) {
            rows_by_level[runs.levels[axis][row] as usize].push(row);
        }
        let mut lines = Vec::new();
        for (level, rows) in rows_by_level.iter().enumerate() {
            let (label, value) = level_label(plan, axis, level);
            let line = line(rows, figures, firsts.as_deref().filter(|_| level > 0));
            let within = within.map(|(by, level)| level_label(plan, by, level).0);
            let axis = plan.axes()[axis].name.clone();
            lines.push(LevelSummary { axis, level: label, value, within, measure, ..line });
        }
        let p_values: Vec<f64> = lines.iter().filter_map(|line| line.against_first.map(|against| against.p)).collect();
        let compared = lines.iter_mut().filter_map(|line| line.against_first.as_mut());
        compared.zip(holm(&p_values)).for_each(|(against, p)| against.corrected_p = p);
        all.extend(lines);
    }
    all
}

/// For each row of a grid, the row with the first level of `axis` and all other settings equal; `None` without a grid.
fn first_level_rows(plan: &Plan, runs: &Runs, axis: usize) -> Option<Vec<Option<usize>>> {
    if plan.spec().sampling != Sampling::Grid {
        return None;
    }
    let later: usize = (axis + 1..plan.axes().len()).map(|axis| level_count(plan, axis)).product();
    let stride = (later * plan.spec().seeds.len().max(1)) as u64;
    let first = |(row, number): (usize, &u64)| runs.row(number - u64::from(runs.levels[axis][row]) * stride);
    Some(runs.numbers.iter().enumerate().map(first).collect())
}

/// Statistics of `rows`; the caller fills in the labels.
fn line(rows: &[usize], figures: &[f64], firsts: Option<&[Option<usize>]>) -> LevelSummary {
    let sorted_figures = sorted(rows.iter().map(|row| figures[*row]));
    let against_first = firsts.map(|firsts| {
        let ratio = |row: &usize| {
            let (figure, first) = (figures[*row], figures[firsts[*row]?]);
            // Two infinite or two zero figures are equal, though their ratio is NaN.
            Some(if figure == first { 1.0 } else { figure / first })
        };
        let ratios = sorted(rows.iter().filter_map(ratio));
        let logarithms: Vec<f64> = ratios.iter().map(|ratio| ratio.ln()).collect();
        let p = signed_rank_p(&logarithms);
        RatioToFirst {
            ratio: quantile(&ratios, 0.5),
            least: ratios.first().copied().unwrap_or(f64::NAN),
            greatest: ratios.last().copied().unwrap_or(f64::NAN),
            p,
            corrected_p: p,
        }
    });
    LevelSummary {
        axis: String::new(),
        level: String::new(),
        value: None,
        within: None,
        measure: Measure::WALL_S,
        runs: rows.len(),
        lost: rows.len() - sorted_figures.iter().filter(|figure| figure.is_finite()).count(),
        median: quantile(&sorted_figures, 0.5),
        quarter: quantile(&sorted_figures, 0.25),
        three_quarters: quantile(&sorted_figures, 0.75),
        greatest: sorted_figures.last().copied().unwrap_or(f64::NAN),
        against_first,
    }
}

/// Rank correlations of a measure with each numeric axis.
fn trends(plan: &Plan, runs: &Runs, figures: &[f64], measure: Measure) -> Vec<Trend> {
    let mut trends = Vec::new();
    for (axis, settings) in plan.axes().iter().zip(&runs.settings) {
        let pairs = settings.iter().flatten().zip(figures).filter(|(_, figure)| !figure.is_nan());
        let pairs: Vec<(f64, f64)> = pairs.map(|(setting, figure)| (*setting, *figure)).collect();
        if let Some((correlation, p)) = rank_correlation(&pairs) {
            trends.push(Trend { axis: axis.name.clone(), measure, correlation, p, corrected_p: p });
        }
    }
    let corrected = holm(&trends.iter().map(|trend| trend.p).collect::<Vec<_>>());
    trends.iter_mut().zip(corrected).for_each(|(trend, p)| trend.corrected_p = p);
    trends
}

fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = numbers.filter(|number| !number.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Quantile of sorted numbers at `fraction`, linearly interpolated; NaN if there are none.
pub(super) fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let position = fraction * last as f64;
    let (below, above) = (sorted[position.floor() as usize], sorted[position.ceil() as usize]);
    // The difference of two infinite neighbours is NaN.
    if below == above { below } else { below + (above - below) * position.fract() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_interpolated_between_neighbours() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0, f64::INFINITY], 0.5), 3.0);
        assert_eq!(quantile(&[1.0, f64::INFINITY, f64::INFINITY], 0.75), f64::INFINITY);
        assert_eq!(quantile(&[5.0], 0.25), 5.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn ratios_are_of_paired_runs_and_lost_runs_are_infinite() {
        // Rows 0..6 are the first level; 6..12 are 10 % smaller; 12..18 are equal except for one lost run.
        let base: Vec<f64> = (0..6).map(|k| if k < 3 { 0.01 } else { 0.1 } + 0.001 * f64::from(k)).collect();
        let mut figures = base.clone();
        figures.extend(base.iter().map(|x| 0.9 * x));
        figures.extend(base.iter().enumerate().map(|(k, x)| if k == 5 { f64::INFINITY } else { *x }));
        let firsts: Vec<Option<usize>> = (0..18).map(|row| Some(row % 6)).collect();
        let rows = |level: usize| (6 * level..6 * level + 6).collect::<Vec<_>>();
        let better = line(&rows(1), &figures, Some(&firsts)).against_first.unwrap();
        assert!((better.ratio - 0.9).abs() < 1e-12 && (better.greatest - 0.9).abs() < 1e-12, "{better:?}");
        // All six signs equal: 2 / 2^6.
        assert!((better.p - 2.0 / 64.0).abs() < 1e-15);
        let lost = line(&rows(2), &figures, Some(&firsts));
        let against = lost.against_first.unwrap();
        assert_eq!((lost.lost, against.ratio, against.greatest, against.p), (1, 1.0, f64::INFINITY, 1.0));
    }
}
