//! Plots of a sweep; here the ratios and the Pareto front.

use super::effects::{ROW_HEIGHT, effects, room_for_rows};
use super::pareto::pareto_set;
use super::runs::Runs;
use super::summary::{LevelSummary, Summary};
use super::{Measure, Sweep};
use crate::StudyError;
use zsim_base::files::FileError;
use zsim_base::files::subfolder;
use zsim_base::files::write_text;
use zsim_report::plot::{Chart, Colour, Figure, Mark, Series, Tick, robust_range};
use zsim_report::{Plot, Table, quantity_name};

/// Ticks of the logarithmic ratio axis.
const RATIO_TICKS: [f64; 15] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.7, 1.0, 1.4, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Maximum number of dots in a plot; more are subsampled evenly to limit the size of the SVG.
const MAX_DOTS: usize = 5_000;

/// Plots above this total size have no picture on the page, bytes: it stays below 12 MB.
const MAX_PLOTS_BYTES: usize = 8_000_000;

/// The Pareto front of the runs.
pub(super) struct Front {
    /// Figures of each goal, one per run.
    columns: Vec<Vec<f64>>,
    /// Rows of the runs within all limits.
    rows: Vec<usize>,
    /// Rows of the front, by the first goal.
    pub optimal: Vec<usize>,
}

impl Sweep {
    /// Draws all plots to `plots/`, and writes the Pareto front to `front.csv`; returns the plots.
    ///
    /// # Errors
    /// If the table is not merged, or if a file cannot be written.
    pub(super) fn draw(&self, summary: &Summary) -> Result<Vec<Plot>, StudyError> {
        let folder = subfolder(&self.folder, "plots").map_err(FileError::at(&self.folder))?;
        let runs = Runs::read(self)?;
        let (mut plots, mut bytes) = (Vec::new(), 0);
        let mut save = |file: String, name: String, figure: Figure| -> Result<(), StudyError> {
            let svg = figure.save(&folder, &file)?;
            bytes += svg.len();
            let svg = if bytes <= MAX_PLOTS_BYTES { svg } else { String::new() };
            plots.push(Plot { name, address: format!("plots/{file}.svg"), svg });
            Ok(())
        };
        if let Some(front) = self.front(&runs)? {
            self.write_front(&runs, &front)?;
            save("front".to_owned(), "Pareto front".to_owned(), self.front_figure(&front))?;
        }
        for measure in &summary.measures {
            let (key, quantity) = (measure.key(), measure.quantity());
            save(format!("effects_{key}"), format!("{quantity} by axis"), effects(&self.plan, summary, *measure))?;
            if let Some(figure) = self.maps(&runs, *measure)? {
                save(format!("maps_{key}"), format!("{quantity} by two axes"), figure)?;
            }
        }
        for axis in self.plan.axes().iter().filter(|axis| !axis.is_number()) {
            if let Some(figure) = summary.measures.first().and_then(|measure| ratios(summary, &axis.name, *measure)) {
                // The name of an axis may contain the separator of a path.
                let name = format!("ratios_{}", axis.name.replace(['/', '\\'], "_"));
                save(name, format!("Ratios by {}", quantity_name(&axis.name)), figure)?;
            }
        }
        Ok(plots)
    }

    /// The Pareto front of the spec's goals; `None` with fewer than two goals.
    ///
    /// # Errors
    /// If the table is not merged.
    pub(super) fn front(&self, runs: &Runs) -> Result<Option<Front>, StudyError> {
        let goals = &self.plan.spec().front;
        if goals.len() < 2 {
            return Ok(None);
        }
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
        let optimal = pareto_set(&costs).into_iter().map(|k| rows[k]).collect();
        Ok(Some(Front { columns, rows, optimal }))
    }

    /// The plot of the front over the first two goals.
    fn front_figure(&self, front: &Front) -> Figure {
        let goals = &self.plan.spec().front;
        let (x, y) = (goals[0].measure, goals[1].measure);
        let at = |row: &usize| {
            let shown = |measure: Measure, k: usize| front.columns[k][*row] * measure.unit().1;
            (shown(x, 0), shown(y, 1))
        };
        let all: Vec<(f64, f64)> = front.rows.iter().map(at).collect();
        let optimal: Vec<(f64, f64)> = front.optimal.iter().map(at).collect();
        front_figure((x, y), &all, &optimal)
    }

