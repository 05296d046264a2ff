//! Tables of a summary for the terminal, Markdown and CSV.

use super::axis::Axis;
use super::design::AxisSize;
use super::summary::{LevelSummary, SIGNIFICANCE_LEVEL, Summary};
use super::table::quoted;
use super::{Measure, Plan};
use std::fmt::Write;
use zsim_report::page::PageTable;

/// Axes with more levels are omitted from text and Markdown for readability; `summary.csv` has all levels.
const MAX_LEVELS_SHOWN: usize = 60;

/// CSV with one row per [`LevelSummary`].
pub(super) fn csv(summary: &Summary) -> String {
    let mut text = "axis,level,within,measure,runs,lost,median,quarter,three_quarters,greatest,ratio,least_ratio,\
                    greatest_ratio,p,corrected_p\n"
        .to_owned();
    for line in &summary.lines {
        let within = line.within.as_deref().unwrap_or("all");
        let words = [&line.axis, &line.level, within, line.measure.key()].map(quoted).join(",");
        // Writing to a string does not fail.
        let _ = write!(text, "{words},{},{}", line.runs, line.lost);
        for number in [line.median, line.quarter, line.three_quarters, line.greatest] {
            let _ = write!(text, ",{}", cell(number));
        }
        let against = line.against_first.map(|a| [a.ratio, a.least, a.greatest, a.p, a.corrected_p]);
        for number in against.unwrap_or([f64::NAN; 5]) {
            let _ = write!(text, ",{}", cell(number));
        }
        text.push('\n');
    }
    text
}

/// CSV with one row per [`Trend`](super::Trend).
pub(super) fn trends_csv(summary: &Summary) -> String {
    let mut text = "axis,measure,rank_correlation,p,corrected_p\n".to_owned();
    for trend in &summary.trends {
        let words = [&trend.axis, trend.measure.key()].map(quoted).join(",");
        let _ = writeln!(text, "{words},{},{},{}", trend.correlation, trend.p, trend.corrected_p);
    }
    text
}

fn cell(number: f64) -> String {
    if number.is_nan() { String::new() } else { number.to_string() }
}

/// Tables for the terminal: every axis over all runs.
pub(super) fn text(summary: &Summary, plan: &Plan) -> String {
    tables(summary, plan, false).iter().map(PageTable::text).collect::<String>()
        + &zsim_report::wrapped(&legend(summary, "Medians; quartiles are in study.md."), "")
}

/// The tables as Markdown, and again at each level of the axis `by`.
pub(super) fn markdown(summary: &Summary, plan: &Plan, status: &super::SweepStatus) -> String {
    let mut text = format!(
        "# {}\n\nWritten by zsim {}: {} runs, {} of them failed, {} missing.\n",
        plan.name(),
        env!("CARGO_PKG_VERSION"),
        status.points,
        status.failed,
        status.missing
    );
    let mut all = tables(summary, plan, true);
    if let Some(by) = &plan.spec().by {
        let mut levels: Vec<&String> = summary.lines.iter().filter_map(|line| line.within.as_ref()).collect();
        levels.dedup();
        let mut distinct: Vec<&String> = Vec::new();
        levels.into_iter().for_each(|level| {
            if !distinct.contains(&level) {
                distinct.push(level);
            }
        });
        for axis in summary.axes.iter().filter(|axis| *axis != by) {
            all.extend(
                distinct.iter().map(|level| level_table(summary, axis, Some((by, level)), &summary.measures, true)),
            );
        }
    }
    text += &all.iter().map(PageTable::markdown).collect::<String>();
    format!("{text}\n{}\n", legend(summary, "Medians (quartiles)."))
}

/// Measures per table on the terminal, each with its ratio; more are too wide.
const MEASURES_PER_TABLE: usize = 3;

pub(super) fn tables(summary: &Summary, plan: &Plan, bands: bool) -> Vec<PageTable> {
    if !summary.trends.is_empty() {
        return vec![trend_table(summary)];
    }
    let is_shown = |axis: &&Axis| {
        matches!(axis.size(), AxisSize::Levels(1..=MAX_LEVELS_SHOWN) | AxisSize::Weighted(1..=MAX_LEVELS_SHOWN, _))
    };
    let axes = plan.axes().iter().filter(is_shown);
    let across = if bands { summary.measures.len().max(1) } else { MEASURES_PER_TABLE };
    let axis_tables = |axis: &Axis| {
        summary.measures.chunks(across).map(|some| level_table(summary, &axis.name, None, some, bands)).collect()
    };
    axes.flat_map(|axis: &Axis| -> Vec<PageTable> { axis_tables(axis) }).collect()
}

