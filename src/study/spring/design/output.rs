//! Result of a search as CSV and as a plot.

use super::{DesignStudy, VerifiedDesign};
use crate::elasticity::Material;
use crate::report::plot::{Chart, Colour, Figure, Mark, Series};
use crate::study::spring::DesignMetrics;
use crate::study::sweep::Measure;
use std::fmt::Write;

/// Columns of the metrics.
const METRICS: [Measure; 7] = [
    Measure::RockingHz,
    Measure::PeakGain,
    Measure::FieldOfViewDeg,
    Measure::RateDegPerS,
    Measure::SagMm,
    Measure::SpringMassG,
    Measure::StressShare,
];

/// Formats the verified designs as CSV.
///
/// The columns are the coil, the metrics in closed form and by simulation (`simulated_...`), and whether the simulated
/// metrics are within the limits.
pub fn csv(study: &DesignStudy) -> String {
    let mut text = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material".to_owned();
    for prefix in ["", "simulated_"] {
        for name in METRICS.map(Measure::key) {
            // Writing to a string cannot fail.
            let _ = write!(text, ",{prefix}{name}");
        }
    }
    text.push_str(",fraction_seen,saturated,holds\n");
    for verified in &study.candidates {
        line(&mut text, verified);
    }
    text
}

fn line(text: &mut String, verified: &VerifiedDesign) {
    let coil = &verified.candidate.coil;
    let material = match coil.material {
        Material::SpringSteel => "spring_steel",
        Material::Stainless => "stainless",
        Material::Moduli { .. } => "moduli",
    };
    let _ = write!(
        text,
        "{},{:.4},{:.4},{:.4},{:.4},{material}",
        coil.name, coil.coil_diameter_mm, coil.wire_diameter_mm, coil.active_coils, coil.free_length_mm
    );
    let number = |x: Option<f64>| x.filter(|x| x.is_finite()).map_or(String::new(), |x| format!("{x:.5}"));
    let value =
        |metrics: Option<&DesignMetrics>, metric: Measure| number(metrics.and_then(|metrics| metrics.figure(metric)));
    for metrics in [Some(&verified.candidate.figures), verified.simulated.as_ref()] {
        for metric in METRICS {
            let _ = write!(text, ",{}", value(metrics, metric));
        }
    }
    let _ = writeln!(text, ",{},{},{}", number(verified.fraction_seen), number(verified.saturated), verified.holds);
}

/// Plots the metrics of the first two goals: all feasible designs, and the verified ones in closed form and simulated.
pub fn pareto_figure(study: &DesignStudy) -> Figure {
    let figure = |k: usize| study.spec.goals.get(k).or(study.spec.goals.first()).map(|goal| goal.measure);
    let (Some(x), Some(y)) = (figure(0), figure(1)) else { return Figure::of(Vec::new()) };
    let shown = |metrics: &DesignMetrics, measure: Measure| metrics.cost_figure(measure) * measure.unit().1;
    let at = |metrics: &DesignMetrics| (shown(metrics, x), shown(metrics, y));
    let cloud = study.cloud.iter().map(|(a, b)| (a * x.unit().1, b * y.unit().1)).collect();
    let closed = study.candidates.iter().map(|v| at(&v.candidate.figures)).collect();
    let simulated = study.candidates.iter().filter_map(|v| v.simulated.as_ref().map(at)).collect();
    let chart = Chart::new("Pareto set of the springs within limits", x.label(), y.label())
        .with(Series::dots("feasible", Colour::Backdrop, cloud).marked(Mark::Dots(1.5)))
        .with(Series::dots("Pareto set, closed form", Colour::Estimate, closed).marked(Mark::Dots(5.0)))
        .with(Series::dots("Pareto set, simulated", Colour::Second, simulated).marked(Mark::Dots(3.5)));
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 420.0;
    figure
}
