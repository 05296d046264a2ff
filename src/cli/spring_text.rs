//! The output of `zsim spring`.

use super::coverage_text;
use zsim::dynamics::{ElementKind, ElementLoad};
use zsim::report::table;
use zsim::study::spring::design::DesignStudy;
use zsim::study::spring::{CoilReport, DesignMetrics, ShakeResponse, SpringReport};

/// The report on a spring.
pub(super) fn report(report: &SpringReport) -> String {
    let mut rows = vec![row("head", format!("{:.3} kg", report.head_mass_kg))];
    let heaviest = report.heaviest_head_kg.map_or("unlimited".to_owned(), |kg| format!("{kg:.3} kg"));
    rows.push(row("stable rest pose", if report.stands { "yes" } else { "no" }.to_owned()));
    rows.push(row("maximum mass of this head", heaviest));
    if let Some(rest) = &report.rest {
        rows.extend(rest.sag_mm.map(|mm| row("static compression", format!("{mm:.2} mm"))));
        let [x, y, z] = rest.position_m.map(|m| (m * 1e4).round() * 0.1 + 0.0);
        rows.push(row("position at rest", format!("{x:.1}, {y:.1}, {z:.1} mm")));
        let [roll, pitch, yaw] = rest.roll_pitch_yaw_deg;
        rows.push(row("roll, pitch, yaw", format!("{}, {}, {} deg", rounded(roll), rounded(pitch), rounded(yaw))));
    }
    rows.extend(report.bearings.iter().map(bearing));
    rows.extend(report.coil.iter().flat_map(coil));
    let mut words = table(&[], &rows, false);
    words += &report.falls_because.as_ref().map(|why| format!("\n{why}\n")).unwrap_or_default();
    if !report.modes.is_empty() {
        words += "\n";
        words += &modes(report);
    }
    if let Some(stiffness) = &report.stiffness {
        let rows: Vec<_> = ["x", "y", "z", "rx", "ry", "rz"]
            .iter()
            .zip(stiffness)
            .map(|(name, values)| {
                std::iter::once((*name).to_owned()).chain(values.iter().map(|v| rounded(*v))).collect()
            })
            .collect();
        words += "\n";
        words += &table(&["N, m, rad", "x", "y", "z", "rx", "ry", "rz"], &rows, true);
    }
    words + &report.shaken.as_ref().map(under_shake).unwrap_or_default()
}

fn row(name: &str, value: String) -> Vec<String> {
    vec![name.to_owned(), value]
}

fn bearing(bearing: &ElementLoad) -> Vec<String> {
    let name = match bearing.kind {
        ElementKind::Spring => "load on a spring",
        ElementKind::Cord => "tension of a cord",
        ElementKind::Float => "buoyancy of a float",
        ElementKind::UniversalJoint => "load on a universal joint",
    };
    row(name, bearing.load_n.map_or("remaining weight".to_owned(), |n| format!("{n:.2} N")))
}

/// Formats a number with three decimals, and zero without a sign.
fn rounded(x: f64) -> String {
    if x.abs() < 5e-4 { "0".to_owned() } else { format!("{x:.3}") }
}

fn coil(coil: &CoilReport) -> Vec<Vec<String>> {
    let or_dash = |x: Option<f64>, unit: &str| x.map_or("-".to_owned(), |x| format!("{x:.1} {unit}"));
    let buckles = match (coil.buckling_load_n, coil.buckling_margin) {
        (Some(load_n), Some(margin)) => format!("{load_n:.1} N, {margin:.1} x the weight (top cannot tilt)"),
        _ => "does not buckle (top cannot tilt)".to_owned(),
    };
    let stress = match (coil.stress_at_rest_mpa, coil.yield_mpa) {
        (Some(stress), Some(yields)) => format!("{stress:.0} MPa (yield {yields:.0} MPa)"),
        (stress, _) => or_dash(stress, "MPa"),
    };
    vec![
        row("spring index", format!("{:.2}", coil.index)),
        row("wire mass", or_dash(coil.mass_g, "g")),
        row("axial stiffness", format!("{:.1} N/m", coil.axial_n_per_m)),
        row("torsional stiffness", format!("{:.4} N m/rad", coil.torsion_nm_per_rad)),
        row("buckling load", buckles),
        row("stress at rest", stress),
        row("gap between coils", format!("{:.2} mm", coil.gap_mm)),
        row("bending angle at coil contact", format!("{:.0} deg", coil.clash_bend_deg)),
    ]
}

fn modes(report: &SpringReport) -> String {
    let rows: Vec<_> = report
        .modes
        .iter()
        .map(|mode| {
            let mut cells = vec![
                mode.kind.name().to_owned(),
                format!("{:.3}", mode.frequency_hz),
                format!("{:.3}", mode.damping_ratio),
            ];
            cells.extend(mode.shape.iter().map(|x| rounded(*x)));
            cells
        })
        .collect();
    table(&["mode", "Hz", "damping", "x", "y", "z", "rx", "ry", "rz"], &rows, true)
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
    let legend = "coil: mean diameter x wire diameter x active coils x free length, mm. Rocking frequency (Hz)\n\
                  and field of view (deg) in closed form; field of view (deg), maximum rate (deg/s) and\n\
                  stress / yield strength simulated. sag: static compression, mm. g: mass of the wire.\n\
                  holds: whether the simulated figures are within the limits.\n";
    format!("{counts}\n{}\n{legend}", table(&header, &rows, true))
}
