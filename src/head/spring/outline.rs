//! Outlines of the linkage and the parts of a head, for the plot of the modes.

use super::Wire;
use super::view_plane::{Polyline, ViewPlane};
use std::f64::consts::TAU;
use zsim_base::geometry::{Pose, Vector};
use zsim_dynamics::{ElementSpec, LinkageSpec, PartSpec};
use zsim_elasticity::{SpringDesign, SpringSpec};

/// Number of segments of the drawing of a spring.
const POINTS: usize = 240;

/// An element of a linkage to draw. Floats are omitted, because they are parts of the head.
pub(super) enum Link {
    /// A spring.
    Spring(SpringOutline),
    /// A straight line: a cord, or the link from a joint to the head.
    Straight { foot: Vector, top_in_head: Vector },
}

/// A spring to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpringOutline {
    pub foot: Pose,
    pub head_from_top: Pose,
    /// Mean radius, m; 0 for a spring specified by stiffness, of which only the axis is drawn.
    pub radius_m: f64,
    /// Radius of the wire, m.
    pub wire_radius_m: f64,
    /// Number of coils, with those at the ends.
    pub coils: f64,
}

impl Link {
    /// All elements of a linkage to draw.
    pub fn all(linkage: &LinkageSpec) -> Vec<Self> {
        match linkage {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => Vec::new(),
            LinkageSpec::Spring { spring, base_from_spring, head_from_spring, .. } => {
                vec![Self::Spring(SpringOutline::new(spring, base_from_spring.pose(), head_from_spring.pose()))]
            }
            LinkageSpec::Suspension { elements, .. } => elements.iter().filter_map(Self::of).collect(),
        }
    }

    fn of(element: &ElementSpec) -> Option<Self> {
        match element {
            ElementSpec::Spring(mounted) => {
                let (foot, top) = (mounted.base_from_spring.pose(), mounted.head_from_spring.pose());
                Some(Self::Spring(SpringOutline::new(&mounted.spring, foot, top)))
            }
            ElementSpec::Cord(cord) => {
                Some(Self::Straight { foot: cord.base_point_m.into(), top_in_head: cord.head_point_m.into() })
            }
            ElementSpec::UniversalJoint(joint) => {
                let foot = joint.base_from_joint.pose().translation.vector;
                Some(Self::Straight { foot, top_in_head: Vector::zeros() })
            }
            ElementSpec::Float(_) => None,
        }
    }

    /// The spring, if it is one.
    pub fn spring(self) -> Option<SpringOutline> {
        if let Self::Spring(spring) = self { Some(spring) } else { None }
    }

    /// The outline in the view plane, with the head at this pose in the base.
    pub fn outline(&self, head: &Pose, plane: &ViewPlane) -> Polyline {
        let mut line = vec![(f64::NAN, f64::NAN)];
        match self {
            Self::Spring(spring) if plane.from_above => line.extend(spring.top_circle(head, plane)),
            Self::Spring(spring) => line.extend(spring.wire(head, plane)),
            Self::Straight { foot, top_in_head } => {
                let top = head * nalgebra::Point3::from(*top_in_head);
                line.extend([plane.project(foot), plane.project(&top.coords)]);
            }
        }
        line
    }

    /// In side view, a line at the attachment to the base, 1.5 times as wide as the spring.
    pub fn foot_line(&self, plane: &ViewPlane) -> Polyline {
        if plane.from_above {
            return Vec::new();
        }
        let (foot, half) = match self {
            Self::Spring(spring) => (spring.foot, 1.5 * spring.radius_m.max(0.01)),
            Self::Straight { foot, .. } => (Pose::from_parts((*foot).into(), Default::default()), 0.01),
        };
        let end = |x: f64| plane.project(&(foot * nalgebra::Point3::from(plane.right * x)).coords);
        vec![(f64::NAN, f64::NAN), end(-half), end(half)]
    }
}

impl SpringOutline {
    fn new(spring: &SpringSpec, foot: Pose, head_from_top: Pose) -> Self {
        // The spec is valid at this point, so errors cannot occur.
        let wire = Wire::of(spring).ok().flatten();
        let coil = match spring.design() {
            Ok(SpringDesign::Coil(coil)) => Some(coil),
            _ => None,
        };
        let axis_only = Self { foot, head_from_top, radius_m: 0.0, wire_radius_m: 0.0, coils: 0.0 };
        wire.zip(coil).map_or(axis_only, |(wire, coil)| Self {
            radius_m: wire.coil_radius_m,
            wire_radius_m: 0.5 * wire.diameter_m,
            coils: coil.solid_length_m() / wire.diameter_m,
            ..axis_only
        })
    }

    /// The circle of the spring at its top end.
    fn top_circle(&self, head: &Pose, plane: &ViewPlane) -> Polyline {
        let top = head * self.head_from_top;
        let point = |k: usize| {
            let (sin, cos) = (k as f64 / POINTS as f64 * TAU).sin_cos();
            plane.project(&(top * nalgebra::Point3::new(cos * self.radius_m, sin * self.radius_m, 0.0)).coords)
        };
        (0..=POINTS).map(point).collect()
    }

    /// The wire in side view, around a cubic Hermite curve from the foot to the top, tangential to the end axes.
    fn wire(&self, head: &Pose, plane: &ViewPlane) -> Polyline {
        let top = head * self.head_from_top;
        let (p, q) = (self.foot.translation.vector, top.translation.vector);
        let length = (q - p).norm();
        let (foot_tangent, top_tangent) =
            (self.foot.rotation * Vector::z() * length, top.rotation * Vector::z() * length);
        let axis = |u: f64| {
            let centre = p * ((1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u)) + q * (u * u * (3.0 - 2.0 * u));
            plane.project(&(centre + foot_tangent * (u * (1.0 - u) * (1.0 - u)) + top_tangent * (u * u * (u - 1.0))))
        };
        let point = |k: usize| {
            let u = k as f64 / POINTS as f64;
            let (x, y) = axis(u);
            let ((x0, y0), (x1, y1)) = (axis((u - 1e-3).max(0.0)), axis((u + 1e-3).min(1.0)));
            let step = (x1 - x0).hypot(y1 - y0).max(f64::MIN_POSITIVE);
            let out = self.radius_m * 1e3 * (u * self.coils * TAU).sin() / step;
            (x + out * (y1 - y0), y - out * (x1 - x0))
        };
        (0..=POINTS).map(point).collect()
    }
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
