//! Outlines of the linkage and the parts of a head, for the plot of the modes, and the plane of their view.

use std::f64::consts::TAU;
use zsim_base::geometry::{Pose, Vector};
use zsim_dynamics::{ModeKind, PartSpec};
use zsim_report::page::{CoilLink, Link};

/// Number of segments of the drawing of a spring.
const POINTS: usize = 240;

/// The outline of a link in the view plane, with the head at this pose in the base.
pub(super) fn outline(link: &Link, head: &Pose, plane: &ViewPlane) -> Polyline {
    let mut line = vec![(f64::NAN, f64::NAN)];
    match link {
        Link::Spring(spring) if plane.from_above => line.extend(top_circle(spring, head, plane)),
        Link::Spring(spring) => line.extend(wire(spring, head, plane)),
        Link::Straight { point_in_base, point_in_head } => {
            let top = head * nalgebra::Point3::from(*point_in_head);
            line.extend([plane.project(point_in_base), plane.project(&top.coords)]);
        }
    }
    line
}

/// In side view, a line at the attachment of a link to the base, 1.5 times as wide as the spring.
pub(super) fn foot_line(link: &Link, plane: &ViewPlane) -> Polyline {
    if plane.from_above {
        return Vec::new();
    }
    let (foot, half) = match link {
        Link::Spring(spring) => (spring.base_from_foot, 1.5 * radius_m(spring).max(0.01)),
        Link::Straight { point_in_base, .. } => (Pose::from_parts((*point_in_base).into(), Default::default()), 0.01),
    };
    let end = |x: f64| plane.project(&(foot * nalgebra::Point3::from(plane.right * x)).coords);
    vec![(f64::NAN, f64::NAN), end(-half), end(half)]
}

/// Mean radius of a spring, m; 0 for one specified by its stiffness, of which only the axis is drawn.
fn radius_m(spring: &CoilLink) -> f64 {
    if spring.is_assumed { 0.0 } else { spring.coil_radius_m }
}

/// The circle of the spring at its top end.
fn top_circle(spring: &CoilLink, head: &Pose, plane: &ViewPlane) -> Polyline {
    let top = head * spring.head_from_top;
    let point = |k: usize| {
        let (sin, cos) = (k as f64 / POINTS as f64 * TAU).sin_cos();
        plane.project(&(top * nalgebra::Point3::new(cos * radius_m(spring), sin * radius_m(spring), 0.0)).coords)
    };
    (0..=POINTS).map(point).collect()
}

/// The wire in side view, around a cubic Hermite curve from the foot to the top, tangential to the end axes.
fn wire(spring: &CoilLink, head: &Pose, plane: &ViewPlane) -> Polyline {
    let top = head * spring.head_from_top;
    let (p, q) = (spring.base_from_foot.translation.vector, top.translation.vector);
    let length = (q - p).norm();
    let (foot_tangent, top_tangent) =
        (spring.base_from_foot.rotation * Vector::z() * length, top.rotation * Vector::z() * length);
    let axis = |u: f64| {
        let centre = p * ((1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u)) + q * (u * u * (3.0 - 2.0 * u));
        plane.project(&(centre + foot_tangent * (u * (1.0 - u) * (1.0 - u)) + top_tangent * (u * u * (u - 1.0))))
    };
    let point = |k: usize| {
        let u = k as f64 / POINTS as f64;
        let (x, y) = axis(u);
        let ((x0, y0), (x1, y1)) = (axis((u - 1e-3).max(0.0)), axis((u + 1e-3).min(1.0)));
        let step = (x1 - x0).hypot(y1 - y0).max(f64::MIN_POSITIVE);
        let out = radius_m(spring) * 1e3 * (u * spring.coils * TAU).sin() / step;
        (x + out * (y1 - y0), y - out * (x1 - x0))
    };
    (0..=POINTS).map(point).collect()
}

/// The corners of the closed outline of a part in the view plane, in the head frame.
pub(super) fn edges(part: &PartSpec, plane: &ViewPlane) -> impl Iterator<Item = nalgebra::Point3<f64>> {
    let (size, centre) = match part {
        PartSpec::Block { size_m, centre_m, .. } => (Vector::from(*size_m) * 0.5, Vector::from(*centre_m)),
        PartSpec::Body { centre_of_mass_m, .. } => (Vector::repeat(0.005), Vector::from(*centre_of_mass_m)),
    };
    let (right, up) = (plane.right, plane.up);
    let (wide, high) = (size.dot(&right.abs()), size.dot(&up.abs()));
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]
        .into_iter()
        .map(move |(x, y)| nalgebra::Point3::from(centre + right * (x * wide) + up * (y * high)))
}

/// A polyline in the view plane, mm; NaN interrupts it.
pub(super) type Polyline = Vec<(f64, f64)>;

/// View plane of a drawing, in the base frame.
pub(super) struct ViewPlane {
    pub right: Vector,
    pub up: Vector,
    pub from_above: bool,
}

impl ViewPlane {
    /// The plane of a mode: perpendicular to its rotation axis, or along its translation if it hardly rotates.
    ///
    /// Yaw is viewed from above.
    pub fn of(kind: ModeKind, shift: &Vector, turn: &Vector) -> Self {
        let from_above = kind == ModeKind::Yaw;
        let level = if turn.xy().norm() > 10.0 * shift.xy().norm() {
            Vector::new(turn.y, -turn.x, 0.0)
        } else {
            Vector::new(shift.x, shift.y, 0.0)
        };
        let is_bending = matches!(kind, ModeKind::Rocking | ModeKind::Sway) && level.norm() > 1e-9;
        let right = if is_bending { level.normalize() } else { Vector::x() };
        // Orient the plane along the closer positive axis.
        let right = if right[right.iamax()] < 0.0 { -right } else { right };
        Self { right, up: if from_above { Vector::y() } else { Vector::z() }, from_above }
    }

    /// Projects a point, m, to the plane, mm.
    pub fn project(&self, point: &Vector) -> (f64, f64) {
        (self.right.dot(point) * 1e3, self.up.dot(point) * 1e3)
    }

    pub fn labels(&self) -> (String, String) {
        let across = match (self.right.x, self.right.y) {
            (x, _) if x > 0.999 => "x (mm)".to_owned(),
            (_, y) if y > 0.999 => "y (mm)".to_owned(),
            (x, y) => format!("Along {:.0}\u{b0} from x (mm)", y.atan2(x).to_degrees()),
        };
        (across, if self.from_above { "y (mm)" } else { "z (mm)" }.to_owned())
    }
}
