//! What the rows of a comparison say together.

use super::{BASE, Measure, Row, holm, signed_rank_p};
use serde::Serialize;

/// A variant differs when what is seen would be rarer than this without a difference.
pub const SIGNIFICANT: f64 = 0.05;

/// A scene and a motion.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The scene's name.
    pub scene: String,
    /// The motion's name.
    pub motion: String,
}

/// What a measure says of a variant, at a place or over all runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// The variant.
    pub variant: String,
    /// The place; `None` for all.
    pub place: Option<Place>,
    /// The measure.
    pub measure: Measure,
    /// How many runs.
    pub runs: usize,
    /// How many of them have no such figure: an estimate that was lost. It counts as infinite below.
    pub lost: usize,
    /// The median figure, in the measure's unit.
    pub median: f64,
    /// The greatest.
    pub worst: f64,
    /// Median of the runs' ratios to the base.
    pub ratio: f64,
    /// The least ratio.
    pub least_ratio: f64,
    /// The greatest ratio.
    pub greatest_ratio: f64,
    /// Level of the signed-rank test that the ratios' logarithms are about zero.
    pub p: f64,
    /// The same, corrected for all variants by Holm's method.
    pub corrected_p: f64,
}

impl Line {
    /// Whether the variant differs from the base.
    pub fn is_significant(&self) -> bool {
        self.corrected_p < SIGNIFICANT
    }
}

/// All lines of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The variants, the base first.
    pub variants: Vec<String>,
    /// The places, in the order of the spec.
    pub places: Vec<Place>,
    /// The measures, the most important first.
    pub measures: Vec<Measure>,
    /// A line each of measure, place (all places first) and variant, in this order.
    pub lines: Vec<Line>,
}

impl Summary {
    /// Sums up `rows` of the base and of `variants`.
    pub fn of(rows: &[Row], variants: &[&str], measures: &[Measure]) -> Self {
        let mut places: Vec<Place> = Vec::new();
        for row in rows {
            let place = Place { scene: row.scene.clone(), motion: row.motion.clone() };
            if !places.contains(&place) {
                places.push(place);
            }
        }
        let variants: Vec<String> = std::iter::once(BASE).chain(variants.iter().copied()).map(str::to_owned).collect();
        let mut lines = Vec::new();
        for measure in measures {
            for place in std::iter::once(None).chain(places.iter().map(Some)) {
                let mut of_place: Vec<Line> =
                    variants.iter().map(|variant| line(rows, variant, place, *measure)).collect();
                let levels: Vec<f64> = of_place.iter().skip(1).map(|line| line.p).collect();
                let corrected = holm(&levels);
                of_place.iter_mut().skip(1).zip(corrected).for_each(|(line, p)| line.corrected_p = p);
                lines.extend(of_place);
            }
        }
        Self { variants, places, measures: measures.to_vec(), lines }
    }

    /// The line of a variant, at a place or over all.
    pub fn line(&self, variant: &str, place: Option<&Place>, measure: Measure) -> Option<&Line> {
        let is_it = |line: &&Line| line.variant == variant && line.place.as_ref() == place && line.measure == measure;
        self.lines.iter().find(is_it)
    }
}

fn line(rows: &[Row], variant: &str, place: Option<&Place>, measure: Measure) -> Line {
    let here = |row: &&Row| place.is_none_or(|place| row.scene == place.scene && row.motion == place.motion);
    let figure = |row: &Row| row.figures.get(&measure).copied().unwrap_or(f64::INFINITY);
    let own: Vec<&Row> = rows.iter().filter(here).filter(|row| row.variant == variant).collect();
    let base_of = |row: &Row| {
        let same = |other: &&Row| (&other.scene, &other.motion, other.seed) == (&row.scene, &row.motion, row.seed);
        rows.iter().filter(|row| row.variant == BASE).find(same).map(figure)
    };
    let ratio = |row: &&Row| {
        let (of, base) = (figure(row), base_of(row)?);
        // Both lost, or both without error: alike.
        Some(if of == base { 1.0 } else { of / base })
    };
    let figures = sorted(own.iter().map(|row| figure(row)));
    let ratios = sorted(own.iter().filter_map(ratio));
    let logarithms: Vec<f64> = ratios.iter().map(|ratio| ratio.ln()).collect();
    let p = signed_rank_p(&logarithms);
    Line {
        variant: variant.to_owned(),
        place: place.cloned(),
        measure,
        runs: figures.len(),
        lost: figures.iter().filter(|figure| figure.is_infinite()).count(),
        median: median(&figures),
        worst: figures.last().copied().unwrap_or(f64::NAN),
        ratio: median(&ratios),
        least_ratio: ratios.first().copied().unwrap_or(f64::NAN),
        greatest_ratio: ratios.last().copied().unwrap_or(f64::NAN),
        p,
        corrected_p: p,
    }
}

fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The middle of sorted numbers; NaN of none.
fn median(sorted: &[f64]) -> f64 {
    match (sorted.len() / 2, sorted.len() % 2) {
        (0, 0) => f64::NAN,
        (half, 1) => sorted[half],
        (half, _) => 0.5 * (sorted[half - 1] + sorted[half]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(variant: &str, scene: &str, seed: u64, figure: Option<f64>) -> Row {
        let figures = figure.map(|figure| (Measure::PositionRmseM, figure)).into_iter().collect();
        Row { variant: variant.to_owned(), scene: scene.to_owned(), motion: "hand".to_owned(), seed, figures }
    }

    #[test]
    fn ratios_are_of_the_same_run_and_lost_ones_are_the_worst() {
        let mut rows = Vec::new();
        for seed in 0..6 {
            // The base differs tenfold between scenes; the variant is a tenth better on every run.
            let base = if seed < 3 { 0.01 } else { 0.1 } + 0.001 * seed as f64;
            let scene = if seed < 3 { "small" } else { "large" };
            rows.push(row(BASE, scene, seed, Some(base)));
            rows.push(row("better", scene, seed, Some(0.9 * base)));
            rows.push(row("lost once", scene, seed, (seed != 5).then_some(base)));
        }
        let summary = Summary::of(&rows, &["better", "lost once"], &[Measure::PositionRmseM]);
        assert_eq!(summary.places.len(), 2);
        let all = |variant: &str| summary.line(variant, None, Measure::PositionRmseM).unwrap();
        let better = all("better");
        assert!((better.ratio - 0.9).abs() < 1e-12 && (better.greatest_ratio - 0.9).abs() < 1e-12, "{better:?}");
        // All six signs alike: 2 / 2^6, and twice that for the two variants; then it is no proof.
        assert!((better.p - 2.0 / 64.0).abs() < 1e-15 && (better.corrected_p - 4.0 / 64.0).abs() < 1e-15);
        assert!(!better.is_significant());
        let lost = all("lost once");
        assert_eq!((lost.lost, lost.ratio, lost.greatest_ratio, lost.p), (1, 1.0, f64::INFINITY, 1.0));
        let base = summary.line(BASE, Some(&summary.places[1]), Measure::PositionRmseM).unwrap();
        assert!(
            base.runs == 3 && (base.median - 0.104).abs() < 1e-12 && (base.worst - 0.105).abs() < 1e-12,
            "{base:?}"
        );
    }
}