    fn write_front(&self, runs: &Runs, front: &Front) -> Result<(), StudyError> {
        let goals = &self.plan.spec().front;
        let axes = self.plan.axes().iter().map(|axis| axis.name.as_str());
        let header = ["point"].into_iter().chain(axes).chain(goals.iter().map(|goal| goal.measure.key()));
        let row = |row: &usize| {
            let number = runs.numbers[*row];
            let settings = self.plan.settings(number).into_iter().map(|setting| setting.to_string());
            let figures = front.columns.iter().map(|column| column[*row].to_string());
            std::iter::once(number.to_string()).chain(settings).chain(figures).collect()
        };
        let table = Table::new(header, front.optimal.iter().map(row));
        Ok(write_text(&self.temporary(), &self.folder.join("front.csv"), &table.csv())?)
    }
}

/// The front in front of all runs, as far as the runs are near the others or the front.
fn front_figure((x, y): (Measure, Measure), all: &[(f64, f64)], front: &[(f64, f64)]) -> Figure {
    let shown_range = |coordinate: fn(&(f64, f64)) -> f64| {
        let robust = robust_range(all.iter().map(coordinate)).unwrap_or((0.0, 1.0));
        front.iter().map(coordinate).fold(robust, |(low, high), value| (low.min(value), high.max(value)))
    };
    let ((left, right), (low, high)) = (shown_range(|at| at.0), shown_range(|at| at.1));
    let is_near = |at: &&(f64, f64)| (left..=right).contains(&at.0) && (low..=high).contains(&at.1);
    let near: Vec<(f64, f64)> = all.iter().filter(is_near).copied().collect();
    let name = match all.len() - near.len() {
        0 => "runs".to_owned(),
        far => format!("runs ({far} are outside the axes)"),
    };
    let every = near.len().div_ceil(MAX_DOTS).max(1);
    let chart = Chart::new("Pareto front", &x.label(), &y.label())
        .with(Series::dots(&name, Colour::Backdrop, near.into_iter().step_by(every).collect()).marked(Mark::Dots(2.0)))
        .with(Series::dots("front", Colour::Estimate, front.to_vec()).marked(Mark::Dots(4.5)));
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 420.0;
    figure
}

/// Ratio of a measure to an axis's first level, for each other level: median and range, logarithmic.
fn ratios(summary: &Summary, axis: &str, measure: Measure) -> Option<Figure> {
    let lines: Vec<&LevelSummary> =
        summary.of_axis(axis, None, measure).skip(1).filter(|line| line.against_first.is_some()).collect();
    let count = lines.len() as f64;
    let height = |index: usize| count - 1.0 - index as f64;
    let ratios =
        lines.iter().filter_map(|line| line.against_first).flat_map(|against| [against.least, against.greatest]);
    let ratios = ratios.map(f64::log10).filter(|logarithm| logarithm.is_finite());
    let ends = ratios.fold((0.0, 0.0), |(low, high), ratio| (ratio.min(low), ratio.max(high)));
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
        Tick { at: height(index), label: format!("{}{lost}", line.level) }
    };
    let title = format!("{}: ratio to the first {}", measure.quantity(), quantity_name(axis));
    let chart = Chart::new(&title, "Ratio (median, minimum and maximum of all runs)", "")
        .with_y_ticks(lines.iter().enumerate().map(named).collect())
        .with_x_ticks(RATIO_TICKS.map(|ratio| Tick { at: ratio.log10(), label: ratio.to_string() }).to_vec())
        .with(Series::line("", Colour::Truth, vec![(0.0, -0.5), (0.0, count - 0.5)]).marked(Mark::Dashes(1.0)))
        .with(room_for_rows(ends, lines.len()))
        .with(Series::line("range", Colour::Backdrop, ranges).marked(Mark::Line(4.0)))
        .with(Series::dots("not significant", Colour::Estimate, similar).marked(Mark::Dots(6.0)))
        .with(Series::dots("significant", Colour::Second, different).marked(Mark::Dots(6.0)));
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 76.0 + ROW_HEIGHT * count;
    Some(figure)
}
