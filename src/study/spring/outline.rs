//! Outlines of what holds a head, and of the head's parts.

use super::Wire;
use super::figure::{Line, Paper};
use crate::dynamics::{ElementSpec, LinkageSpec, PartSpec};
use crate::elasticity::{SpringDesign, SpringSpec};
use crate::geometry::{Pose, Vector};
use std::f64::consts::TAU;

/// Points along the picture of a spring.
const POINTS: usize = 240;

/// An element of a linkage as it is drawn. A float is one of the head's parts already.
pub(super) enum Link {
    Coiled(Coiled),
    /// A straight line: a cord, or from a joint to the head.
    Straight {
        foot: Vector,
        top_in_head: Vector,
    },
}

/// A spring as it is drawn.
pub(super) struct Coiled {
    foot: Pose,
    head_from_top: Pose,
    /// Mean radius, m; nothing for a spring known by its stiffness, of which the axis is drawn.
    radius_m: f64,
    coils: f64,
}

impl Link {
    /// What is drawn of a linkage.
    pub fn all(linkage: &LinkageSpec) -> Vec<Self> {
        match linkage {
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => Vec::new(),
            LinkageSpec::Spring { spring, base_from_spring, head_from_spring, .. } => {
                vec![Self::Coiled(Coiled::new(spring, base_from_spring.pose(), head_from_spring.pose()))]
            }
            LinkageSpec::Suspension { elements, .. } => elements.iter().filter_map(Self::of).collect(),
        }
    }

    fn of(element: &ElementSpec) -> Option<Self> {
        match element {
            ElementSpec::Spring(mounted) => {
                let (foot, top) = (mounted.base_from_spring.pose(), mounted.head_from_spring.pose());
                Some(Self::Coiled(Coiled::new(&mounted.spring, foot, top)))
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

    /// It on paper, the head at this pose in the base.
    pub fn outline(&self, head: &Pose, paper: &Paper) -> Line {
        let mut line = vec![(f64::NAN, f64::NAN)];
        match self {
            Self::Coiled(spring) if paper.from_above => line.extend(spring.rim(head, paper)),
            Self::Coiled(spring) => line.extend(spring.wire(head, paper)),
            Self::Straight { foot, top_in_head } => {
                let top = head * nalgebra::Point3::from(*top_in_head);
                line.extend([paper.at(foot), paper.at(&top.coords)]);
            }
        }
        line
    }

    /// From the side, a line where it is fastened to the base, as wide as a spring and half of that more.
    pub fn foot_line(&self, paper: &Paper) -> Line {
        if paper.from_above {
            return Vec::new();
        }
        let (foot, half) = match self {
            Self::Coiled(spring) => (spring.foot, 1.5 * spring.radius_m.max(0.01)),
            Self::Straight { foot, .. } => (Pose::from_parts((*foot).into(), Default::default()), 0.01),
        };
        let end = |x: f64| paper.at(&(foot * nalgebra::Point3::from(paper.right * x)).coords);
        vec![(f64::NAN, f64::NAN), end(-half), end(half)]
    }
}

impl Coiled {
    fn new(spring: &SpringSpec, foot: Pose, head_from_top: Pose) -> Self {
        // The spec has been checked: a spring that is none is not drawn.
        let wire = Wire::of(spring).ok().flatten();
        let coil = match spring.design() {
            Ok(SpringDesign::Coil(coil)) => Some(coil),
            _ => None,
        };
        let (radius_m, coils) = wire
            .zip(coil)
            .map_or((0.0, 0.0), |(wire, coil)| (wire.coil_radius_m, coil.solid_length_m() / wire.diameter_m));
        Self { foot, head_from_top, radius_m, coils }
    }

    /// Its top's rim.
    fn rim(&self, head: &Pose, paper: &Paper) -> Line {
        let top = head * self.head_from_top;
        let place = |k: usize| {
            let (sin, cos) = (k as f64 / POINTS as f64 * TAU).sin_cos();
            paper.at(&(top * nalgebra::Point3::new(cos * self.radius_m, sin * self.radius_m, 0.0)).coords)
        };
        (0..=POINTS).map(place).collect()
    }

    /// Its wire from the side, about a cubic from the foot to the top that leaves both along their axes.
    fn wire(&self, head: &Pose, paper: &Paper) -> Line {
        let top = head * self.head_from_top;
        let (p, q) = (self.foot.translation.vector, top.translation.vector);
        let length = (q - p).norm();
        let (leave, arrive) = (self.foot.rotation * Vector::z() * length, top.rotation * Vector::z() * length);
        let axis = |u: f64| {
            let place = p * ((1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u)) + q * (u * u * (3.0 - 2.0 * u));
            paper.at(&(place + leave * (u * (1.0 - u) * (1.0 - u)) + arrive * (u * u * (u - 1.0))))
        };
        let place = |k: usize| {
            let u = k as f64 / POINTS as f64;
            let (x, y) = axis(u);
            let ((x0, y0), (x1, y1)) = (axis((u - 1e-3).max(0.0)), axis((u + 1e-3).min(1.0)));
            let step = (x1 - x0).hypot(y1 - y0).max(f64::MIN_POSITIVE);
            let out = self.radius_m * 1e3 * (u * self.coils * TAU).sin() / step;
            (x + out * (y1 - y0), y - out * (x1 - x0))
        };
        (0..=POINTS).map(place).collect()
    }
}

/// The corners of a part's outline on paper, closed.
pub(super) fn edges(part: &PartSpec, paper: &Paper) -> impl Iterator<Item = nalgebra::Point3<f64>> {
    let (size, centre) = match part {
        PartSpec::Block { size_m, centre_m, .. } => (Vector::from(*size_m) * 0.5, Vector::from(*centre_m)),
        PartSpec::Body { centre_of_mass_m, .. } => (Vector::repeat(0.005), Vector::from(*centre_of_mass_m)),
    };
    let (right, up) = (paper.right, paper.up);
    let (wide, high) = (size.dot(&right.abs()), size.dot(&up.abs()));
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]
        .into_iter()
        .map(move |(x, y)| nalgebra::Point3::from(centre + right * (x * wide) + up * (y * high)))
}
