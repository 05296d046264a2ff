//! Plot of the mode shapes.

use super::outline::{Polyline, ViewPlane, edges, foot_line, outline};
use zsim_base::geometry::{Pose, Rotation};
use zsim_dynamics::{HeadModel, HeadSpec, Mode};
use zsim_elasticity::{Vector6, split};
use zsim_report::capitalised;
use zsim_report::page::links;
use zsim_report::plot::{Chart, Colour, Figure, Mark, Series};

/// Displayed amplitude: rotation in rad, or translation in units of 0.1 m.
const DISPLAYED_AMPLITUDE: f64 = 0.3;

/// The shape of a mode with a rotation of 1 rad or a translation of 0.1 m, whichever is reached first.
pub(super) fn displayed_shape(mode: &Mode) -> Vector6 {
    let (shift, turn) = split(&mode.shape);
    mode.shape / turn.norm().max(10.0 * shift.norm()).max(f64::MIN_POSITIVE)
}

/// Plots the mode shapes, slowest first, at the same scale.
///
/// Each chart is a side view in the plane of the mode; yaw is a top view. The rest pose is grey, the displaced pose is
/// coloured. The figure is empty for a head without modes.
pub fn mode_figure(spec: &HeadSpec, head: &HeadModel) -> Figure {
    let drawings: Vec<ModeDrawing> =
        head.linear_modes().iter().map(|mode| ModeDrawing::of(spec, head, *mode)).collect();
    let extent = |drawing: &ModeDrawing| {
        let points = [&drawing.rest, &drawing.moved, &drawing.base].into_iter().flatten();
        points.filter(|(x, y)| x.is_finite() && y.is_finite()).fold([(0.0, 0.0); 2], |ends, (x, y)| {
            let with = |(low, high): (f64, f64), value: f64| (f64::min(low, value), f64::max(high, value));
            [with(ends[0], *x), with(ends[1], *y)]
        })
    };
    let all = drawings.iter().map(extent).fold([(0.0, 0.0); 2], |all, [x, y]: [(f64, f64); 2]| {
        [(f64::min(all[0].0, x.0), f64::max(all[0].1, x.1)), (f64::min(all[1].0, y.0), f64::max(all[1].1, y.1))]
    });
    // All charts have the size of the largest drawing plus a margin in mm; a top view is centred.
    let (wide, high) = (all[0].1.max(-all[0].0) + 15.0, all[1].1 - all[1].0 + 30.0);
    let panels = drawings.into_iter().map(|drawing| {
        let y = if drawing.from_above { (-0.5 * high, 0.5 * high) } else { (all[1].0 - 15.0, all[1].1 + 15.0) };
        let chart = Chart::new(&drawing.title, &drawing.labels.0, &drawing.labels.1).as_map().between((-wide, wide), y);
        chart
            .with(Series::line("", Colour::Backdrop, drawing.rest).marked(Mark::Line(1.2)))
            .with(Series::line("", Colour::Estimate, drawing.moved).marked(Mark::Line(1.2)))
            .with(Series::line("", Colour::Truth, drawing.base).marked(Mark::Line(3.0)))
    });
    Figure::of(panels.collect()).in_columns(3)
}

/// Drawing of a mode in the view plane.
struct ModeDrawing {
    title: String,
    /// Labels of the x and y axes.
    labels: (String, String),
    from_above: bool,
    rest: Polyline,
    moved: Polyline,
    /// Attachments of springs and cords to the base.
    base: Polyline,
}

impl ModeDrawing {
    fn of(spec: &HeadSpec, head: &HeadModel, mode: Mode) -> Self {
        let rest = *head.base_from_head_at_rest();
        let (shift, turn) = split(&(displayed_shape(&mode) * DISPLAYED_AMPLITUDE));
        let centre = (rest * nalgebra::Point3::from(head.body().centre_of_mass_in_head)).coords;
        let rotation = Rotation::from_scaled_axis(turn);
        let moved = Pose::from_parts((centre + shift - rotation * centre).into(), rotation);
        let plane = ViewPlane::of(mode.kind, &shift, &turn);
        let links = links::of(&spec.linkage);
        let outline = |head: &Pose| {
            let mut line: Polyline = links.iter().flat_map(|link| outline(link, head, &plane)).collect();
            for part in &spec.parts {
                line.push((f64::NAN, f64::NAN));
                line.extend(edges(part, &plane).map(|corner| plane.project(&(head * corner).coords)));
            }
            line
        };
        Self {
            title: format!(
                "{} {:.2} Hz, damping ratio {}",
                capitalised(mode.kind.name()),
                mode.frequency_hz,
                ratio(mode.damping_ratio)
            ),
            labels: plane.labels(),
            from_above: plane.from_above,
            rest: outline(&rest),
            moved: outline(&(moved * rest)),
            base: links.iter().flat_map(|link| foot_line(link, &plane)).collect(),
        }
    }
}

/// Formats a damping ratio with significant decimals.
pub(super) fn ratio(ratio: f64) -> String {
    if ratio < 0.01 { format!("{ratio:.4}") } else { format!("{ratio:.3}") }
}
