//! A comparison as tables (terminal, Markdown, CSV) and as a plot.

use super::{BASE, Line, Measure, Place, SIGNIFICANT, Summary};
use crate::report;
use crate::report::plot::{Chart, Colour, Figure, Mark, Series};
use std::fmt::Write;

/// Height of a variant's row in the plot, points.
const ROW_HEIGHT: f64 = 17.0;
/// Ratios at which the plot's axis has marks.
const MARKS: [f64; 15] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.7, 1.0, 1.4, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// A line of numbers for each variant, place (`all` for all) and measure.
pub fn csv(summary: &Summary) -> String {
    let mut text =
        "variant,scene,motion,measure,runs,lost,median,worst,ratio,least_ratio,greatest_ratio,p,corrected_p\n"
            .to_owned();
    for line in &summary.lines {
        let (scene, motion) = line.place.as_ref().map_or(("all", "all"), |place| (&place.scene, &place.motion));
        // Writing to a string does not fail.
        let _ = write!(text, "{},{scene},{motion},{},{},{}", line.variant, line.measure.key(), line.runs, line.lost);
        let numbers = [line.median, line.worst, line.ratio, line.least_ratio, line.greatest_ratio, line.p];
        for number in numbers.into_iter().chain([line.corrected_p]) {
            let _ = write!(text, ",{number}");
        }
        text.push('\n');
    }
    text
}

/// Tables for the terminal: the base's figures, and every variant's ratios over all runs.
pub fn words(summary: &Summary) -> String {
    let (header, rows) = base_table(summary);
    let base = report::table(&as_str(&header), &rows, true);
    let (header, rows) = ratio_table(summary);
    let ratios = report::table(&as_str(&header), &rows, true);
    format!("{base}\n{ratios}{}\n", legend())
}

/// The same as Markdown, with a table a place.
pub fn markdown(summary: &Summary, command: &str) -> String {
    let runs = summary.lines.iter().find(|line| line.place.is_none()).map_or(0, |line| line.runs);
    let mut text = format!("Made by `{command}`: {runs} runs a variant, version {}.\n\n", env!("CARGO_PKG_VERSION"));
    let (header, rows) = base_table(summary);
    text += &format!("The base, median of the seeds (worst):\n\n{}\n", report::markdown(&as_str(&header), &rows));
    let (header, rows) = ratio_table(summary);
    text +=
        &format!("Every variant, ratios to the base over all runs:\n\n{}\n", report::markdown(&as_str(&header), &rows));
    text += &format!("{}\n", legend());
    for place in &summary.places {
        let (header, rows) = place_table(summary, place);
        let table = report::markdown(&as_str(&header), &rows);
        text += &format!("\n{}, {}: median (worst), ratio to the base\n\n{table}", place.scene, place.motion);
    }
    text
}

fn legend() -> String {
    format!(
        "Ratios are medians over runs of one scene, motion and seed; below 1 is better than the base. \"least\" and \"most\" \
         are the ends of the first measure's. p: Wilcoxon's signed-rank test of its logarithms, two-sided, corrected for all \
         variants by Holm's method. * p < {SIGNIFICANT}."
    )
}

/// Where and how the base does.
fn base_table(summary: &Summary) -> (Vec<String>, Vec<Vec<String>>) {
    let mut header = vec!["scene, motion".to_owned()];
    header.extend(summary.measures.iter().map(|measure| format!("{} {}", measure.short(), measure.unit().0)));
    let row = |place: &Place| {
        let figure = |measure: &Measure| summary.line(BASE, Some(place), *measure).map_or_else(String::new, figures);
        let name = format!("{}, {}", place.scene, place.motion);
        std::iter::once(name).chain(summary.measures.iter().map(figure)).collect()
    };
    (header, summary.places.iter().map(row).collect())
}

