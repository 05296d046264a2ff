//! A picture of the modes.

use super::outline::{Link, edges};
use crate::dynamics::{HeadModel, HeadSpec, Mode, ModeKind};
use crate::elasticity::split;
use crate::geometry::{Pose, Rotation, Vector};
use crate::report::plot::{Chart, Colour, Figure, Mark, Series};

/// How far the picture's head is turned, rad, or moved, in parts of this times a tenth of a metre.
const SHOWN: f64 = 0.3;

/// A line on paper, mm; broken where it is no number.
pub(super) type Line = Vec<(f64, f64)>;

/// The modes beside each other, slowest first, all to one scale: each from the side in its own plane, yaw from above.
/// Grey at rest, coloured at one end of its swing. A head that does not move has none.
pub fn mode_figure(spec: &HeadSpec, head: &HeadModel) -> Figure {
    let pictures: Vec<Picture> = head.linear_modes().iter().map(|mode| Picture::of(spec, head, *mode)).collect();
    let ends = |picture: &Picture| {
        let points = [&picture.rest, &picture.moved, &picture.base].into_iter().flatten();
        points.filter(|(x, y)| x.is_finite() && y.is_finite()).fold([(0.0, 0.0); 2], |ends, (x, y)| {
            let with = |(low, high): (f64, f64), value: f64| (f64::min(low, value), f64::max(high, value));
            [with(ends[0], *x), with(ends[1], *y)]
        })
    };
    let all = pictures.iter().map(ends).fold([(0.0, 0.0); 2], |all, [x, y]: [(f64, f64); 2]| {
        [(f64::min(all[0].0, x.0), f64::max(all[0].1, x.1)), (f64::min(all[1].0, y.0), f64::max(all[1].1, y.1))]
    });
    // Every panel is as wide and as high as the largest picture, with a margin; one from above is centred.
    let (wide, high) = (all[0].1.max(-all[0].0) + 15.0, all[1].1 - all[1].0 + 30.0);
    let panels = pictures.into_iter().map(|picture| {
        let y = if picture.from_above { (-0.5 * high, 0.5 * high) } else { (all[1].0 - 15.0, all[1].1 + 15.0) };
        let chart = Chart::new(&picture.title, &picture.labels.0, &picture.labels.1).as_map().between((-wide, wide), y);
        chart
            .with(Series::line("", Colour::Backdrop, picture.rest).marked(Mark::Line(1.2)))
            .with(Series::line("", Colour::Estimate, picture.moved).marked(Mark::Line(1.2)))
            .with(Series::line("", Colour::Truth, picture.base).marked(Mark::Line(3.0)))
    });
    Figure::of(panels.collect()).in_columns(3)
}

/// What a kind of mode is called.
fn kind_name(kind: ModeKind) -> &'static str {
    match kind {
        ModeKind::Rocking => "Rocking",
        ModeKind::Sway => "Sway",
        ModeKind::Bounce => "Bounce",
        ModeKind::Yaw => "Yaw",
    }
}

/// A mode on paper.
struct Picture {
    title: String,
    /// Of abscissa and ordinate.
    labels: (String, String),
    from_above: bool,
    rest: Line,
    moved: Line,
    /// Where springs and cords are fastened to the base.
    base: Line,
}

impl Picture {
    fn of(spec: &HeadSpec, head: &HeadModel, mode: Mode) -> Self {
        let rest = *head.rest_pose_base_from_head();
        let (shift, turn) = split(&mode.shape);
        let scale = SHOWN / turn.norm().max(10.0 * shift.norm()).max(f64::MIN_POSITIVE);
        let centre = (rest * nalgebra::Point3::from(head.body().centre_of_mass_in_head)).coords;
        let rotation = Rotation::from_scaled_axis(turn * scale);
        let moved = Pose::from_parts((centre + shift * scale - rotation * centre).into(), rotation);
        let paper = Paper::of(mode.kind, &shift, &turn);
        let links = Link::all(&spec.linkage);
        let outline = |head: &Pose| {
            let mut line: Line = links.iter().flat_map(|link| link.outline(head, &paper)).collect();
            for part in &spec.parts {
                line.push((f64::NAN, f64::NAN));
                line.extend(edges(part, &paper).map(|corner| paper.at(&(head * corner).coords)));
            }
            line
        };
        Self {
            title: format!("{} {:.2} Hz, ratio {}", kind_name(mode.kind), mode.frequency_hz, ratio(mode.damping_ratio)),
            labels: paper.labels(),
            from_above: paper.from_above,
            rest: outline(&rest),
            moved: outline(&(moved * rest)),
            base: links.iter().flat_map(|link| link.foot_line(&paper)).collect(),
        }
    }
}

/// A damping ratio in the digits that count.
fn ratio(ratio: f64) -> String {
    if ratio < 0.01 { format!("{ratio:.4}") } else { format!("{ratio:.3}") }
}

/// The plane of a picture.
pub(super) struct Paper {
    pub right: Vector,
    pub up: Vector,
    pub from_above: bool,
}

impl Paper {
    /// Bending is seen across its axis of turn, or along its shift where it hardly turns; yaw from above.
    fn of(kind: ModeKind, shift: &Vector, turn: &Vector) -> Self {
        let from_above = kind == ModeKind::Yaw;
        let level = if turn.xy().norm() > 10.0 * shift.xy().norm() {
            Vector::new(turn.y, -turn.x, 0.0)
        } else {
            Vector::new(shift.x, shift.y, 0.0)
        };
        let is_bending = matches!(kind, ModeKind::Rocking | ModeKind::Sway) && level.norm() > 1e-9;
        let right = if is_bending { level.normalize() } else { Vector::x() };
        // Along the positive axis that is nearer.
        let right = if right[right.iamax()] < 0.0 { -right } else { right };
        Self { right, up: if from_above { Vector::y() } else { Vector::z() }, from_above }
    }

    /// A place on it, mm.
    pub fn at(&self, place: &Vector) -> (f64, f64) {
        (self.right.dot(place) * 1e3, self.up.dot(place) * 1e3)
    }

    fn labels(&self) -> (String, String) {
        let across = match (self.right.x, self.right.y) {
            (x, _) if x > 0.999 => "x (mm)".to_owned(),
            (_, y) if y > 0.999 => "y (mm)".to_owned(),
            (x, y) => format!("Along {:.0}\u{b0} from x (mm)", y.atan2(x).to_degrees()),
        };
        (across, if self.from_above { "y (mm)" } else { "z (mm)" }.to_owned())
    }
}
