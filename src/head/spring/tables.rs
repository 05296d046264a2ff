//! Tables of the report on a spring, for terminal and page.

use super::mode_figure::ratio;
use super::{CoilReport, ModeReport, RestReport, SpringReport};
use zsim_dynamics::{ElementKind, ElementLoad};
use zsim_elasticity::VALID_BUCKLING_MARGIN;
use zsim_report::page::PageTable;

/// Names of the six directions of a stiffness matrix or a mode shape.
const DIRECTIONS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// A value of a report with its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Name.
    pub name: &'static str,
    /// Value with its unit.
    pub value: String,
}

/// Load, rest pose and limits.
pub fn properties(report: &SpringReport) -> Vec<Property> {
    let mut rows = vec![row("head", format!("{:.3} kg", report.head_mass_kg))];
    let heaviest = match (report.heaviest_head_kg, &report.heaviest_head_limit) {
        (Some(kg), Some(limit)) => format!("{kg:.3} kg (above: {limit})"),
        _ => "no limit by the rest pose; strength unknown".to_owned(),
    };
    rows.push(row("stable rest pose", if report.stands { "yes" } else { "no" }.to_owned()));
    rows.push(row("maximum mass of this head", heaviest));
    rows.extend(report.rest.iter().flat_map(rest));
    rows.extend(report.bearings.iter().map(bearing));
    rows.extend(report.coil.iter().flat_map(coil));
    rows
}

/// The modes, slowest first: `name`, natural frequency, damping ratio and shape.
pub fn mode_table(report: &SpringReport, name: fn(&ModeReport) -> &str) -> PageTable {
    let rows = report.modes.iter().map(|mode| {
        let mut cells = vec![name(mode).to_owned(), format!("{:.3}", mode.frequency_hz), ratio(mode.damping_ratio)];
        cells.extend(mode.shape.iter().map(|x| rounded(*x)));
        cells
    });
    let header = ["mode", "Hz", "damping"].iter().chain(&DIRECTIONS).map(|name| (*name).to_owned());
    PageTable { title: "Modes".to_owned(), header: header.collect(), rows: rows.collect(), ..PageTable::default() }
}

/// A stiffness matrix; N, m, rad.
pub fn stiffness_table(title: &str, matrix: &[[f64; 6]; 6]) -> PageTable {
    let rows = DIRECTIONS
        .iter()
        .zip(matrix)
        .map(|(name, values)| std::iter::once((*name).to_owned()).chain(values.iter().map(|v| rounded(*v))).collect());
    let header = std::iter::once(&"N, m, rad").chain(&DIRECTIONS).map(|name| (*name).to_owned());
    PageTable { title: title.to_owned(), header: header.collect(), rows: rows.collect(), ..PageTable::default() }
}

fn row(name: &'static str, value: String) -> Property {
    Property { name, value }
}

/// Formats a number with three decimals, and zero without a sign.
fn rounded(x: f64) -> String {
    if x.abs() < 5e-4 { "0".to_owned() } else { format!("{x:.3}") }
}

fn rest(rest: &RestReport) -> Vec<Property> {
    let sag = rest.sag_mm.map(|mm| match mm < 0.0 {
        true => row("static extension", format!("{:.2} mm", -mm)),
        false => row("static compression", format!("{mm:.2} mm")),
    });
    let [x, y, z] = rest.position_m.map(|m| (m * 1e4).round() * 0.1 + 0.0);
    let [roll, pitch, yaw] = rest.roll_pitch_yaw_deg.map(rounded);
    let mut rows: Vec<_> = sag.into_iter().collect();
    rows.push(row("position at rest", format!("{x:.1}, {y:.1}, {z:.1} mm")));
    rows.push(row("roll, pitch, yaw", format!("{roll}, {pitch}, {yaw} deg")));
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
    row(name, value)
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
        row("mean diameter", diameters),
        row("coils", coils),
        row("material", coil.material.name().to_owned()),
        row("free length, solid length", format!("{:.2} mm, {:.2} mm", coil.free_length_mm, coil.solid_length_mm)),
        row("spring index", format!("{:.2}", coil.index)),
        row("mass of the active wire", or_dash(coil.mass_g, "g")),
        row("axial stiffness", format!("{:.1} N/m", coil.axial_n_per_m)),
        row("torsional stiffness", format!("{:.4} N m/rad", coil.torsion_nm_per_rad)),
        row("buckling load", buckles),
        row("stress at rest", stress),
        row("gap between coils", gap),
        row("bending angle at coil contact", clash_bend),
    ]
}