/// What the variants change, over all places.
fn ratio_table(summary: &Summary) -> (Vec<String>, Vec<Vec<String>>) {
    let [first, others @ ..] = summary.measures.as_slice() else { return Default::default() };
    let mut header = ["variant", first.short(), "least", "most", "p"].map(str::to_owned).to_vec();
    header.extend(others.iter().map(|measure| measure.short().to_owned()));
    let row = |variant: &String| {
        let line = summary.line(variant, None, *first)?;
        let p = if line.corrected_p < 1e-3 { "<.001".to_owned() } else { format!("{:.3}", line.corrected_p) };
        let mut cells = vec![variant.clone(), starred(line), ratio(line.least_ratio), ratio(line.greatest_ratio), p];
        let other = |measure: &Measure| summary.line(variant, None, *measure).map_or_else(String::new, starred);
        cells.extend(others.iter().map(other));
        Some(cells)
    };
    (header, summary.variants.iter().filter(|variant| *variant != BASE).filter_map(row).collect())
}

fn place_table(summary: &Summary, place: &Place) -> (Vec<String>, Vec<Vec<String>>) {
    let mut header = vec!["variant".to_owned()];
    for measure in &summary.measures {
        header.extend([format!("{} {}", measure.short(), measure.unit().0), "ratio".to_owned()]);
    }
    let row = |variant: &String| {
        let cells = summary.measures.iter().filter_map(|measure| summary.line(variant, Some(place), *measure));
        std::iter::once(variant.clone()).chain(cells.flat_map(|line| [figures(line), starred(line)])).collect()
    };
    (header, summary.variants.iter().map(row).collect())
}

/// Median and worst in the unit that people read.
fn figures(line: &Line) -> String {
    let (_, per_unit) = line.measure.unit();
    format!("{} ({})", digits(line.median * per_unit), digits(line.worst * per_unit))
}

fn starred(line: &Line) -> String {
    let star = if line.is_significant() { "*" } else { "" };
    format!("{}{star}", ratio(line.ratio))
}

fn ratio(ratio: f64) -> String {
    if ratio.is_infinite() { "lost".to_owned() } else { digits(ratio) }
}

/// Three digits, and no more than a ratio or a millimetre needs.
fn digits(x: f64) -> String {
    match x.abs() {
        _ if !x.is_finite() => "lost".to_owned(),
        size if size >= 100.0 => format!("{x:.0}"),
        size if size >= 10.0 => format!("{x:.1}"),
        size if size >= 0.1 || size == 0.0 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}

fn as_str(header: &[String]) -> Vec<&str> {
    header.iter().map(String::as_str).collect()
}

/// The first measure's ratio to the base for each variant, from the least to the greatest of all runs; logarithmic.
pub fn ratio_figure(summary: &Summary) -> Figure {
    let Some(measure) = summary.measures.first() else { return Figure::of(Vec::new()) };
    let lines: Vec<&Line> =
        summary.variants.iter().filter_map(|name| summary.line(name, None, *measure)).skip(1).collect();
    let count = lines.len() as f64;
    let height = |index: usize| count - 1.0 - index as f64;
    let broken = (f64::NAN, f64::NAN);
    let (mut ranges, mut alike, mut differ) = (Vec::new(), Vec::new(), Vec::new());
    for (index, line) in lines.iter().enumerate() {
        let y = height(index);
        ranges.extend([(line.least_ratio.log10(), y), (line.greatest_ratio.log10(), y), broken]);
        if line.is_significant() { &mut differ } else { &mut alike }.push((line.ratio.log10(), y));
    }
    let named = |(index, line): (usize, &&Line)| {
        let lost = if line.lost > 0 { format!(" ({} lost)", line.lost) } else { String::new() };
        (height(index), format!("{}{lost}", line.variant))
    };
    let title = format!("{}, ratio to the base", measure.short());
    let chart = Chart::new(&title, "Ratio to the base (median, least and greatest of all runs)", "")
        .with_y_marks(lines.iter().enumerate().map(named).collect())
        .with_x_marks(MARKS.map(|ratio| (ratio.log10(), ratio.to_string())).to_vec())
        .with(Series::line("", Colour::Truth, vec![(0.0, -0.5), (0.0, count - 0.5)]).marked(Mark::Dashes(1.0)))
        .with(Series::line("range", Colour::Backdrop, ranges).marked(Mark::Line(4.0)))
        .with(Series::dots("alike", Colour::Estimate, alike).marked(Mark::Dots(6.0)))
        .with(Series::dots("different", Colour::Second, differ).marked(Mark::Dots(6.0)));
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 76.0 + ROW_HEIGHT * count;
    figure
}
