//! Plots of a sweep: effect of each axis, maps over two axes, ratios, Pareto front.

use super::pareto::pareto_set;
use super::runs::{Runs, level_count, level_label};
use super::summary::{LevelSummary, Summary, quantile};
use super::{Measure, Plan, Sweep};
use crate::report::plot::{Cell, Cells, Chart, Colour, Figure, Mark, Series};
use crate::study::StudyError;
use crate::study::atomic_file::write_text;

/// Height of a level's row in a ratio plot, points: fits a line of text.
const ROW_HEIGHT: f64 = 17.0;
/// Ticks of the logarithmic ratio axis.
const RATIO_TICKS: [f64; 15] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.7, 1.0, 1.4, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Maximum number of pairs of axes with a map, to keep the figure readable.
const MAX_MAPS: usize = 6;
/// Maximum number of levels of an axis of text in a map: the labels of more overlap.
const MAX_TEXT_LEVELS: usize = 8;
/// A measure whose largest value is more than this multiple of the smallest is drawn on a logarithmic axis.
const LOGARITHMIC_RANGE: f64 = 300.0;
/// Maximum number of dots in a plot; more are subsampled evenly to limit the size of the SVG.
const MAX_DOTS: usize = 5_000;

impl Sweep {
    /// Draws all plots to `plots/`, and writes the Pareto front to `front.csv`; returns the names of the plots.
    ///
    /// # Errors
    /// If the table is not merged, or if a file cannot be written.
    pub(super) fn draw(&self, summary: &Summary) -> Result<Vec<String>, StudyError> {
        let folder = self.folder.join("plots");
        std::fs::create_dir_all(&folder).map_err(StudyError::file(&folder))?;
        let runs = Runs::read(self)?;
        let mut figures: Vec<(String, Figure)> = self.front(&runs)?.into_iter().collect();
        for measure in &summary.measures {
            figures.push((format!("effects_{}", measure.key()), effects(&self.plan, summary, *measure)));
            let maps = self.maps(&runs, *measure)?;
            if !maps.is_empty() {
                figures.push((format!("maps_{}", measure.key()), Figure::of(maps).in_columns(2)));
            }
        }
        for axis in self.plan.axes().iter().filter(|axis| !axis.is_number()) {
            let figure = summary.measures.first().and_then(|measure| ratios(summary, &axis.name, *measure));
            figures.extend(figure.map(|figure| (format!("ratios_{}", axis.name), figure)));
        }
        figures
            .into_iter()
            .map(|(name, figure)| figure.save(&folder, &name).map(|()| name).map_err(StudyError::from))
            .collect()
    }

    /// Maps of a measure's median, one for each pair of axes.
    fn maps(&self, runs: &Runs, measure: Measure) -> Result<Vec<Chart>, StudyError> {
        let axes = self.plan.axes().len();
        let most = |axis: usize| if self.plan.axes()[axis].is_number() { 60 } else { MAX_TEXT_LEVELS };
        let is_shown = |axis: &usize| (2..=most(*axis)).contains(&level_count(&self.plan, *axis));
        let pairs = (0..axes).flat_map(|x| (x + 1..axes).map(move |y| (x, y)));
        let pairs: Vec<(usize, usize)> = pairs.filter(|(x, y)| is_shown(x) && is_shown(y)).take(MAX_MAPS).collect();
        if pairs.is_empty() {
            return Ok(Vec::new());
        }
        let figures = self.figures(measure)?;
        Ok(pairs.into_iter().map(|(x, y)| map(&self.plan, runs, &figures, x, y, measure)).collect())
    }

