//! Routes that cannot be walked.

use zsim::spec::{Kind, Source, names, parse};
use zsim::world::World;

/// A hall of 20 m x 10 m with a floor, a wall across it at x = 10 m with a door from y = 4 m to 6 m, and this route.
fn warnings(route: &str) -> Vec<String> {
    let text = format!(
        "(name: \"hall\", materials: {{\"stone\": (reflectance: 0.5)}}, items: [
        Solid(shape: Box(size_m: (20, 10, 0.2)), material: \"stone\", at_m_deg: [(10, 5, -0.2)]),
        Solid(shape: Wall(length_m: 10, height_m: 3, thickness_m: 0.2, openings: [(from_m: 4, to_m: 6, head_m: 2.1)]),
              material: \"stone\", at_m_deg: [(10, 0, 0, 90)]),
        ], routes: {{\"lap\": {route}}})"
    );
    let source = Source::in_memory("hall.ron", text);
    World::build(&parse(&source).unwrap(), &source).unwrap().route_warnings()
}

#[test]
fn a_route_through_the_door_has_no_warning_and_through_the_wall_it_has_one_with_the_place() {
    assert!(warnings("(closed: false, points_m: [(2, 5, 0), (18, 5, 0), (18, 2, 0)])").is_empty());
    let through = warnings("(closed: false, points_m: [(2, 5, 0), (2, 2, 0), (18, 2, 0)])");
    assert_eq!(through, ["the route `lap` passes through `stone` at (9.90, 2.00, 1.00) m, between its points 2 and 3"]);
    // The last leg of a closed route is from the last point to the first.
    let closed = warnings("(closed: true, points_m: [(2, 8, 0), (2, 5, 0), (18, 5, 0), (18, 8, 0)])");
    assert_eq!(closed, ["the route `lap` passes through `stone` at (10.10, 8.00, 1.00) m, between its points 4 and 1"]);
    let twice = warnings("(closed: true, points_m: [(2, 8, 0), (2, 2, 0), (18, 2, 0), (18, 8, 0)])");
    assert!(twice.len() == 1 && twice[0].ends_with("between its points 2 and 3, and on 1 other leg"), "{twice:?}");
}

#[test]
fn a_route_outside_the_scene_or_above_no_floor_has_a_warning() {
    let outside = warnings("(closed: false, points_m: [(2, 5, 0), (2, 13, 0)])");
    assert_eq!(outside, ["the route `lap` leaves the scene at (2.00, 10.50, 0.00) m"]);
    // 3 m above the floor, for half of the way; and 5 m below it.
    let high = warnings("(closed: false, points_m: [(1, 5, 0), (5, 5, 0), (5, 5, 3.5), (9, 5, 3.5)])");
    assert!(high.len() == 1 && high[0].contains("has no floor within 1 m below it at (5.00, 5.00, 1.5"), "{high:?}");
    assert!(warnings("(closed: false, points_m: [(1, 5, -5), (5, 5, -5)])")[0].contains("no floor within 1 m"));
}

#[test]
fn the_routes_of_the_shipped_scenes_can_be_walked() {
    for name in names(Kind::Scene) {
        assert_eq!(World::load(&name).unwrap().route_warnings(), [""; 0], "{name}");
    }
}
