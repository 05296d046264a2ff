//! What a search found, as CSV and as a plot.

use super::{DesignStudy, FigureName, Verified};
use crate::elasticity::Material;
use crate::report::plot::{Chart, Colour, Figure, Mark, Series};
use crate::study::spring::DesignFigures;
use std::fmt::Write;

const FIGURES: [(&str, FigureName); 7] = [
    ("rocking_hz", FigureName::RockingHz),
    ("peak_gain", FigureName::PeakGain),
    ("field_of_view_deg", FigureName::FieldOfViewDeg),
    ("rate_deg_per_s", FigureName::RateDegPerS),
    ("sag_mm", FigureName::SagMm),
    ("spring_mass_g", FigureName::SpringMassG),
    ("stress_share", FigureName::StressShare),
];

/// A line a verified design: the coil, its figures by the closed form, those by simulation (`simulated_...`), whether
/// they hold.
pub fn csv(study: &DesignStudy) -> String {
    let mut text = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material".to_owned();
    for prefix in ["", "simulated_"] {
        for (name, _) in FIGURES {
            // Writing to a string does not fail.
            let _ = write!(text, ",{prefix}{name}");
        }
    }
    text.push_str(",fraction_seen,saturated,holds\n");
    for verified in &study.candidates {
        line(&mut text, verified);
    }
    text
}

fn line(text: &mut String, verified: &Verified) {
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
    let of = |figures: Option<&DesignFigures>, name: FigureName| number(figures.map(|figures| name.of(figures)));
    for figures in [Some(&verified.candidate.figures), verified.simulated.as_ref()] {
        for (_, name) in FIGURES {
            let _ = write!(text, ",{}", of(figures, name));
        }
    }
    let _ = writeln!(text, ",{},{},{}", number(verified.fraction_seen), number(verified.saturated), verified.holds);
}

/// The figures of the first two goals: all designs within limits, the Pareto set, and where its simulations put it.
pub fn pareto_figure(study: &DesignStudy) -> Figure {
    let figure = |k: usize| study.spec.goals.get(k).or(study.spec.goals.first()).map(|goal| goal.figure);
    let (Some(x), Some(y)) = (figure(0), figure(1)) else { return Figure::of(Vec::new()) };
    let at = |figures: &DesignFigures| (x.of(figures), y.of(figures));
    let closed = study.candidates.iter().map(|v| at(&v.candidate.figures)).collect();
    let simulated = study.candidates.iter().filter_map(|v| v.simulated.as_ref().map(at)).collect();
    let chart = Chart::new("Springs within limits", x.label(), y.label())
        .with(Series::dots("tried", Colour::Backdrop, study.cloud.clone()).marked(Mark::Dots(1.5)))
        .with(Series::dots("Pareto set, closed form", Colour::Estimate, closed).marked(Mark::Dots(5.0)))
        .with(Series::dots("the same, simulated", Colour::Second, simulated).marked(Mark::Dots(3.5)));
    let mut figure = Figure::of(vec![chart]);
    figure.chart_height = 420.0;
    figure
}