    /// The plot of the Pareto front of the spec's goals, with its name; writes the front to `front.csv`.
    fn front(&self, runs: &Runs) -> Result<Option<(String, Figure)>, StudyError> {
        let goals = &self.plan.spec().front;
        let [first, second, ..] = goals.as_slice() else { return Ok(None) };
        let columns: Vec<Vec<f64>> = goals.iter().map(|goal| self.figures(goal.measure)).collect::<Result<_, _>>()?;
        let limits = &self.plan.spec().limits;
        let limited: Vec<Vec<f64>> =
            limits.iter().map(|limit| self.figures(limit.measure)).collect::<Result<_, _>>()?;
        let is_complete = |row: &usize| columns.iter().chain(&limited).all(|column| column[*row].is_finite());
        let is_within =
            |row: &usize| limits.iter().zip(&limited).all(|(limit, column)| limit.excess(column[*row]) <= 0.0);
        let rows: Vec<usize> = (0..runs.numbers.len()).filter(|row| is_complete(row) && is_within(row)).collect();
        let costs = |row: &usize| goals.iter().zip(&columns).map(|(goal, column)| goal.cost(column[*row])).collect();
        let costs: Vec<Vec<f64>> = rows.iter().map(costs).collect();
        let front: Vec<usize> = pareto_set(&costs).into_iter().map(|k| rows[k]).collect();
        let at = |row: &usize| {
            let shown = |measure: Measure, k: usize| columns[k][*row] * measure.unit().1;
            (shown(first.measure, 0), shown(second.measure, 1))
        };
        let every = rows.len().div_ceil(MAX_DOTS).max(1);
        let chart = Chart::new("Pareto front", first.measure.label(), second.measure.label())
            .with(
                Series::dots("runs", Colour::Backdrop, rows.iter().step_by(every).map(at).collect())
                    .marked(Mark::Dots(2.0)),
            )
            .with(Series::dots("front", Colour::Estimate, front.iter().map(at).collect()).marked(Mark::Dots(4.5)));
        let mut figure = Figure::of(vec![chart]);
        figure.chart_height = 420.0;
        self.write_front(runs, &front, &columns)?;
        Ok(Some(("front".to_owned(), figure)))
    }

    fn write_front(&self, runs: &Runs, front: &[usize], columns: &[Vec<f64>]) -> Result<(), StudyError> {
        let goals = &self.plan.spec().front;
        let axes = self.plan.axes().iter().map(|axis| axis.name.as_str());
        let names: Vec<&str> =
            std::iter::once("point").chain(axes).chain(goals.iter().map(|goal| goal.measure.key())).collect();
        let mut text = names.join(",") + "\n";
        for row in front {
            let number = runs.numbers[*row];
            let settings = self.plan.settings(number).into_iter().map(|setting| setting.to_string());
            let cells = std::iter::once(number.to_string()).chain(settings);
            let cells: Vec<String> = cells.chain(columns.iter().map(|column| column[*row].to_string())).collect();
            text += &(cells.join(",") + "\n");
        }
        let path = self.folder.join("front.csv");
        write_text(&self.temporary(), &path, &text)
    }
}

/// Effect of each axis over all other settings: median and interquartile band.
fn effects(plan: &Plan, summary: &Summary, measure: Measure) -> Figure {
    let (_, per_unit) = measure.unit();
    let charts = plan.axes().iter().map(|axis| {
        let lines: Vec<&LevelSummary> = summary.of_axis(&axis.name, None, measure).collect();
        if axis.is_number() {
            let at = |line: &&LevelSummary| (line.value.unwrap_or(f64::NAN), line.median * per_unit);
            let ends = |line: &&LevelSummary| {
                let [low, high] = [line.quarter, line.three_quarters].map(|x| x * per_unit);
                (line.value.unwrap_or(f64::NAN), low, high)
            };
            let band = lines.iter().map(ends).filter(|(_, low, high)| low.is_finite() && high.is_finite()).collect();
            let curve = Series::line("", Colour::Estimate, lines.iter().map(at).collect()).with_band(band);
            return Chart::new(&format!("By {}", axis.name), &axis.name, measure.label()).with(curve);
        }
        text_level_chart(&axis.name, measure, &lines)
    });
    let charts: Vec<Chart> = charts.collect();
    let most = charts.iter().map(|chart| chart.y_ticks.len()).max().unwrap_or_default();
    let columns = if charts.len() > 1 { 2 } else { 1 };
    let mut figure = Figure::of(charts).in_columns(columns);
    figure.chart_height = figure.chart_height.max(76.0 + ROW_HEIGHT * most as f64);
    figure
}

