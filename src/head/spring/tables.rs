//! Tables of the report on a spring.

use super::mode_figure::ratio;
use super::{CoilReport, DesignMetrics, RestReport, ShakeResponse, SpringReport};
use crate::coverage::main_values;
use zsim_dynamics::{ElementKind, ElementLoad};
use zsim_elasticity::VALID_BUCKLING_MARGIN;
use zsim_report::Table;

/// Names of the six directions of a stiffness matrix or a mode shape.
const DIRECTIONS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// A name and a value with its unit.
type Property = (&'static str, String);

/// Load, rest pose and limits.
pub(super) fn properties(report: &SpringReport) -> Table {
    let mut rows = vec![("head", format!("{:.3} kg", report.head_mass_kg))];
    let heaviest = match (report.heaviest_head_kg, &report.heaviest_head_limit) {
        (Some(kg), Some(limit)) => format!("{kg:.3} kg (above: {limit})"),
        _ => "no limit by the rest pose; strength unknown".to_owned(),
    };
    rows.push(("stable rest pose", if report.stands { "yes" } else { "no" }.to_owned()));
    rows.push(("maximum mass of this head", heaviest));
    rows.extend(report.rest.iter().flat_map(rest));
    rows.extend(report.bearings.iter().map(bearing));
    rows.extend(report.coil.iter().flat_map(coil));
    Table::facts(rows)
}

/// The modes, slowest first: name, natural frequency, damping ratio and shape.
pub(super) fn mode_table(report: &SpringReport) -> Table {
    let rows = report.modes.iter().map(|mode| {
        let kind = mode.kind.name();
        let direction = mode.name.strip_prefix(kind).unwrap_or_default().trim_start();
        let cells =
            [kind.to_owned(), direction.to_owned(), format!("{:.3}", mode.frequency_hz), ratio(mode.damping_ratio)];
        [&cells[..], &mode.shape.map(rounded)].concat()
    });
    let header = ["mode", "direction", "Hz", "damping"].into_iter().chain(DIRECTIONS);
    Table { details: vec![1], ..Table::new(header, rows) }
}

/// A stiffness matrix; N, m, rad.
pub(super) fn stiffness_table(matrix: &[[f64; 6]; 6]) -> Table {
    let row = |(name, values): (&str, &[f64; 6])| [&[name.to_owned()][..], &values.map(rounded)].concat();
    Table::new(["N, m, rad"].into_iter().chain(DIRECTIONS), DIRECTIONS.into_iter().zip(matrix).map(row))
}

/// Figures of the response to a shake, in closed form and simulated.
pub(super) fn shake_table(shaken: &ShakeResponse) -> Table {
    let line = |name: &str, of: fn(&DesignMetrics) -> Option<f64>, decimals: usize| {
        let number = |figures: Option<&DesignMetrics>| {
            figures.and_then(of).map_or("-".to_owned(), |x| format!("{x:.decimals$}"))
        };
        vec![name.to_owned(), number(Some(&shaken.closed_form)), number(shaken.simulated.as_ref())]
    };
    let mut rows = vec![
        line("elevation range of the forward beam, deg", |f| Some(f.field_of_view_deg), 1),
        line("maximum rate, deg/s", |f| Some(f.rate_deg_per_s), 0),
        line("stress / yield stress", |f| f.stress_share, 3),
        line("smallest gap between coils, mm", |f| f.margins.gap_mm, 2),
        line("clash margin", |f| f.margins.clash, 2),
    ];
    // Linear by definition: the simulation has none.
    let gain = format!("{:.2}", shaken.closed_form.peak_gain);
    rows.push(vec!["peak gain of the pitch rate".to_owned(), gain, "-".to_owned()]);
    let of_lidar = shaken.coverage.iter().flat_map(main_values);
    rows.extend(of_lidar.map(|(name, value)| vec![name.to_owned(), "-".to_owned(), value]));
    Table::new(["", "closed form", "simulated"], rows)
}

/// Formats a number with three decimals, and zero without a sign.
fn rounded(x: f64) -> String {
    if x.abs() < 5e-4 { "0".to_owned() } else { format!("{x:.3}") }
}

fn rest(rest: &RestReport) -> Vec<Property> {
    let sag = rest.sag_mm.map(|mm| match mm < 0.0 {
        true => ("static extension", format!("{:.2} mm", -mm)),
        false => ("static compression", format!("{mm:.2} mm")),
    });
    let [x, y, z] = rest.position_m.map(|m| (m * 1e4).round() * 0.1 + 0.0);
    let [roll, pitch, yaw] = rest.roll_pitch_yaw_deg.map(rounded);
    let mut rows: Vec<_> = sag.into_iter().collect();
    rows.push(("position at rest", format!("{x:.1}, {y:.1}, {z:.1} mm")));
    rows.push(("roll, pitch, yaw", format!("{roll}, {pitch}, {yaw} deg")));
    rows
}

fn bearing(bearing: &ElementLoad) -> Property {
    let name = match bearing.kind {
        ElementKind::Spring => "load on a spring",
        ElementKind::Cord => "tension of a cord",
        ElementKind::Float => "buoyancy of a float",
        ElementKind::UniversalJoint => "load on a universal joint",
    };
    let value = match (bearing.kind, bearing.load_n) {
        (_, None) => "remaining weight".to_owned(),
        (ElementKind::Spring, Some(n)) if n < 0.0 => format!("pulled by {:.2} N", -n),
        (ElementKind::Spring, Some(n)) => format!("pressed by {n:.2} N"),
        (_, Some(n)) => format!("{n:.2} N"),
    };
    (name, value)
}

fn coil(coil: &CoilReport) -> Vec<Property> {
    let or_dash = |x: Option<f64>, unit: &str| x.map_or("-".to_owned(), |x| format!("{x:.1} {unit}"));
    let buckles = match (coil.buckling_load_n, coil.buckling_margin) {
        (Some(load_n), Some(margin)) => {
            let beyond = if margin < VALID_BUCKLING_MARGIN { "; the force law is valid up to 80 % of it" } else { "" };
            format!("{load_n:.1} N, {margin:.1} x the load (top cannot tilt){beyond}")
        }
        _ if coil.load_n < 0.0 => "none: the head pulls the spring".to_owned(),
        _ => "does not buckle (top cannot tilt)".to_owned(),
    };
    let stress = match (coil.stress_at_rest_mpa, coil.yield_mpa) {
        (Some(stress), Some(yields)) => format!("{stress:.0} MPa (yield {yields:.0} MPa)"),
        (stress, _) => or_dash(stress, "MPa"),
    };
    let diameters = format!("{:.2} mm, of wire of {:.2} mm", coil.coil_diameter_mm, coil.wire_diameter_mm);
    let ends = coil.ends.name();
    let coils = format!("{:.2} active, {:.2} in total ({ends})", coil.active_coils, coil.total_coils);
    let [gap, clash_bend] = if coil.gap_mm > 0.0 {
        [format!("{:.2} mm", coil.gap_mm), format!("{:.0} deg", coil.clash_bend_deg)]
    } else {
        ["none: the coils touch", "-"].map(str::to_owned)
    };
    vec![
        ("mean diameter", diameters),
        ("coils", coils),
        ("material", coil.material.name().to_owned()),
        ("free length, solid length", format!("{:.2} mm, {:.2} mm", coil.free_length_mm, coil.solid_length_mm)),
        ("spring index", format!("{:.2}", coil.index)),
        ("mass of the active wire", or_dash(coil.mass_g, "g")),
        ("axial stiffness", format!("{:.1} N/m", coil.axial_n_per_m)),
        ("torsional stiffness", format!("{:.4} N m/rad", coil.torsion_nm_per_rad)),
        ("buckling load", buckles),
        ("stress at rest", stress),
        ("gap between coils", gap),
        ("bending angle at coil contact", clash_bend),
    ]
}
