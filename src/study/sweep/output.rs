//! A summary as tables: terminal, Markdown, CSV.

use super::axis::Axis;
use super::design::Extent;
use super::summary::{Line, SIGNIFICANT, Summary};
use super::table::quoted;
use super::{Measure, Plan};
use crate::report;
use std::fmt::Write;

/// Most levels of an axis whose lines are shown to people; `summary.csv` has all.
const SHOWN: usize = 60;

/// A line of numbers for each line of the summary.
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

/// A line for each trend.
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
pub(super) fn words(summary: &Summary, plan: &Plan) -> String {
    let tables = tables(summary, plan, false).into_iter().map(|(title, header, rows)| {
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        format!("{title}\n{}\n", report::table(&header, &rows, true))
    });
    tables.collect::<String>() + &legend(summary) + "\n"
}

/// The same as Markdown, and separately at each level of the axis by which all is told.
pub(super) fn markdown(summary: &Summary, plan: &Plan, status: &super::Status) -> String {
    let mut text = format!(
        "# {}\n\nMade by `zsim study {}`, version {}: {} runs, {} of them failed, {} missing.\n",
        plan.name(),
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
        let mut told: Vec<&String> = Vec::new();
        levels.into_iter().for_each(|level| {
            if !told.contains(&level) {
                told.push(level);
            }
        });
        for axis in summary.axes.iter().filter(|axis| *axis != by) {
            all.extend(told.iter().map(|level| level_table(summary, axis, Some((by, level)), &summary.measures, true)));
        }
    }
    for (title, header, rows) in all {
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        text += &format!("\n{title}\n\n{}", report::markdown(&header, &rows));
    }
    format!("{text}\n{}\n", legend(summary))
}

/// So many measures, each with its ratio, stand side by side in a terminal.
const ACROSS: usize = 3;

type TableOfWords = (String, Vec<String>, Vec<Vec<String>>);

fn tables(summary: &Summary, plan: &Plan, bands: bool) -> Vec<TableOfWords> {
    if !summary.trends.is_empty() {
        return vec![trend_table(summary)];
    }
    let is_shown = |axis: &&Axis| matches!(axis.extent(), Extent::Levels(1..=SHOWN) | Extent::Weighted(1..=SHOWN, _));
    let axes = plan.axes().iter().filter(is_shown);
    let across = if bands { summary.measures.len().max(1) } else { ACROSS };
    let of_axis = |axis: &Axis| {
        summary.measures.chunks(across).map(|some| level_table(summary, &axis.name, None, some, bands)).collect()
    };
    axes.flat_map(|axis: &Axis| -> Vec<TableOfWords> { of_axis(axis) }).collect()
}

/// Axes by measures: rank correlations.
fn trend_table(summary: &Summary) -> TableOfWords {
    let mut header = vec!["axis".to_owned()];
    header.extend(summary.measures.iter().map(|measure| measure.short().to_owned()));
    let cell = |axis: &String, measure: &Measure| {
        let trend = summary.trends.iter().find(|trend| trend.axis == *axis && trend.measure == *measure);
        trend.map_or_else(String::new, |trend| {
            format!("{:.2}{}", trend.correlation, if trend.is_significant() { "*" } else { "" })
        })
    };
    let row = |axis: &String| {
        std::iter::once(axis.clone()).chain(summary.measures.iter().map(|measure| cell(axis, measure))).collect()
    };
    ("Rank correlation of each measure with each axis".to_owned(), header, summary.axes.iter().map(row).collect())
}

/// Levels by some of the measures: median, with `bands` the quartiles too, and the ratio to the first level.
fn level_table(
    summary: &Summary,
    axis: &str,
    within: Option<(&str, &str)>,
    measures: &[Measure],
    bands: bool,
) -> TableOfWords {
    let mut header = vec![axis.to_owned()];
    for measure in measures {
        header.extend([format!("{} {}", measure.short(), measure.unit().0), "ratio".to_owned()]);
    }
    let level_of = within.map(|(_, level)| level);
    let Some(first) = measures.first() else { return (String::new(), header, Vec::new()) };
    let row = |line: &Line| {
        let mut cells = vec![line.level.clone()];
        for measure in measures {
            match summary.line(axis, &line.level, level_of, *measure) {
                Some(line) => cells.extend([figures(line, bands), ratio(line)]),
                None => cells.extend([String::new(), String::new()]),
            }
        }
        cells
    };
    let rows = summary.of_axis(axis, level_of, *first).map(row).collect();
    let place = within.map_or_else(|| "over all runs".to_owned(), |(by, level)| format!("{by} {level}"));
    (format!("By {axis}, {place}"), header, rows)
}

/// Median, with `bands` the quartiles too, in the unit that people read.
fn figures(line: &Line, bands: bool) -> String {
    let (_, per_unit) = line.measure.unit();
    let [median, low, high] = [line.median, line.quarter, line.three_quarters].map(|x| digits(x * per_unit));
    if low == high || !bands { median } else { format!("{median} ({low}..{high})") }
}

fn ratio(line: &Line) -> String {
    let Some(against) = line.against_first else { return String::new() };
    format!("{}{}", digits(against.ratio), if against.is_significant() { "*" } else { "" })
}

/// Three digits, and no more than a ratio or a millimetre needs.
fn digits(x: f64) -> String {
    match x.abs() {
        size if size.is_nan() => "-".to_owned(),
        size if size.is_infinite() => "lost".to_owned(),
        size if size >= 100.0 => format!("{x:.0}"),
        size if size >= 10.0 => format!("{x:.1}"),
        size if size >= 0.1 || size == 0.0 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}

fn legend(summary: &Summary) -> String {
    if !summary.trends.is_empty() {
        return format!(
            "Spearman's rank correlation, from -1 (falls) to 1 (rises); * p < {SIGNIFICANT}, corrected for all axes by Holm's \
             method."
        );
    }
    format!(
        "Medians, in study.md with quartiles. Ratios are medians over runs that are alike in all else, to the axis's first level. * p < \
         {SIGNIFICANT} by Wilcoxon's signed-rank test of their logarithms, two-sided, corrected for all levels by Holm's method."
    )
}
