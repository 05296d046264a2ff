//! The report on a spring, or another linkage, under a head as a document.

use super::mode_figure::{displayed_shape, ratio};
use super::modes::{ExcitedMode, along_axes};
use super::tables::{mode_table, properties, shake_table, stiffness_table};
use super::{CoilReport, RestReport, Shake, SpringReport, mode_name};
use crate::HeadError;
use zsim_base::geometry::{Pose, Vector};
use zsim_dynamics::{GainPoints, HeadModel, HeadSpec, LinkageSpec, PartSpec};
use zsim_elasticity::SpringDesign;
use zsim_motion::Axis;
use zsim_report::page::{Interactive, Link, ShownMode, SpringView, links};
use zsim_report::{Document, capitalised};

/// The report on a spring, or another linkage, under a head.
///
/// `name` is the name of the head, or of spring and head. `head` is `None` for a head without a stable rest pose.
///
/// # Errors
/// When the spring of the spec is invalid.
pub fn document(
    name: &str,
    spec: &HeadSpec,
    head: Option<&HeadModel>,
    report: &SpringReport,
) -> Result<Document, HeadError> {
    let mut document = Document::new(format!("Spring and modes of {name}"), summary(report));
    "All values are in spring.json.".clone_into(&mut document.footer);
    document.add_detail(Interactive::Spring(match head {
        Some(head) => view_at_rest(spec, head, report),
        None => view_of_fallen(spec)?,
    }));
    document.heading("Load and limits");
    document.add(properties(report));
    report.falls_because.iter().for_each(|why| document.add(why.as_str()));
    if !report.modes.is_empty() {
        document.heading("Modes");
        document.add(mode_table(report));
        document.add_detail(
            "Undamped frequency. The shape is the displacement of the centre of mass (m) and the rotation (rad) in the axes of the \
             base; its largest entry is 1. In the picture, modes of the same kind within 1 % in frequency are turned to the axes.",
        );
    }
    add_stiffness(&mut document, head, report);
    if let Some(shaken) = &report.shaken {
        let at = shaken.shake.frequency_hz.map_or("the slowest mode".to_owned(), |hz| format!("{hz:.2} Hz"));
        document.heading(format!("Response to a nod by {}\u{b0} at {at}", shaken.shake.pitch_deg));
        document.add(shake_table(shaken));
        shaken.failed.iter().for_each(|why| document.add(format!("No simulation: {why}")));
    }
    Ok(document)
}

/// Free length, length under load, lowest frequency, and the margin to buckling or coil contact.
fn summary(report: &SpringReport) -> String {
    if let Some(why) = &report.falls_because {
        let lines: Vec<&str> = why.lines().map(|line| line.trim().trim_start_matches("help: ")).collect();
        return format!("This head has no stable rest pose: {}.", lines.join("; "));
    }
    let mut parts: Vec<String> = Vec::new();
    if let (Some(coil), Some(RestReport { sag_mm: Some(sag_mm), .. })) = (&report.coil, &report.rest) {
        let length_mm = coil.free_length_mm - sag_mm;
        parts.push(format!("free length {:.1} mm, {length_mm:.1} mm under the head", coil.free_length_mm));
    }
    if let Some(mode) = report.modes.first() {
        parts.push(format!("lowest frequency {:.3} Hz ({})", mode.frequency_hz, mode.name));
    }
    parts.extend(report.coil.as_ref().map(margin));
    let mut text = capitalised(&parts.join("; ")) + ".";
    if let (Some(kg), Some(limit)) = (report.heaviest_head_kg, &report.heaviest_head_limit) {
        text += &format!(" The head has {:.3} kg; the maximum is {kg:.3} kg (above: {limit}).", report.head_mass_kg);
    }
    text
}

/// The margin to buckling, or to the contact of the coils.
fn margin(coil: &CoilReport) -> String {
    let gap_mm = coil.gap_mm;
    match coil.buckling_margin {
        Some(margin) => format!("buckles at {margin:.1} times the load, if the top cannot tilt"),
        None if coil.load_n > 0.0 => format!("does not buckle; gap between coils {gap_mm:.1} mm"),
        None => {
            format!(
                "pulled by {:.2} N, so that the spring cannot buckle; gap between coils {gap_mm:.1} mm",
                -coil.load_n
            )
        }
    }
}

