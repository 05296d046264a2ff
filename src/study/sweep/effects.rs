//! Plots of the effect of each axis of a sweep.

use super::summary::{LevelSummary, Summary};
use super::{Measure, Plan};
use zsim_report::plot::{BandPoint, Chart, Colour, Figure, Mark, Series, Tick};
use zsim_report::{axis_label, quantity_name};

/// Height of a level's row, points: fits a line of text.
pub(super) const ROW_HEIGHT: f64 = 17.0;
/// A measure whose largest value is more than this multiple of the smallest has a logarithmic axis.
const LOGARITHMIC_RANGE: f64 = 20.0;

/// Effect of each axis over all other settings: median and interquartile band.
pub(super) fn effects(plan: &Plan, summary: &Summary, measure: Measure) -> Figure {
    let charts = plan.axes().iter().map(|axis| {
        let lines: Vec<&LevelSummary> = summary.of_axis(&axis.name, None, measure).collect();
        if axis.is_number() { curve(&axis.name, measure, &lines) } else { rows(&axis.name, measure, &lines) }
    });
    let charts: Vec<Chart> = charts.collect();
    let most_levels = summary.measures.first().map_or(0, |first| {
        let text_axes = plan.axes().iter().filter(|axis| !axis.is_number());
        text_axes.map(|axis| summary.of_axis(&axis.name, None, *first).count()).max().unwrap_or_default()
    });
    let columns = charts.len().min(2);
    let mut figure = Figure::of(charts).in_columns(columns);
    figure.chart_height = figure.chart_height.max(76.0 + ROW_HEIGHT * most_levels as f64);
    figure
}

/// Medians of numeric levels as a curve, with the band of the quartiles.
fn curve(axis: &str, measure: Measure, lines: &[&LevelSummary]) -> Chart {
    let scale = MeasureScale::of(measure, lines);
    let level = |line: &LevelSummary| line.value.unwrap_or(f64::NAN);
    let medians = lines.iter().map(|line| (level(line), scale.at(line.median))).collect();
    let quartiles = |line: &&LevelSummary| BandPoint {
        x: level(line),
        low: scale.at(line.quarter),
        high: scale.at(line.three_quarters),
    };
    let band = lines.iter().map(quartiles).filter(|at| at.low.is_finite() && at.high.is_finite()).collect();
    Chart::new("", &axis_label(axis), &measure.label())
        .with(Series::line("", Colour::Estimate, medians).with_band(band))
        .with_y_ticks(scale.ticks())
}

/// Median and quartiles of text levels in rows: such levels have no order for a curve.
fn rows(axis: &str, measure: Measure, lines: &[&LevelSummary]) -> Chart {
    let scale = MeasureScale::of(measure, lines);
    let height = |index: usize| lines.len() as f64 - 1.0 - index as f64;
    let bars = lines.iter().enumerate().flat_map(|(k, line)| {
        let ends = [line.quarter, line.three_quarters].map(|x| (scale.at(x), height(k)));
        [ends[0], ends[1], (f64::NAN, f64::NAN)]
    });
    let dots = lines.iter().enumerate().map(|(k, line)| (scale.at(line.median), height(k)));
    let ticks = lines.iter().enumerate().map(|(k, line)| Tick { at: height(k), label: line.level.clone() });
    let room = room_for_rows(scale.ends(), lines.len());
    Chart::new(&format!("By {}", quantity_name(axis)), &measure.label(), "")
        .with(room)
        .with(Series::line("", Colour::Backdrop, bars.collect()).marked(Mark::Line(4.0)))
        .with(Series::dots("", Colour::Estimate, dots.collect()).marked(Mark::Dots(6.0)))
        .with_y_ticks(ticks.collect())
        .with_x_ticks(scale.ticks())
}

/// An invisible series that extends the axes of `count` rows by half a row, and their range by 3 % on both sides, so that
/// no mark is cut.
pub(super) fn room_for_rows((low, high): (f64, f64), count: usize) -> Series {
    let margin = 0.03 * (high - low);
    let corners = vec![(low - margin, -0.5), (f64::NAN, f64::NAN), (high + margin, count as f64 - 0.5)];
    Series::line("", Colour::Backdrop, corners)
}

/// The axis of a measure: in display units, logarithmic if the values differ by a large factor.
struct MeasureScale {
    per_unit: f64,
    /// Smallest and largest value in display units; `None` without finite values.
    range: Option<(f64, f64)>,
}

impl MeasureScale {
    fn of(measure: Measure, lines: &[&LevelSummary]) -> Self {
        let (_, per_unit) = measure.unit();
        let values = lines.iter().flat_map(|line| [line.quarter, line.median, line.three_quarters]);
        let range = values.map(|x| x * per_unit).filter(|x| x.is_finite()).fold(None, |range, x| match range {
            None => Some((x, x)),
            Some((low, high)) => Some((x.min(low), x.max(high))),
        });
        Self { per_unit, range }
    }

    /// The range if the axis is logarithmic.
    fn logarithmic(&self) -> Option<(f64, f64)> {
        self.range.filter(|(low, high)| *low > 0.0 && *high > LOGARITHMIC_RANGE * low)
    }

    /// Position of a value on the axis.
    fn at(&self, value: f64) -> f64 {
        let shown = value * self.per_unit;
        if self.logarithmic().is_some() { shown.log10() } else { shown }
    }

    /// Ends of the range on the axis.
    fn ends(&self) -> (f64, f64) {
        self.range.map_or((0.0, 0.0), |(low, high)| (self.at(low / self.per_unit), self.at(high / self.per_unit)))
    }

    /// Ticks of a logarithmic axis; none for a linear one, whose ticks are at round numbers.
    fn ticks(&self) -> Vec<Tick> {
        self.logarithmic().map_or_else(Vec::new, |(low, high)| logarithmic_ticks(low, high))
    }
}

/// Ticks at the powers of ten around the range: with their multiples by 2 and 5 if they are few, or only every second or
/// third power if they are many.
fn logarithmic_ticks(low: f64, high: f64) -> Vec<Tick> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let multiples: &[u8] = if last - first <= 3 { &[1, 2, 5] } else { &[1] };
    let step = (1 + (last - first) / 5) as usize;
    let label = |multiple: u8, power: i32| match power {
        0..=4 => format!("{}", u32::from(multiple) * 10_u32.pow(power as u32)),
        -3..=-1 => format!("{:.*}", -power as usize, f64::from(multiple) * 10_f64.powi(power)),
        _ => format!("{multiple}e{power}"),
    };
    let powers = (first..=last).step_by(step);
    powers
        .flat_map(|power| multiples.iter().map(move |multiple| (*multiple, power)))
        .map(|(multiple, power)| Tick {
            at: (f64::from(multiple) * 10_f64.powi(power)).log10(),
            label: label(multiple, power),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_ticks_are_round_numbers_without_an_exponent_near_one() {
        let labels = |low, high| logarithmic_ticks(low, high).into_iter().map(|tick| tick.label).collect::<Vec<_>>();
        assert_eq!(labels(0.03, 2.0), ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50"]);
        assert_eq!(labels(2e3, 9e9), ["1000", "1e5", "1e7", "1e9"]);
    }
}
