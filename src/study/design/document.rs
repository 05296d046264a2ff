//! Result of a search as a document, as CSV and as a plot.

use super::search::DesignStudy;
use super::spec::CoilDesign;
use super::verified::{Rejection, VerifiedDesign};
use crate::sweep::Measure;
use std::collections::{BTreeMap, BTreeSet};
use zsim_head::spring::DesignMetrics;
use zsim_report::plot::{Chart, Colour, Figure, Mark, Series};
use zsim_report::{Content, Document, Table, digits};

/// Columns of the metrics.
const METRICS: [Measure; 7] = [
    Measure::named("rocking_hz"),
    Measure::PEAK_GAIN,
    Measure::named("field_of_view_deg"),
    Measure::named("rate_deg_per_s"),
    Measure::named("sag_mm"),
    Measure::named("spring_mass_g"),
    Measure::STRESS_SHARE,
];

/// The metrics that a simulation has too; the others follow from the linear head.
const SIMULATED: [Measure; 3] =
    [Measure::named("field_of_view_deg"), Measure::named("rate_deg_per_s"), Measure::STRESS_SHARE];

/// The result of a search.
pub fn document(study: &DesignStudy) -> Document {
    let mut document = Document::new("Spring search", "");
    let mut found = vec![format!(
        "{} designs evaluated, {} within all limits in closed form, {} of them in the Pareto set",
        study.evaluated, study.feasible, study.pareto
    )];
    found.extend(listed("rejected by", study.rejected.iter().map(|(limit, count)| (limit.as_str(), *count))));
    let mut simulated: BTreeMap<&str, usize> = BTreeMap::new();
    for rejection in study.rejections.iter().filter(|rejection| rejection.simulated) {
        *simulated.entry(&rejection.limit).or_default() += 1;
    }
    found.extend(listed("rejected by simulation", simulated.into_iter()));
    let unchecked: BTreeSet<&str> = study.candidates.iter().flat_map(|design| &design.unchecked).copied().collect();
    if !unchecked.is_empty() {
        let names = unchecked.into_iter().collect::<Vec<_>>().join(", ");
        found.push(format!(
            "not checked (no strength of the wire is known, or a cable bears a part of the load): {names}"
        ));
    }
    if study.candidates.is_empty() {
        let advice = match study.feasible {
            0 => "no design is within all limits: widen the bounds, or relax the limit that rejects most designs",
            _ => "no design is within all limits when it is simulated: relax the limit that rejects most designs there",
        };
        found.push(advice.to_owned());
    }
    document.add(Content::List(found));
    if !study.candidates.is_empty() {
        let header = ["spring", "Hz", "view", "rate", "g", "clash", "gap", "yield", "fatigue"];
        document.add(Table::new(header, study.candidates.iter().map(candidate_row)));
        document.add(
            "spring: name, or mean diameter x wire diameter x active coils x free length, mm. Hz: rocking frequency. g: \
             mass of the wire. Simulated: view (field of view, deg), rate (maximum, deg/s), gap (smallest gap between \
             coils, mm), and the margins of clash, yield and fatigue; - where a margin is unknown or does not apply. \
             pareto.csv has all figures; rejected.csv has the rejected springs of a catalogue, and the designs that the \
             simulation rejected.",
        );
        journeys(study).into_iter().for_each(|table| document.add(table));
    }
    document
}

fn candidate_row(design: &VerifiedDesign) -> Vec<String> {
    let number = |x: Option<f64>, decimals: usize| x.map_or("-".to_owned(), |x| format!("{x:.decimals$}"));
    let (figures, simulated) = (&design.candidate.figures, &design.simulated);
    vec![
        design.candidate.coil.label(),
        format!("{:.3}", figures.rocking_hz),
        format!("{:.1}", simulated.field_of_view_deg),
        format!("{:.0}", simulated.rate_deg_per_s),
        number(figures.spring_mass_g, 0),
        number(simulated.margins.clash, 2),
        number(simulated.margins.gap_mm, 2),
        number(simulated.margins.yielding, 2),
        number(simulated.fatigue_margin, 2),
    ]
}

/// The table of the journeys; `None` without any.
fn journeys(study: &DesignStudy) -> Option<Table> {
    let measures: Vec<Measure> =
        study.journey_measures().into_iter().filter(|measure| *measure != Measure::COIL_CONTACT_S).collect();
    let with_unit = |measure: &Measure| match measure.unit().0 {
        "1" => measure.short().to_owned(),
        unit => format!("{}, {unit}", measure.short()),
    };
    let header = ["in a journey".to_owned()].into_iter().chain(measures.iter().map(with_unit));
    let row = |design: &VerifiedDesign| {
        let figure =
            |measure: &Measure| design.journey.get(measure).map_or("-".to_owned(), |x| digits(x * measure.unit().1));
        [design.candidate.coil.label()].into_iter().chain(measures.iter().map(figure)).collect()
    };
    (!measures.is_empty()).then(|| Table::new(header, study.candidates.iter().map(row)))
}

/// A line with counts, most frequent first; `None` without any.
fn listed<'a>(title: &str, counts: impl Iterator<Item = (&'a str, usize)>) -> Option<String> {
    let mut counts: Vec<_> = counts.collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let items: Vec<String> = counts.iter().map(|(limit, count)| format!("{limit} {count}")).collect();
    (!items.is_empty()).then(|| format!("{title}: {}", items.join(", ")))
}

