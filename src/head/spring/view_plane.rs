//! View plane of a drawing of a head.

use zsim_base::geometry::Vector;
use zsim_dynamics::ModeKind;

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