fn view_at_rest(spec: &HeadSpec, head: &HeadModel, report: &SpringReport) -> SpringView {
    let rest = *head.base_from_head_at_rest();
    let centre = rest * nalgebra::Point3::from(head.body().centre_of_mass_in_head);
    let shake = report.shaken.as_ref().map(|shaken| shaken.shake);
    SpringView {
        parts: links::blocks(&spec.parts),
        links: links::of(&spec.linkage),
        base_from_head: rest,
        centre_in_base: centre.coords,
        note: note("To scale, at rest under the weight of the head.", spec),
        modes: shake.map(|shake| modes(head, &shake)).unwrap_or_default(),
        shake: shake.map(|shake| shake_in_words(head, &shake)).unwrap_or_default(),
    }
}

/// A head without a rest pose, on the straight, unloaded spring.
fn view_of_fallen(spec: &HeadSpec) -> Result<SpringView, HeadError> {
    let base_from_head = unloaded_pose(&spec.linkage)?;
    Ok(SpringView {
        parts: links::blocks(&spec.parts),
        links: links::of(&spec.linkage),
        base_from_head,
        centre_in_base: (base_from_head * nalgebra::Point3::from(centre_of_mass(&spec.parts))).coords,
        note: note("To scale, without load: the head has no rest pose.", spec),
        modes: Vec::new(),
        shake: String::new(),
    })
}

/// Centre of mass in the head, m.
fn centre_of_mass(parts: &[PartSpec]) -> Vector {
    let (mut moment, mut total_kg) = (Vector::zeros(), 0.0);
    for part in parts {
        let (mass_kg, centre_m) = match part {
            PartSpec::Block { mass_kg, centre_m, .. } => (mass_kg, centre_m),
            PartSpec::Body { mass_kg, centre_of_mass_m, .. } => (mass_kg, centre_of_mass_m),
        };
        moment += Vector::from(*centre_m) * *mass_kg;
        total_kg += mass_kg;
    }
    moment / total_kg
}

/// What the picture shows, and what it assumes.
fn note(pose: &str, spec: &HeadSpec) -> String {
    let mut text =
        format!("{pose} Axes of the base. Plates and blocks at the ends of springs and cords represent the base.");
    if links::of(&spec.linkage).iter().any(|link| matches!(link, Link::Spring(spring) if spring.is_assumed)) {
        text += " A spring is specified by its stiffness: its coils are assumed.";
    }
    let has_size = |part: &PartSpec| matches!(part, PartSpec::Block { .. });
    if !spec.parts.iter().any(has_size) {
        text += " The parts of the head have no size in its spec: a block is assumed.";
    } else if !spec.parts.iter().all(has_size) {
        text += " Parts of the head without a size in its spec are not drawn.";
    }
    text
}

fn unloaded_pose(linkage: &LinkageSpec) -> Result<Pose, HeadError> {
    Ok(match linkage {
        LinkageSpec::Rigid { base_from_head }
        | LinkageSpec::Actuated { base_from_head, .. }
        | LinkageSpec::Suspension { base_from_head, .. } => base_from_head.pose(),
        LinkageSpec::Spring { spring, base_from_spring, head_from_spring, .. } => {
            let length_m = match spring.design().map_err(zsim_dynamics::DynamicsError::from)? {
                SpringDesign::Coil(coil) => coil.free_length_m() + 2.0 * spring.end_length_m()?,
                SpringDesign::Stiffness { length_m, .. } => length_m,
            };
            base_from_spring.pose() * Pose::translation(0.0, 0.0, length_m) * head_from_spring.pose().inverse()
        }
    })
}

