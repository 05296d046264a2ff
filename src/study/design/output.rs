//! Result of a search as CSV and as a plot.

use super::search::DesignStudy;
use super::spec::CoilDesign;
use super::verified::VerifiedDesign;
use crate::sweep::{Measure, quoted};
use std::fmt::Write;
use zsim_head::spring::DesignMetrics;
use zsim_report::plot::{Chart, Colour, Figure, Mark, Series};

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

/// Formats the verified designs as CSV.
///
/// The columns are the coil, the metrics in closed form, some by simulation (`simulated_...`), the margins of the simulation,
/// and the metrics of the journeys (`journey_...`).
pub fn csv(study: &DesignStudy) -> String {
    let mut text = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,ends,material".to_owned();
    METRICS.iter().for_each(|metric| text += &format!(",{}", metric.key()));
    SIMULATED.iter().for_each(|metric| text += &format!(",simulated_{}", metric.key()));
    text.push_str(",fraction_seen,saturated");
    text.push_str(",clash_margin,gap_mm,solid_margin,buckling_margin,yield_margin,fatigue_margin");
    let journey = study.journey_measures();
    journey.iter().for_each(|measure| text += &format!(",journey_{}", measure.key()));
    text.push('\n');
    for verified in &study.candidates {
        line(&mut text, verified, &journey);
    }
    text
}

fn line(text: &mut String, verified: &VerifiedDesign, journey: &[Measure]) {
    text.push_str(&coil_columns(&verified.candidate.coil));
    let number = |x: Option<f64>| x.filter(|x| x.is_finite()).map_or(String::new(), |x| format!("{x:.5}"));
    let closed_form = METRICS.map(|metric| metric.of_head(&verified.candidate.figures));
    for figure in closed_form.into_iter().chain(SIMULATED.map(|metric| metric.of_head(&verified.simulated))) {
        let _ = write!(text, ",{}", number(figure));
    }
    let _ = write!(text, ",{:.5},{:.5}", verified.fraction_seen, verified.saturated);
    let margins = &verified.simulated.margins;
    let of_simulation = [margins.clash, margins.gap_mm, margins.solid, margins.buckling, margins.yielding];
    for margin in of_simulation.into_iter().chain([verified.simulated.fatigue_margin]) {
        let _ = write!(text, ",{}", number(margin));
    }
    for measure in journey {
        let _ = write!(text, ",{}", number(verified.journey.get(measure).copied()));
    }
    text.push('\n');
}

fn coil_columns(coil: &CoilDesign) -> String {
    let (ends, material) = (coil.ends.key(), coil.material.key());
    format!(
        "{},{:.4},{:.4},{:.4},{:.4},{ends},{material}",
        quoted(&coil.name),
        coil.coil_diameter_mm,
        coil.wire_diameter_mm,
        coil.active_coils,
        coil.free_length_mm
    )
}

/// Formats the rejected springs of a catalogue, and the designs that the simulation rejected, as CSV.
///
/// The columns are the coil, whether the closed form or the simulation rejected it, and the limit with the largest
/// violation with its value, if that is known.
pub fn rejected_csv(study: &DesignStudy) -> String {
    let mut text =
        "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,ends,material,by,limit,value\n".to_owned();
    for rejection in &study.rejections {
        let by = if rejection.simulated { "simulation" } else { "closed_form" };
        let value = rejection.value.map_or(String::new(), |x| format!("{x:.5}"));
        let limit = quoted(&rejection.limit);
        let _ = writeln!(text, "{},{by},{limit},{value}", coil_columns(&rejection.coil));
    }
    text
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
