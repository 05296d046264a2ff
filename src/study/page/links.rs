//! Parts, springs and cords of a head, as the view draws them.

use crate::dynamics::{ElementSpec, LinkageSpec, PartSpec, PlacementSpec};
use crate::elasticity::{SpringDesign, SpringSpec};
use crate::geometry::Vector;
use crate::report::page::{Block, Link};

/// Radius and number of coils with which a spring is drawn if only its stiffness is known.
const ASSUMED_COIL: (f64, f64) = (0.0125, 10.0);

/// The elements between base and head; empty for a rigid or actuated mount.
pub(in crate::study) fn of(linkage: &LinkageSpec) -> Vec<Link> {
    match linkage {
        LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => Vec::new(),
        LinkageSpec::Spring { spring: spec, base_from_spring, head_from_spring, .. } => {
            vec![spring(spec, base_from_spring, head_from_spring)]
        }
        LinkageSpec::Suspension { elements, .. } => elements.iter().filter_map(element).collect(),
    }
}

/// The blocks among the parts of a head; bodies have no shape.
pub(in crate::study) fn blocks(parts: &[PartSpec]) -> Vec<Block> {
    let block = |part: &PartSpec| match part {
        PartSpec::Block { size_m, centre_m, .. } => {
            Some(Block { centre_in_head: Vector::from(*centre_m), size_m: Vector::from(*size_m) })
        }
        PartSpec::Body { .. } => None,
    };
    parts.iter().filter_map(block).collect()
}

fn element(element: &ElementSpec) -> Option<Link> {
    match element {
        ElementSpec::Spring(element) => {
            Some(spring(&element.spring, &element.base_from_spring, &element.head_from_spring))
        }
        ElementSpec::Cord(cord) => Some(Link::Cord {
            point_in_base: Vector::from(cord.base_point_m),
            point_in_head: Vector::from(cord.head_point_m),
        }),
        ElementSpec::Float(_) | ElementSpec::UniversalJoint(_) => None,
    }
}

fn spring(spec: &SpringSpec, base_from_foot: &PlacementSpec, head_from_top: &PlacementSpec) -> Link {
    let coils = match spec.resolved() {
        Ok(SpringSpec::Coil { active_coils, .. }) => active_coils,
        _ => ASSUMED_COIL.1,
    };
    let coil_radius_m = match spec.design() {
        Ok(SpringDesign::Coil(coil)) => coil.coil_diameter_m() / 2.0,
        _ => ASSUMED_COIL.0,
    };
    Link::Spring { base_from_foot: base_from_foot.pose(), head_from_top: head_from_top.pose(), coil_radius_m, coils }
}
