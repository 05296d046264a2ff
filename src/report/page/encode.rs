//! Encodes the data of the page as JSON with binary arrays in base64 (RFC 4648).

use super::binary::base64_f32;
use super::data::{
    Abscissa, Block, Chart, ChartGroup, Curve, CurveStyle, Link, Ordinate, RunPage, Section, ShownMode, SpringView,
    TimedPose, TimelineRow, View,
};
use super::quantise::cloud;
use serde_json::{Value, json};
use zsim_base::geometry::{Pose, Vector};

/// The data of a run as JSON that is inert within a `<script>` element: it has no `<`, `>` or `&`.
pub(super) fn run_json(page: &RunPage) -> String {
    let charts: Vec<Value> = page.charts.iter().map(chart_group).collect();
    let timeline: Vec<Value> = page.timeline.iter().map(timeline_row).collect();
    inert(&document(&page.view, &charts, &timeline).to_string())
}

/// The data of a page with a view only, as [`run_json`].
pub(super) fn view_json(view: &View) -> String {
    inert(&self::view(view).to_string())
}

/// The data of a view only.
pub(super) fn view(view: &View) -> Value {
    document(view, &[], &[])
}

/// The data of a page with charts only, as [`run_json`].
pub(super) fn charts_json<'a>(charts: impl Iterator<Item = &'a ChartGroup>) -> String {
    inert(&json!({ "charts": charts.map(chart_group).collect::<Vec<_>>() }).to_string())
}

/// The data of the page of a spring, as [`run_json`].
pub(super) fn spring_json(view: &SpringView) -> String {
    let mode = |mode: &ShownMode| json!({ "frequency": mode.frequency_hz, "shape": mode.shape, "shaken": mode.shaken });
    let document = json!({
        "parts": view.parts.iter().map(block).collect::<Vec<_>>(),
        "links": view.links.iter().map(link).collect::<Vec<_>>(),
        "rest": seven(&view.base_from_head),
        "centre": numbers(&view.centre_in_base),
        "modes": view.modes.iter().map(mode).collect::<Vec<_>>(),
    });
    inert(&document.to_string())
}

fn document(view: &View, charts: &[Value], timeline: &[Value]) -> Value {
    json!({
        "cloud": cloud(&view.points),
        "materials": view.materials,
        "estimate": path(&view.estimate),
        "truth": path(&view.truth),
        "base": path(&view.base),
        "surfaces": base64_f32(view.surfaces.iter().flatten().flat_map(|corner| corner.iter().copied())),
        "surfaceMaterials": view.surface_materials,
        "surfacesArePartial": view.surfaces_are_partial,
        "links": view.links.iter().map(link).collect::<Vec<_>>(),
        "parts": view.parts.iter().map(block).collect::<Vec<_>>(),
        "charts": charts,
        "timeline": timeline,
    })
}

/// Escapes the characters that end a script element or start a comment in it, and line ends that scripts do not allow.
pub(super) fn inert(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => text += &format!("\\u{:04x}", u32::from(c)),
            _ => text.push(c),
        }
    }
    text
}

/// Times; positions and quaternions, seven numbers a pose.
pub(super) fn path(poses: &[TimedPose]) -> Value {
    json!({
        "t": base64_f32(poses.iter().map(|timed| timed.t_s)),
        "pose": base64_f32(poses.iter().flat_map(|timed| seven(&timed.pose))),
    })
}

/// Position x, y, z and quaternion x, y, z, w.
fn seven(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

pub(super) fn numbers(v: &Vector) -> [f64; 3] {
    [v.x, v.y, v.z]
}

fn block(block: &Block) -> Value {
    json!({ "centre": numbers(&block.centre_in_head), "size": numbers(&block.size_m) })
}

fn link(link: &Link) -> Value {
    match link {
        Link::Spring { base_from_foot, head_from_top, coil_radius_m, wire_diameter_m, coils } => json!({
            "foot": seven(base_from_foot), "top": seven(head_from_top), "radius": coil_radius_m,
            "wire": wire_diameter_m, "coils": coils,
        }),
        Link::Straight { point_in_base, point_in_head } => {
            json!({ "from": numbers(point_in_base), "to": numbers(point_in_head) })
        }
    }
}

fn chart_group(group: &ChartGroup) -> Value {
    let section = match group.section {
        Section::Axis(name) => name,
        Section::Errors => "errors",
        Section::Clock => "clock",
        Section::Matching => "matching",
        Section::Timing => "timing",
        Section::Motion => "motion",
    };
    json!({ "section": section, "charts": group.charts.iter().map(chart).collect::<Vec<_>>() })
}

fn chart(chart: &Chart) -> Value {
    json!({
        "title": chart.title,
        "label": chart.label,
        "abscissa": match chart.abscissa {
            Abscissa::Time => "time",
            Abscissa::Frequency => "frequency",
        },
        "ordinate": match chart.ordinate {
            Ordinate::Linear => "linear",
            Ordinate::Logarithmic => "logarithmic",
            Ordinate::Degrees => "degrees",
        },
        "x": base64_f32(chart.x.iter().copied()),
        "curves": chart.curves.iter().map(curve).collect::<Vec<_>>(),
    })
}

fn curve(curve: &Curve) -> Value {
    let style = match curve.style {
        CurveStyle::Estimate => "estimate",
        CurveStyle::Truth => "truth",
        CurveStyle::Second => "second",
        CurveStyle::Bound => "bound",
        CurveStyle::BandTop => "band-top",
        CurveStyle::BandBottom => "band-bottom",
        CurveStyle::Limit => "limit",
        CurveStyle::Measured => "measured",
        CurveStyle::Model => "model",
    };
    json!({ "name": curve.name, "style": style, "y": base64_f32(curve.values.iter().copied()) })
}

fn timeline_row(row: &TimelineRow) -> Value {
    let events = row.events.iter().map(|event| json!([event.from_s, event.to_s, event.sentence]));
    json!({ "name": row.name, "level": row.severity.name(), "events": events.collect::<Vec<_>>() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_in_a_script_element_cannot_end_it() {
        let hostile = "</script><script>alert(1)</script><!-- & \u{2028}";
        let text = inert(&serde_json::to_string(hostile).unwrap());
        assert!(!text.contains(['<', '>', '&', '\u{2028}']), "{text}");
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), hostile);
    }

    #[test]
    fn numbers_are_little_endian_base64() {
        // 1.0 is 3f800000 and -2.0 is c0000000 in IEEE 754; their bytes are 00 00 80 3f 00 00 00 c0.
        assert_eq!(base64_f32([1.0, -2.0].into_iter()), "AACAPwAAAMA=");
    }
}