/// Columns of a coil.
const COIL: [&str; 7] =
    ["name", "coil_diameter_mm", "wire_diameter_mm", "active_coils", "free_length_mm", "ends", "material"];

/// The content of `pareto.csv`: the verified designs.
///
/// The columns are the coil, the metrics in closed form, some by simulation (`simulated_...`), the margins of the simulation,
/// and the metrics of the journeys (`journey_...`).
pub fn csv(study: &DesignStudy) -> String {
    let journey = study.journey_measures();
    let margins = ["clash_margin", "gap_mm", "solid_margin", "buckling_margin", "yield_margin", "fatigue_margin"];
    let header = (COIL.into_iter().map(str::to_owned))
        .chain(METRICS.map(|metric| metric.key().to_owned()))
        .chain(SIMULATED.map(|metric| format!("simulated_{}", metric.key())))
        .chain(["fraction_seen", "saturated"].into_iter().chain(margins).map(str::to_owned))
        .chain(journey.iter().map(|measure| format!("journey_{}", measure.key())));
    let row = |verified: &VerifiedDesign| {
        let simulated = &verified.simulated;
        let margins = &simulated.margins;
        let figures = (METRICS.map(|metric| metric.of_head(&verified.candidate.figures)).into_iter())
            .chain(SIMULATED.map(|metric| metric.of_head(simulated)))
            .chain([verified.fraction_seen, verified.saturated].map(Some))
            .chain([margins.clash, margins.gap_mm, margins.solid, margins.buckling, margins.yielding])
            .chain([simulated.fatigue_margin])
            .chain(journey.iter().map(|measure| verified.journey.get(measure).copied()));
        coil_cells(&verified.candidate.coil).into_iter().chain(figures.map(number)).collect()
    };
    Table::new(header, study.candidates.iter().map(row)).csv()
}

/// A number with five decimals; empty without one.
fn number(x: Option<f64>) -> String {
    x.filter(|x| x.is_finite()).map_or(String::new(), |x| format!("{x:.5}"))
}

fn coil_cells(coil: &CoilDesign) -> [String; 7] {
    let [diameter, wire, coils, length] =
        [coil.coil_diameter_mm, coil.wire_diameter_mm, coil.active_coils, coil.free_length_mm]
            .map(|x| format!("{x:.4}"));
    [coil.name.clone(), diameter, wire, coils, length, coil.ends.key().to_owned(), coil.material.key().to_owned()]
}

/// The content of `rejected.csv`: the rejected springs of a catalogue, and the designs that the simulation rejected.
///
/// The columns are the coil, whether the closed form or the simulation rejected it, and the limit with the largest
/// violation with its value, if that is known.
pub fn rejected_csv(study: &DesignStudy) -> String {
    let row = |rejection: &Rejection| {
        let by = if rejection.simulated { "simulation" } else { "closed_form" };
        let value = rejection.value.map_or(String::new(), |x| format!("{x:.5}"));
        coil_cells(&rejection.coil).into_iter().chain([by.to_owned(), rejection.limit.clone(), value]).collect()
    };
    Table::new(COIL.into_iter().chain(["by", "limit", "value"]), study.rejections.iter().map(row)).csv()
}

/// Plots the metrics of the first two goals: all feasible designs, and the verified ones in closed form and simulated; with
/// journeys, the designs whose journeys are within all limits, and the Pareto set.
pub fn pareto_figure(study: &DesignStudy) -> Figure {
    let figure = |k: usize| study.spec.goals.get(k).or(study.spec.goals.first()).map(|goal| goal.measure);
    let (Some(x), Some(y)) = (figure(0), figure(1)) else { return Figure::of(Vec::new()) };
    let cloud = study.cloud.iter().map(|(a, b)| (a * x.unit().1, b * y.unit().1)).collect();
    // Thousands of designs in closed form, tens with journeys.
    let is_by_journeys = study.spec.journey.is_some();
    let chart = Chart::new("Pareto set of the springs within limits", &x.label(), &y.label());
    let chart = chart.with(Series::dots("feasible", Colour::Backdrop, cloud).marked(Mark::Dots(if is_by_journeys {
        3.0
    } else {
        1.5
    })));
    let designs = || study.candidates.iter();
    let chart = if is_by_journeys {
        let at = |design: &VerifiedDesign| (design.cost_figure(x) * x.unit().1, design.cost_figure(y) * y.unit().1);
        let front = designs().map(at).collect();
        chart.with(Series::dots("Pareto set of all goals", Colour::Estimate, front).marked(Mark::Dots(5.0)))
    } else {
        let shown = |metrics: &DesignMetrics, measure: Measure| measure.cost_of_head(metrics) * measure.unit().1;
        let at = |metrics: &DesignMetrics| (shown(metrics, x), shown(metrics, y));
        let closed = designs().map(|v| at(&v.candidate.figures)).collect();
        let simulated = designs().map(|v| at(&v.simulated)).collect();
        chart
            .with(Series::dots("Pareto set, closed form", Colour::Estimate, closed).marked(Mark::Dots(5.0)))
            .with(Series::dots("Pareto set, simulated", Colour::Second, simulated).marked(Mark::Dots(3.5)))
    };
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 420.0;
    figure
}
