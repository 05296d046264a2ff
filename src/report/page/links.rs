//! Parts, springs and cords of a head, and triangles of a scene, as the view draws them.

use super::{Block, CoilLink, Link, MAX_PAGE_TRIANGLES};
use zsim_base::geometry::Vector;
use zsim_dynamics::{ElementSpec, LinkageSpec, PartSpec, PlacementSpec};
use zsim_elasticity::SpringSpec;
use zsim_world::{MaterialId, World};

/// Radius, wire diameter (m) and number of the coils with which a spring is drawn if only its stiffness is known.
const ASSUMED_COIL: (f64, f64, f64) = (0.0125, 0.002, 10.0);

/// The elements between base and head; empty for a rigid or actuated mount.
pub fn of(linkage: &LinkageSpec) -> Vec<Link> {
    match linkage {
        LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => Vec::new(),
        LinkageSpec::Spring { spring: spec, base_from_spring, head_from_spring, .. } => {
            vec![spring(spec, base_from_spring, head_from_spring)]
        }
        LinkageSpec::Suspension { elements, .. } => elements.iter().filter_map(element).collect(),
    }
}

/// The blocks among the parts of a head; bodies have no shape.
pub fn blocks(parts: &[PartSpec]) -> Vec<Block> {
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
        ElementSpec::Cord(cord) => Some(Link::Straight {
            point_in_base: Vector::from(cord.base_point_m),
            point_in_head: Vector::from(cord.head_point_m),
        }),
        ElementSpec::UniversalJoint(joint) => Some(Link::Straight {
            point_in_base: Vector::from(joint.base_from_joint.position_m),
            point_in_head: Vector::zeros(),
        }),
        ElementSpec::Float(_) => None,
    }
}

fn spring(spec: &SpringSpec, base_from_foot: &PlacementSpec, head_from_top: &PlacementSpec) -> Link {
    let (drawn, is_assumed) = match spec.resolved() {
        Ok(SpringSpec::Coil { coil_diameter_mm, wire_diameter_mm, active_coils, .. }) => {
            ((0.5e-3 * coil_diameter_mm, 1e-3 * wire_diameter_mm, active_coils), false)
        }
        _ => (ASSUMED_COIL, true),
    };
    let (coil_radius_m, wire_diameter_m, coils) = drawn;
    let (base_from_foot, head_from_top) = (base_from_foot.pose(), head_from_top.pose());
    Link::Spring(CoilLink { base_from_foot, head_from_top, coil_radius_m, wire_diameter_m, coils, is_assumed })
}

/// Corners of a triangle, in the world.
pub(crate) type Triangle = [Vector; 3];

/// Returns the static triangles of a scene that a page shows, and whether others are left out.
pub fn static_surfaces(world: &World) -> (Vec<Triangle>, bool) {
    let (largest, are_partial) = largest(world.triangles().collect());
    (largest.into_iter().map(|(triangle, _)| triangle).collect(), are_partial)
}

/// Returns the largest triangles, at most [`MAX_PAGE_TRIANGLES`], and whether others are left out.
pub(crate) fn largest(mut triangles: Vec<(Triangle, MaterialId)>) -> (Vec<(Triangle, MaterialId)>, bool) {
    let are_partial = triangles.len() > MAX_PAGE_TRIANGLES;
    if are_partial {
        triangles.sort_by(|(a, _), (b, _)| area_m2(b).total_cmp(&area_m2(a)));
        triangles.truncate(MAX_PAGE_TRIANGLES);
    }
    (triangles, are_partial)
}

/// Returns the area of a triangle, m^2.
pub(crate) fn area_m2([a, b, c]: &Triangle) -> f64 {
    (b - a).cross(&(c - a)).norm() / 2.0
}
