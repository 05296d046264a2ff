//! Maps of a sweep: the median of a measure over two axes.

use super::runs::{Runs, level_count, level_label};
use super::summary::quantile;
use super::{Measure, Plan, Sweep};
use crate::StudyError;
use zsim_report::axis_label;
use zsim_report::plot::{Cell, Cells, Chart, Figure, Tick};

/// Maximum number of pairs of axes with a map, to keep the figure readable.
const MAX_MAPS: usize = 6;
/// Maximum number of levels of a numeric axis.
const MAX_NUMERIC_LEVELS: usize = 60;
/// Maximum number of levels of an axis of text: the labels of more overlap.
const MAX_TEXT_LEVELS: usize = 8;

impl Sweep {
    /// Maps of a measure's median, one for each pair of axes; `None` if no pair has a map.
    pub(super) fn maps(&self, runs: &Runs, measure: Measure) -> Result<Option<Figure>, StudyError> {
        let plan = &self.plan;
        let axes = plan.axes().len();
        let most = |axis: usize| if plan.axes()[axis].is_number() { MAX_NUMERIC_LEVELS } else { MAX_TEXT_LEVELS };
        let is_shown = |axis: &usize| (2..=most(*axis)).contains(&level_count(plan, *axis));
        let pairs = (0..axes).flat_map(|x| (x + 1..axes).map(move |y| (x, y)));
        let pairs: Vec<(usize, usize)> = pairs
            .filter(|(x, y)| is_shown(x) && is_shown(y))
            .take(MAX_MAPS)
            .map(|(a, b)| if label_length(plan, a) > label_length(plan, b) { (b, a) } else { (a, b) })
            .collect();
        if pairs.is_empty() {
            return Ok(None);
        }
        let figures = self.figures(measure)?;
        // Labels of text need the full width.
        let is_wide = pairs.len() == 1 || pairs.iter().any(|(x, _)| label_length(plan, *x) > 0);
        let charts = pairs.into_iter().map(|(x, y)| map(plan, runs, &figures, x, y, measure)).collect();
        Ok(Some(Figure::of(charts).in_columns(if is_wide { 1 } else { 2 })))
    }
}

/// Length of the longest label of an axis of text, characters; 0 for a numeric axis.
///
/// The axis of a map with the longer labels is vertical, where labels are next to each other.
fn label_length(plan: &Plan, axis: usize) -> usize {
    if plan.axes()[axis].is_number() {
        return 0;
    }
    let lengths = (0..level_count(plan, axis)).map(|level| level_label(plan, axis, level).0.chars().count());
    lengths.max().unwrap_or_default()
}

/// Map of a measure's median over the axes `x` and `y`.
fn map(plan: &Plan, runs: &Runs, figures: &[f64], x: usize, y: usize, measure: Measure) -> Chart {
    let (_, per_unit) = measure.unit();
    let (wide, high) = (level_count(plan, x), level_count(plan, y));
    let mut figures_of_cell: Vec<Vec<f64>> = vec![Vec::new(); wide * high];
    for (row, figure) in figures.iter().enumerate().filter(|(_, figure)| !figure.is_nan()) {
        figures_of_cell[runs.levels[x][row] as usize * high + runs.levels[y][row] as usize].push(*figure);
    }
    let median = |mut figures: Vec<f64>| {
        figures.sort_by(f64::total_cmp);
        quantile(&figures, 0.5) * per_unit
    };
    let medians: Vec<f64> = figures_of_cell.into_iter().map(median).collect();
    let (across, up) = (edges(plan, x), edges(plan, y));
    let cell = |(k, median): (usize, &f64)| {
        let value = if median.is_finite() { *median } else { f64::NAN };
        Cell { x: across[k / high], y: up[k % high], value }
    };
    // The title has the unit.
    let cells = Cells::with_robust_range("", medians.iter().enumerate().map(cell).collect());
    let chart = Chart::new(&measure.label(), &axis_label(&plan.axes()[x].name), &axis_label(&plan.axes()[y].name))
        .with_cells(cells);
    let chart = if plan.axes()[x].is_number() { chart } else { chart.with_x_ticks(level_ticks(plan, x)) };
    if plan.axes()[y].is_number() { chart } else { chart.with_y_ticks(level_ticks(plan, y)) }
}

/// Extent of each level in a map: half way to its neighbours.
fn edges(plan: &Plan, axis: usize) -> Vec<(f64, f64)> {
    let count = level_count(plan, axis);
    let number = |k: usize| level_label(plan, axis, k).1.filter(|_| plan.axes()[axis].is_number()).unwrap_or(k as f64);
    let at: Vec<f64> = (0..count).map(number).collect();
    let middle = |a: usize, b: usize| 0.5 * (at[a] + at[b]);
    let step = if count > 1 { at[1] - at[0] } else { 1.0 };
    let last = if count > 1 { at[count - 1] - at[count - 2] } else { 1.0 };
    (0..count)
        .map(|k| {
            let from = if k == 0 { at[0] - 0.5 * step } else { middle(k - 1, k) };
            let to = if k + 1 == count { at[k] + 0.5 * last } else { middle(k, k + 1) };
            (from.min(to), from.max(to))
        })
        .collect()
}

/// Ticks with the labels of an axis's levels.
fn level_ticks(plan: &Plan, axis: usize) -> Vec<Tick> {
    (0..level_count(plan, axis)).map(|k| Tick { at: k as f64, label: level_label(plan, axis, k).0 }).collect()
}