/// Rank correlations, axes by measures.
fn trend_table(summary: &Summary) -> PageTable {
    let mut header = vec!["axis".to_owned()];
    header.extend(summary.measures.iter().map(|measure| measure.short().to_owned()));
    let cell = |axis: &String, measure: &Measure| {
        let trend = summary.trends.iter().find(|trend| trend.axis == *axis && trend.measure == *measure);
        trend.map_or_else(String::new, |trend| {
            format!("{:.2}{}", trend.correlation, if trend.is_significant() { "*" } else { "" })
        })
    };
    let row = |axis: &String| {
        std::iter::once(zsim_report::quantity_name(axis))
            .chain(summary.measures.iter().map(|measure| cell(axis, measure)))
            .collect()
    };
    PageTable {
        title: "Rank correlation of each measure with each axis".to_owned(),
        header,
        rows: summary.axes.iter().map(row).collect(),
        ..PageTable::default()
    }
}

/// Levels of an axis by measures: median, with `bands` also quartiles, and the ratio to the first level.
fn level_table(
    summary: &Summary,
    axis: &str,
    within: Option<(&str, &str)>,
    measures: &[Measure],
    bands: bool,
) -> PageTable {
    let mut header = vec![zsim_report::quantity_name(axis)];
    for measure in measures {
        header.extend([heading(*measure), "ratio".to_owned()]);
    }
    let within_level = within.map(|(_, level)| level);
    let Some(first) = measures.first() else { return PageTable { header, ..PageTable::default() } };
    let row = |line: &LevelSummary| {
        let mut cells = vec![line.level.clone()];
        for measure in measures {
            match summary.line(axis, &line.level, within_level, *measure) {
                Some(line) => cells.extend([figures(line, bands), ratio(line)]),
                None => cells.extend([String::new(), String::new()]),
            }
        }
        cells
    };
    let rows = summary.of_axis(axis, within_level, *first).map(row).collect();
    let place = within.map_or_else(
        || "over all runs".to_owned(),
        |(by, level)| format!("{} {level}", zsim_report::quantity_name(by)),
    );
    let title = format!("By {}, {place}", zsim_report::quantity_name(axis));
    PageTable { title, header, rows, ..PageTable::default() }
}

/// Heading of a column: the measure and its unit, if it has one.
pub(super) fn heading(measure: Measure) -> String {
    match measure.unit().0 {
        "1" => measure.short().to_owned(),
        unit => format!("{} {unit}", measure.short()),
    }
}

/// Median, with `bands` also quartiles, in display units.
fn figures(line: &LevelSummary, bands: bool) -> String {
    let (_, per_unit) = line.measure.unit();
    let [median, low, high] = [line.median, line.quarter, line.three_quarters].map(|x| digits(x * per_unit));
    if low == high || !bands { median } else { format!("{median} ({low}..{high})") }
}

fn ratio(line: &LevelSummary) -> String {
    let Some(against) = line.against_first else { return String::new() };
    format!("{}{}", digits(against.ratio), if against.is_significant() { "*" } else { "" })
}

/// A number with about three significant digits.
pub(super) fn digits(x: f64) -> String {
    // What would be -0.0000 is 0.
    let x = if x.abs() < 0.000_05 { 0.0 } else { x };
    match x.abs() {
        size if size.is_nan() => "-".to_owned(),
        size if size.is_infinite() => "lost".to_owned(),
        size if size >= 100.0 => format!("{x:.0}"),
        size if size >= 10.0 => format!("{x:.1}"),
        size if size >= 0.1 || size == 0.0 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}

/// Explains the figures of the tables; `medians` describes the cells of a table of levels.
pub(super) fn legend(summary: &Summary, medians: &str) -> String {
    if !summary.trends.is_empty() {
        return format!(
            "Spearman's rank correlation, from -1 (falling) to 1 (rising). * p < {SIGNIFICANCE_LEVEL}, Holm-corrected over all axes."
        );
    }
    format!(
        "{medians} Ratio: median over pairs of runs that differ only in this axis, to its first level. * p < \
         {SIGNIFICANCE_LEVEL} in a two-sided Wilcoxon signed-rank test of the log ratios, Holm-corrected over all levels."
    )
}
