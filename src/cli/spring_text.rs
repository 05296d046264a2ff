//! The output of `zsim spring`.

use super::coverage_text;
use zsim::report::page::PageTable;
use zsim::report::{table, wrapped};
use zsim::study::spring::design::DesignStudy;
use zsim::study::spring::{DesignMetrics, ShakeResponse, SpringReport, mode_table, properties, stiffness_table};

/// The report on a spring.
pub(super) fn report(report: &SpringReport) -> String {
    let rows: Vec<_> = properties(report).into_iter().map(|row| vec![row.name.to_owned(), row.value]).collect();
    let mut words = table(&[], &rows, false);
    words += &report.falls_because.as_ref().map(|why| format!("\n{why}\n")).unwrap_or_default();
    if !report.modes.is_empty() {
        words += &figures(&mode_table(report, |mode| mode.kind.name()));
    }
    if let Some(stiffness) = &report.stiffness {
        words += &figures(&stiffness_table("", stiffness));
    }
    words + &report.shaken.as_ref().map(under_shake).unwrap_or_default()
}

/// A table of figures after an empty line.
fn figures(of: &PageTable) -> String {
    let header: Vec<&str> = of.header.iter().map(String::as_str).collect();
    format!("\n{}", table(&header, &of.rows, true))
}

fn under_shake(shaken: &ShakeResponse) -> String {
    let header = ["response to a shake", "closed form", "simulated"];
    let simulated = shaken.simulated.as_ref();
    let line = |name: &str, of: fn(&DesignMetrics) -> Option<f64>, decimals: usize| {
        let number = |figures: Option<&DesignMetrics>| {
            figures.and_then(of).map_or("-".to_owned(), |x| format!("{x:.decimals$}"))
        };
        vec![name.to_owned(), number(Some(&shaken.closed_form)), number(simulated)]
    };
    let mut rows = vec![
        line("field of view, deg", |f| Some(f.field_of_view_deg), 1),
        line("maximum rate, deg/s", |f| Some(f.rate_deg_per_s), 0),
        line("stress / yield stress", |f| f.stress_share, 3),
        line("peak gain of the pitch rate", |f| Some(f.peak_gain), 2),
    ];
    if let Some(seen) = &shaken.coverage {
        let of_lidar = coverage_text::rows(seen).into_iter();
        rows.extend(of_lidar.map(|(name, value)| vec![name.to_owned(), "-".to_owned(), value]));
    }
    let failed = shaken.failed.as_ref().map(|why| format!("no simulation: {why}\n")).unwrap_or_default();
    format!("\n{}{failed}", table(&header, &rows, true))
}

/// The result of a search.
pub(super) fn design(study: &DesignStudy) -> String {
    let header = ["coil", "Hz", "view", "simulated", "rate", "sag", "g", "stress", "holds"];
    let rows: Vec<_> = study
        .candidates
        .iter()
        .map(|verified| {
            let (coil, figures) = (&verified.candidate.coil, &verified.candidate.figures);
            let number = |x: Option<f64>, decimals: usize| x.map_or("-".to_owned(), |x| format!("{x:.decimals$}"));
            let simulated = verified.simulated.as_ref();
            vec![
                format!(
                    "{:.1}x{:.2}x{:.1}x{:.0}",
                    coil.coil_diameter_mm, coil.wire_diameter_mm, coil.active_coils, coil.free_length_mm
                ),
                format!("{:.3}", figures.rocking_hz),
                format!("{:.1}", figures.field_of_view_deg),
                number(simulated.map(|f| f.field_of_view_deg), 1),
                number(simulated.map(|f| f.rate_deg_per_s), 0),
                format!("{:.1}", figures.sag_mm),
                number(figures.spring_mass_g, 0),
                number(simulated.and_then(|f| f.stress_share), 2),
                if verified.holds { "yes" } else { "no" }.to_owned(),
            ]
        })
        .collect();
    let counts = format!(
        "{} designs evaluated, {} within all limits, {} in the Pareto set\n",
        study.evaluated, study.feasible, study.pareto
    );
    if rows.is_empty() {
        return counts + "no design is within all limits: widen the bounds or relax a limit\n";
    }
    let legend = "coil: mean diameter x wire diameter x active coils x free length, mm. Rocking frequency (Hz) and field of \
                  view (deg) in closed form; field of view (deg), maximum rate (deg/s) and stress / yield strength simulated. \
                  sag: static compression, mm. g: mass of the wire. holds: whether the simulated figures are within the limits.";
    let legend = wrapped(legend, "");
    format!("{counts}\n{}\n{legend}", table(&header, &rows, true))
}
