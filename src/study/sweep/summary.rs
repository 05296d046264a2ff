//! What the runs of a sweep say together, axis by axis.

use super::paired::{holm, signed_rank_p};
use super::runs::{Runs, level_of, levels_of};
use super::table::{Held, Table};
use super::trend::rank_correlation;
use super::{Measure, Plan, Sampling, Sweep};
use crate::spec::SpecError;
use crate::study::StudyError;
use serde::Serialize;

/// A level differs, or a trend is there, when what is seen would be rarer than this without it.
pub const SIGNIFICANT: f64 = 0.05;

/// What a measure says of a level of an axis, over all else or at one level of another axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// The axis.
    pub axis: String,
    /// The level; of a range the middle of a part of it.
    pub level: String,
    /// The level as a number, where it is one.
    pub value: Option<f64>,
    /// The level of the axis by which all is told separately; `None` for all.
    pub within: Option<String>,
    /// The measure.
    pub measure: Measure,
    /// How many runs.
    pub runs: usize,
    /// How many of them have no such figure. Of an estimate that counts as infinite below; else they are left out.
    pub lost: usize,
    /// The median figure, in the measure's unit.
    pub median: f64,
    /// A quarter of the figures is less.
    pub quarter: f64,
    /// A quarter of the figures is more.
    pub three_quarters: f64,
    /// The greatest.
    pub greatest: f64,
    /// Of a grid: against the axis's first level in runs that are alike in all else.
    pub against_first: Option<Against>,
}

/// A level against the first of its axis, run by run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Against {
    /// Median of the runs' ratios.
    pub ratio: f64,
    /// The least ratio.
    pub least: f64,
    /// The greatest ratio.
    pub greatest: f64,
    /// Level of the signed-rank test that the ratios' logarithms are about zero.
    pub p: f64,
    /// The same, corrected for all levels of the axis by Holm's method.
    pub corrected_p: f64,
}

/// How a measure follows a numeric axis that is sampled.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// The axis.
    pub axis: String,
    /// The measure.
    pub measure: Measure,
    /// Spearman's rank correlation.
    pub correlation: f64,
    /// Its level.
    pub p: f64,
    /// The same, corrected for all axes by Holm's method.
    pub corrected_p: f64,
}

/// All that the runs of a sweep say together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Runs that are done.
    pub runs: usize,
    /// The axes.
    pub axes: Vec<String>,
    /// The measures, the most important first.
    pub measures: Vec<Measure>,
    /// A line each of measure, axis, level of the axis by which all is told (all first), and level, in this order.
    pub lines: Vec<Line>,
    /// What sampled axes do.
    pub trends: Vec<Trend>,
}

impl Against {
    /// Whether the level differs from the first.
    pub fn is_significant(&self) -> bool {
        self.corrected_p < SIGNIFICANT
    }
}

impl Trend {
    /// Whether there is one.
    pub fn is_significant(&self) -> bool {
        self.corrected_p < SIGNIFICANT
    }
}

impl Summary {
    /// The line of a level, over all or at a level of the axis by which all is told.
    pub fn line(&self, axis: &str, level: &str, within: Option<&str>, measure: Measure) -> Option<&Line> {
        self.lines.iter().find(|line| {
            line.axis == axis && line.level == level && line.within.as_deref() == within && line.measure == measure
        })
    }

    /// The lines of an axis.
    pub fn of_axis<'a>(
        &'a self,
        axis: &'a str,
        within: Option<&'a str>,
        measure: Measure,
    ) -> impl Iterator<Item = &'a Line> {
        self.lines
            .iter()
            .filter(move |line| line.axis == axis && line.within.as_deref() == within && line.measure == measure)
    }
}

impl Sweep {
    /// Sums up the merged table.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    pub fn summary(&self) -> Result<Summary, StudyError> {
        let runs = Runs::of(self)?;
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

    /// A measure of all rows of the merged table; what is not there is NaN, or infinite where an estimate was lost.
    pub(super) fn figures(&self, measure: Measure) -> Result<Vec<f64>, StudyError> {
        let path = if measure == Measure::WallS { self.times() } else { self.table() };
        let unmerged = || SpecError::plain(path.display().to_string(), "is not there: merge the sweep first");
        let table = Table::open(&path)?.ok_or_else(unmerged)?;
        let cells = table.column(measure.key(), Held::Numbers)?.numbers();
        Ok(cells.into_iter().map(|cell| cell.unwrap_or(measure.when_lost())).collect())
    }
}

