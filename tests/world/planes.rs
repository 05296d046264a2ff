//! The planes of a scene: faces of one solid that touch in one plane.

use super::casts::world;
use std::collections::BTreeSet;
use zsim::geometry::Vector;
use zsim::world::{PlaneId, Ray, World};

/// Number of planes of `items`, turned in all axes.
fn count(shape: &str) -> usize {
    let items = format!("Solid(shape: {shape}, material: \"a\", at_m_deg: [(7, -3, 2, 33, 21, 56)])");
    world(&items, "").planes().count()
}

/// The plane that a ray hits.
fn plane(world: &World, origin_in_world: Vector, towards: Vector) -> PlaneId {
    let ray = Ray { origin_in_world, direction_in_world: towards.normalize() };
    let face = world.cast(&ray, 50.0, 0.0).unwrap().face.unwrap();
    world.planes().plane(face)
}

#[test]
fn a_shape_has_as_many_planes_as_flat_faces() {
    for (shape, expected) in [
        ("Rectangle(size_m: (2, 1))", 1),
        ("Box(size_m: (1, 2, 3))", 6),
        // The sides, and both ends.
        ("Cylinder(radius_m: 0.5, height_m: 2, sides: 24)", 26),
        // Risers and treads, both flanks, the underside, the back.
        ("Stairs(steps: 7, width_m: 1, rise_m: 0.2, tread_m: 0.3)", 18),
        // A window divides no face, and has a sill, a head and two jambs.
        (
            "Wall(length_m: 5, height_m: 3, thickness_m: 0.2, openings: [(from_m: 1, to_m: 2, sill_m: 0.9, head_m: 2)])",
            10,
        ),
        // A door has no sill, and divides the underside of the wall.
        ("Wall(length_m: 5, height_m: 3, thickness_m: 0.2, openings: [(from_m: 1, to_m: 2, head_m: 2)])", 10),
        // A roof over two rows of level ground.
        ("HeightField(size_m: (4, 4), heights: Grid([[0, 0, 0], [0, 0, 0], [1, 1, 1]]))", 2),
    ] {
        assert_eq!(count(shape), expected, "{shape}");
    }
}

#[test]
fn both_sides_of_an_opening_are_one_plane_and_both_sides_of_a_wall_are_two() {
    let wall = "Solid(shape: Wall(length_m: 5, height_m: 3, thickness_m: 0.2, openings: [(from_m: 2, to_m: 3, head_m: 2)]), material: \"a\")";
    let world = world(wall, "");
    let front = |x: f64, z: f64| plane(&world, Vector::new(x, -4.0, z), Vector::y());
    let back = |x: f64, z: f64| plane(&world, Vector::new(x, 4.0, z), -Vector::y());
    assert!(front(1.0, 1.0) == front(4.0, 1.0) && front(1.0, 1.0) == front(2.5, 2.5));
    assert!(back(1.0, 1.0) == back(4.0, 1.0));
    assert_ne!(front(1.0, 1.0), back(1.0, 1.0));
}

#[test]
fn solids_side_by_side_have_planes_of_their_own_in_any_order() {
    let both = |first: &str, second: &str| {
        let solid =
            |at: &str| format!("Solid(shape: Box(size_m: (1, 1, 1)), material: \"a\", at_m_deg: [({at}, 0, 0)]),");
        world(&(solid(first) + &solid(second)), "")
    };
    for (first, second) in [("0", "1"), ("1", "0")] {
        let world = both(first, second);
        assert_eq!(world.planes().count(), 12);
        let tops: BTreeSet<PlaneId> = [0.0, 1.0].map(|x| plane(&world, Vector::new(x, 0.1, 4.0), -Vector::z())).into();
        assert_eq!(tops.len(), 2);
    }
}

#[test]
fn a_mover_has_no_static_face() {
    let world = world(
        "Solid(shape: Rectangle(size_m: (9, 9)), material: \"a\")",
        "templates: {\"cube\": [Solid(shape: Box(size_m: (1, 1, 1)), material: \"b\")]}, movers: [(template: \"cube\", repeats: false, waypoints: [(time_s: 0, at_m_deg: (0, 0, 1))])]",
    );
    let down = |x: f64| Ray { origin_in_world: Vector::new(x, 0.0, 5.0), direction_in_world: -Vector::z() };
    assert!(world.cast(&down(0.0), 9.0, 0.0).unwrap().face.is_none());
    assert!(world.cast(&down(3.0), 9.0, 0.0).unwrap().face.is_some());
}