/// The modes with their amplitudes in the linear response to the shake; close pairs along the axes.
fn modes(head: &HeadModel, shake: &Shake) -> Vec<ShownMode> {
    let points = GainPoints {
        base_in_base: head.default_points().base_in_base,
        head_in_head: head.body().centre_of_mass_in_head,
    };
    let per_base = head.frequency_response(&points).modal_amplitudes(Axis::Pitch, shake.frequency_of(head));
    let shown = |ExcitedMode { mode, amplitude }: &ExcitedMode| {
        let displayed = displayed_shape(mode);
        ShownMode {
            name: mode_name(mode),
            frequency_hz: mode.frequency_hz,
            details: format!("{:.3} Hz, damping ratio {}", mode.frequency_hz, ratio(mode.damping_ratio)),
            shape: displayed.into(),
            shaken: amplitude.norm() * shake.base_rad() * mode.shape.norm() / displayed.norm(),
        }
    };
    along_axes(head.linear_modes(), per_base.as_slice()).iter().map(shown).collect()
}

fn shake_in_words(head: &HeadModel, shake: &Shake) -> String {
    format!("a nod of the base by {}\u{b0} at {:.2} Hz", shake.pitch_deg, shake.frequency_of(head))
}

fn add_stiffness(document: &mut Document, head: Option<&HeadModel>, report: &SpringReport) {
    if let (Some(stiffness), Some(head)) = (&report.stiffness, head) {
        let [x, y, z] = centre_mm(head);
        document.heading("Stiffness of the head at rest");
        document.add(stiffness_table(stiffness));
        document.add_detail(format!(
            "Reference point: the centre of mass of the head, at rest at {x:.1}, {y:.1}, {z:.1} mm in the base. Axes of the \
             base. Force (N) and moment (N m) in a row by displacement (m) and rotation (rad) in a column. Gravity included."
        ));
    }
    if let Some(at_top) = report.coil.as_ref().and_then(|coil| coil.stiffness_at_top.as_ref()) {
        document.heading("Stiffness of the spring under its load");
        document.add_detail(stiffness_table(at_top));
        document.add_detail(
            "Reference point: the top of the spring on its axis, guided under the load, with the foot clamped. Axes of the \
             spring, z from foot to top; the wire begins on x, or at `start_deg` from it. Gravity not included.",
        );
    }
}

/// The centre of mass at rest in the base, mm, without negative zeros.
fn centre_mm(head: &HeadModel) -> [f64; 3] {
    let centre = head.base_from_head_at_rest() * nalgebra::Point3::from(head.body().centre_of_mass_in_head);
    Vector::from(centre.coords).map(|m| (m * 1e4).round() * 0.1 + 0.0).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_dynamics::{LinkageSpec, SpringMassSpec, load};

    #[test]
    fn a_nod_at_the_rocking_frequency_excites_rocking_about_y_only_as_far_as_damping_allows() {
        let (mut spec, source) = load("handheld").unwrap();
        let LinkageSpec::Spring { spring_mass, .. } = &mut spec.linkage else { panic!("not on a spring") };
        *spring_mass = SpringMassSpec::Neglected;
        let head = HeadModel::new(&spec, &source).unwrap();
        let rocking_hz = head.linear_modes()[0].frequency_hz;
        let shown = modes(&head, &Shake { pitch_deg: 2.0, frequency_hz: Some(rocking_hz) });
        let turn_deg = |name: &str| {
            let mode = shown.iter().find(|mode| mode.name == name).unwrap();
            (mode.shaken * Vector::from_column_slice(&mode.shape[3..]).norm()).to_degrees()
        };
        // Mode: rotation a about y and displacement 0.131 a of the centre, 0.1826 m above the foot; m = 0.35 kg, I about the
        // centre 5.874e-4 kg m^2 from the three blocks. Modal mass m 0.131^2 + I = 6.594e-3. A nod b moves the centre by
        // 0.1826 b and tilts the supporting force m g: with w = 2 pi 1.25 and the damping ratio 0.08 the amplitude is
        // ((m 0.131 0.1826 + I) w^2 + 0.131 m g) / (6.594e-3 w^2 2 0.08) b = 15.33 b.
        let rocking_deg = turn_deg("rocking about y");
        assert!((rocking_deg / 30.66 - 1.0).abs() < 0.03, "{rocking_deg}");
        for name in ["rocking about x", "yaw about z", "sway along y"] {
            assert!(turn_deg(name) < 0.02 * rocking_deg, "{name}: {}", turn_deg(name));
        }
    }
}
