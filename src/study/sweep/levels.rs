//! Tables of a summary for the document of a study, and as CSV.

use super::axis::Axis;
use super::design::AxisSize;
use super::summary::{LevelSummary, SIGNIFICANCE_LEVEL, Summary};
use super::{Measure, Plan, Trend};
use zsim_report::{Document, Table, quantity_name};

/// Axes with more levels are omitted for readability; `summary.csv` has all levels.
const MAX_LEVELS_SHOWN: usize = 60;

/// The content of `summary.csv`: one row per [`LevelSummary`].
pub(super) fn csv(summary: &Summary) -> String {
    let row = |line: &LevelSummary| {
        let words = [&line.axis, &line.level, line.within.as_deref().unwrap_or("all"), line.measure.key()];
        let against = line.against_first.map(|a| [a.ratio, a.least, a.greatest, a.p, a.corrected_p]);
        let statistics = [line.median, line.quarter, line.three_quarters, line.greatest];
        let counts = [line.runs, line.lost].map(|count| count.to_string());
        let numbers = statistics.into_iter().chain(against.unwrap_or([f64::NAN; 5])).map(cell);
        words.map(str::to_owned).into_iter().chain(counts).chain(numbers).collect()
    };
    let header = "axis,level,within,measure,runs,lost,median,quarter,three_quarters,greatest,ratio,least_ratio,\
                  greatest_ratio,p,corrected_p";
    Table::new(header.split(','), summary.lines.iter().map(row)).csv()
}

/// The content of `trends.csv`: one row per [`Trend`](super::Trend).
pub(super) fn trends_csv(summary: &Summary) -> String {
    let row = |trend: &Trend| {
        let numbers = [trend.correlation, trend.p, trend.corrected_p].map(|x| x.to_string());
        [&[trend.axis.clone(), trend.measure.key().to_owned()][..], &numbers].concat()
    };
    Table::new(["axis", "measure", "rank_correlation", "p", "corrected_p"], summary.trends.iter().map(row)).csv()
}

fn cell(number: f64) -> String {
    if number.is_nan() { String::new() } else { number.to_string() }
}

/// Measures per table on the terminal, each with its ratio; more are too wide.
const MEASURES_PER_TABLE: usize = 3;

/// Adds the tables of every axis over all runs, and as details those at each level of the axis `by`.
pub(super) fn add_tables(document: &mut Document, summary: &Summary, plan: &Plan) {
    if !summary.trends.is_empty() {
        document.heading("Rank correlation of each measure with each axis");
        document.add(trend_table(summary));
    } else {
        let is_shown = |axis: &&Axis| {
            matches!(axis.size(), AxisSize::Levels(1..=MAX_LEVELS_SHOWN) | AxisSize::Weighted(1..=MAX_LEVELS_SHOWN, _))
        };
        for axis in plan.axes().iter().filter(is_shown) {
            document.heading(format!("By {}, over all runs", quantity_name(&axis.name)));
            document.add(level_table(summary, &axis.name, None));
        }
    }
    document.add(legend(summary));
    let by = plan.spec().by.as_ref();
    let mut levels: Vec<&str> = Vec::new();
    for level in summary.lines.iter().filter_map(|line| line.within.as_deref()) {
        if !levels.contains(&level) {
            levels.push(level);
        }
    }
    for (by, axis) in summary.axes.iter().filter(|axis| Some(*axis) != by).filter_map(|axis| Some((by?, axis))) {
        for level in &levels {
            document.heading(format!("By {}, {} {level}", quantity_name(axis), quantity_name(by)));
            document.add_detail(level_table(summary, axis, Some(level)));
        }
    }
}

/// Rank correlations, axes by measures.
fn trend_table(summary: &Summary) -> Table {
    let cell = |axis: &String, measure: &Measure| {
        let trend = summary.trends.iter().find(|trend| trend.axis == *axis && trend.measure == *measure);
        trend.map_or_else(String::new, |trend| {
            format!("{:.2}{}", trend.correlation, if trend.is_significant() { "*" } else { "" })
        })
    };
    let row = |axis: &String| {
        std::iter::once(quantity_name(axis)).chain(summary.measures.iter().map(|measure| cell(axis, measure))).collect()
    };
    let header = ["axis"].into_iter().chain(summary.measures.iter().map(|measure| measure.short()));
    Table::new(header, summary.axes.iter().map(row))
}

/// Levels of an axis by measures: median, quartiles, and the ratio to the first level; over all runs or `within` a level.
fn level_table(summary: &Summary, axis: &str, within: Option<&str>) -> Table {
    let of_measure = |measure: &Measure| [heading(*measure), "quartiles".to_owned(), "ratio".to_owned()];
    let header = [quantity_name(axis)].into_iter().chain(summary.measures.iter().flat_map(of_measure));
    let row = |line: &LevelSummary| {
        let cells = |measure: &Measure| {
            summary.line(axis, &line.level, within, *measure).map_or_else(Default::default, figures)
        };
        [line.level.clone()].into_iter().chain(summary.measures.iter().flat_map(cells)).collect()
    };
    let levels = summary.measures.first().into_iter().flat_map(|first| summary.of_axis(axis, within, *first));
    Table {
        details: (0..summary.measures.len()).map(|k| 3 * k + 2).collect(),
        columns_at_once: 2 * MEASURES_PER_TABLE,
        ..Table::new(header, levels.map(row))
    }
}

/// Heading of a column: the measure and its unit, if it has one.
pub(super) fn heading(measure: Measure) -> String {
    match measure.unit().0 {
        "1" => measure.short().to_owned(),
        unit => format!("{} {unit}", measure.short()),
    }
}

/// Median, quartiles if they differ, and ratio, in display units.
fn figures(line: &LevelSummary) -> [String; 3] {
    let (_, per_unit) = line.measure.unit();
    let [median, low, high] = [line.median, line.quarter, line.three_quarters].map(|x| digits(x * per_unit));
    let ratio = line.against_first.map_or_else(String::new, |against| {
        format!("{}{}", digits(against.ratio), if against.is_significant() { "*" } else { "" })
    });
    [median, if low == high { String::new() } else { format!("{low}..{high}") }, ratio]
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

/// Explains the figures of the tables.
fn legend(summary: &Summary) -> String {
    if !summary.trends.is_empty() {
        return format!(
            "Spearman's rank correlation, from -1 (falling) to 1 (rising). * p < {SIGNIFICANCE_LEVEL}, Holm-corrected over all axes."
        );
    }
    format!(
        "Medians; with quartiles on the page and in study.md. Ratio: median over pairs of runs that differ only in this \
         axis, to its first level. * p < {SIGNIFICANCE_LEVEL} in a two-sided Wilcoxon signed-rank test of the log ratios, Holm-corrected over all levels."
    )
}