/// The lines of an axis, over all and at each level of the axis by which all is told.
fn lines(plan: &Plan, runs: &Runs, figures: &[f64], measure: Measure, axis: usize) -> Vec<Line> {
    let by = plan.axes().iter().position(|other| Some(&other.name) == plan.spec().by.as_ref());
    let by = by.filter(|by| *by != axis);
    let withins =
        std::iter::once(None).chain(by.into_iter().flat_map(|by| (0..levels_of(plan, by)).map(move |k| Some((by, k)))));
    let firsts = against_which(plan, runs, axis);
    let mut all = Vec::new();
    for within in withins {
        let is_in = |row: usize| within.is_none_or(|(by, level)| runs.levels[by][row] as usize == level);
        let mut rows_by_level: Vec<Vec<usize>> = vec![Vec::new(); levels_of(plan, axis)];
        for row in (0..runs.numbers.len()).filter(|row| is_in(*row)) {
            rows_by_level[runs.levels[axis][row] as usize].push(row);
        }
        let mut lines = Vec::new();
        for (level, rows) in rows_by_level.iter().enumerate() {
            let (word, value) = level_of(plan, axis, level);
            let line = line(rows, figures, firsts.as_deref().filter(|_| level > 0));
            let within = within.map(|(by, level)| level_of(plan, by, level).0);
            let axis = plan.axes()[axis].name.clone();
            lines.push(Line { axis, level: word, value, within, measure, ..line });
        }
        let levels: Vec<f64> = lines.iter().filter_map(|line| line.against_first.map(|against| against.p)).collect();
        let compared = lines.iter_mut().filter_map(|line| line.against_first.as_mut());
        compared.zip(holm(&levels)).for_each(|(against, p)| against.corrected_p = p);
        all.extend(lines);
    }
    all
}

/// Of each row of a grid the row that differs in `axis` alone, where it has its first level.
fn against_which(plan: &Plan, runs: &Runs, axis: usize) -> Option<Vec<Option<usize>>> {
    if plan.spec().sampling != Sampling::Grid {
        return None;
    }
    let later: usize = (axis + 1..plan.axes().len()).map(|axis| levels_of(plan, axis)).product();
    let stride = (later * plan.spec().seeds.len().max(1)) as u64;
    let first = |(row, number): (usize, &u64)| runs.row(number - u64::from(runs.levels[axis][row]) * stride);
    Some(runs.numbers.iter().enumerate().map(first).collect())
}

fn line(rows: &[usize], figures: &[f64], firsts: Option<&[Option<usize>]>) -> Line {
    let told = sorted(rows.iter().map(|row| figures[*row]));
    let against_first = firsts.map(|firsts| {
        let ratio = |row: &usize| {
            let (of, first) = (figures[*row], figures[firsts[*row]?]);
            // Both lost, or both without error: alike.
            Some(if of == first { 1.0 } else { of / first })
        };
        let ratios = sorted(rows.iter().filter_map(ratio));
        let logarithms: Vec<f64> = ratios.iter().map(|ratio| ratio.ln()).collect();
        let p = signed_rank_p(&logarithms);
        Against {
            ratio: quantile(&ratios, 0.5),
            least: ratios.first().copied().unwrap_or(f64::NAN),
            greatest: ratios.last().copied().unwrap_or(f64::NAN),
            p,
            corrected_p: p,
        }
    });
    Line {
        axis: String::new(),
        level: String::new(),
        value: None,
        within: None,
        measure: Measure::WallS,
        runs: rows.len(),
        lost: rows.len() - told.iter().filter(|figure| figure.is_finite()).count(),
        median: quantile(&told, 0.5),
        quarter: quantile(&told, 0.25),
        three_quarters: quantile(&told, 0.75),
        greatest: told.last().copied().unwrap_or(f64::NAN),
        against_first,
    }
}

/// How a measure follows each numeric axis.
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

/// A quantile of sorted numbers, between neighbours linearly; NaN of none.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    // Two infinite neighbours have no difference.
    if below == above { below } else { below + (above - below) * place.fract() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_neighbours() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0, f64::INFINITY], 0.5), 3.0);
        assert_eq!(quantile(&[1.0, f64::INFINITY, f64::INFINITY], 0.75), f64::INFINITY);
        assert_eq!(quantile(&[5.0], 0.25), 5.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn ratios_are_of_like_runs_and_lost_ones_are_the_worst() {
        // Rows 0..6 are the first level, 6..12 a tenth better, 12..18 the same but for one that is lost.
        let base: Vec<f64> = (0..6).map(|k| if k < 3 { 0.01 } else { 0.1 } + 0.001 * f64::from(k)).collect();
        let mut figures = base.clone();
        figures.extend(base.iter().map(|x| 0.9 * x));
        figures.extend(base.iter().enumerate().map(|(k, x)| if k == 5 { f64::INFINITY } else { *x }));
        let firsts: Vec<Option<usize>> = (0..18).map(|row| Some(row % 6)).collect();
        let rows = |level: usize| (6 * level..6 * level + 6).collect::<Vec<_>>();
        let better = line(&rows(1), &figures, Some(&firsts)).against_first.unwrap();
        assert!((better.ratio - 0.9).abs() < 1e-12 && (better.greatest - 0.9).abs() < 1e-12, "{better:?}");
        // All six signs alike: 2 / 2^6.
        assert!((better.p - 2.0 / 64.0).abs() < 1e-15);
        let lost = line(&rows(2), &figures, Some(&firsts));
        let against = lost.against_first.unwrap();
        assert_eq!((lost.lost, against.ratio, against.greatest, against.p), (1, 1.0, f64::INFINITY, 1.0));
    }
}