/// Median and quartiles of text levels in rows: such levels have no order for a curve.
fn text_level_chart(axis: &str, measure: Measure, lines: &[&LevelSummary]) -> Chart {
    let (_, per_unit) = measure.unit();
    let height = |index: usize| lines.len() as f64 - 1.0 - index as f64;
    let all = lines.iter().flat_map(|line| [line.quarter, line.median, line.three_quarters]).map(|x| x * per_unit);
    let (low, high) =
        all.filter(|x| x.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let is_logarithmic = low > 0.0 && high > LOGARITHMIC_RANGE * low;
    let at = |x: f64| if is_logarithmic { (x * per_unit).log10() } else { x * per_unit };
    let bars = lines.iter().enumerate().flat_map(|(k, line)| {
        let ends = [line.quarter, line.three_quarters].map(|x| (at(x), height(k)));
        [ends[0], ends[1], (f64::NAN, f64::NAN)]
    });
    let dots = lines.iter().enumerate().map(|(k, line)| (at(line.median), height(k)));
    let ticks = lines.iter().enumerate().map(|(k, line)| (height(k), line.level.clone()));
    // An invisible line reserves half a row above and below.
    let middle = if low <= high { at(0.5 * (low + high) / per_unit) } else { 0.0 };
    let room = vec![(middle, -0.5), (f64::NAN, f64::NAN), (middle, lines.len() as f64 - 0.5)];
    let chart = Chart::new(&format!("By {axis}"), measure.label(), "")
        .with(Series::line("", Colour::Backdrop, room))
        .with(Series::line("", Colour::Backdrop, bars.collect()).marked(Mark::Line(4.0)))
        .with(Series::dots("", Colour::Estimate, dots.collect()).marked(Mark::Dots(6.0)))
        .with_y_ticks(ticks.collect());
    if is_logarithmic { chart.with_x_ticks(decades(low, high)) } else { chart }
}

/// Ticks at the powers of ten from `low` to `high`, every second or third if they are many.
fn decades(low: f64, high: f64) -> Vec<(f64, String)> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let step = (1 + (last - first) / 4) as usize;
    let label = |power: i32| match power {
        -3..=4 => format!("{}", 10_f64.powi(power)),
        _ => format!("1e{power}"),
    };
    (first..=last).step_by(step).map(|power| (f64::from(power), label(power))).collect()
}

/// Map of a measure's median over the axes `x` and `y`.
fn map(plan: &Plan, runs: &Runs, figures: &[f64], x: usize, y: usize, measure: Measure) -> Chart {
    let (unit, per_unit) = measure.unit();
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
    let finite = medians.iter().copied().filter(|median| median.is_finite());
    let (low, most) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), m| (l.min(m), h.max(m)));
    let (across, up) = (edges(plan, x), edges(plan, y));
    let cell = |(k, median): (usize, &f64)| {
        let value = if median.is_finite() { *median } else { f64::NAN };
        Cell { x: across[k / high], y: up[k % high], value }
    };
    let range = if low < most { (low, most) } else { (most - 1.0, most) };
    let cells = Cells {
        unit: format!("{} ({unit})", measure.short()),
        range: if range.0.is_finite() { range } else { (0.0, 1.0) },
        cells: medians.iter().enumerate().map(cell).collect(),
    };
    let chart = Chart::new("", &plan.axes()[x].name, &plan.axes()[y].name).with_cells(cells);
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
fn level_ticks(plan: &Plan, axis: usize) -> Vec<(f64, String)> {
    (0..level_count(plan, axis)).map(|k| (k as f64, level_label(plan, axis, k).0)).collect()
}

/// Ratio of a measure to an axis's first level, for each other level: median and range, logarithmic.
fn ratios(summary: &Summary, axis: &str, measure: Measure) -> Option<Figure> {
    let lines: Vec<&LevelSummary> =
        summary.of_axis(axis, None, measure).skip(1).filter(|line| line.against_first.is_some()).collect();
    let count = lines.len() as f64;
    let height = |index: usize| count - 1.0 - index as f64;
    let (mut ranges, mut similar, mut different) = (Vec::new(), Vec::new(), Vec::new());
    for (index, line) in lines.iter().enumerate() {
        let (y, against) = (height(index), line.against_first?);
        ranges.extend([(against.least.log10(), y), (against.greatest.log10(), y), (f64::NAN, f64::NAN)]);
        if against.is_significant() { &mut different } else { &mut similar }.push((against.ratio.log10(), y));
    }
    if lines.is_empty() {
        return None;
    }
    let named = |(index, line): (usize, &&LevelSummary)| {
        let lost = if line.lost > 0 { format!(" ({} lost)", line.lost) } else { String::new() };
        (height(index), format!("{}{lost}", line.level))
    };
    let title = format!("{}, ratio to the first of {axis}", measure.short());
    let chart = Chart::new(&title, "Ratio (median, minimum and maximum of all runs)", "")
        .with_y_ticks(lines.iter().enumerate().map(named).collect())
        .with_x_ticks(RATIO_TICKS.map(|ratio| (ratio.log10(), ratio.to_string())).to_vec())
        .with(Series::line("", Colour::Truth, vec![(0.0, -0.5), (0.0, count - 0.5)]).marked(Mark::Dashes(1.0)))
        .with(Series::line("range", Colour::Backdrop, ranges).marked(Mark::Line(4.0)))
        .with(Series::dots("not significant", Colour::Estimate, similar).marked(Mark::Dots(6.0)))
        .with(Series::dots("significant", Colour::Second, different).marked(Mark::Dots(6.0)));
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 76.0 + ROW_HEIGHT * count;
    Some(figure)
}
