//! The shipped scenes load, and their routes are passable.

use zsim::geometry::{Route, Surface, Vector};
use zsim::spec::{Kind, names};
use zsim::world::{Ray, World};

/// Points along a route, at most `step` apart.
fn along(route: &Route, step: f64) -> Vec<Vector> {
    let points = &route.points_in_world;
    let mut legs: Vec<(Vector, Vector)> = points.windows(2).map(|pair| (pair[0], pair[1])).collect();
    if route.closed {
        legs.push((points[points.len() - 1], points[0]));
    }
    let on_leg = |(from, to): (Vector, Vector)| {
        let count = ((to - from).norm() / step).ceil() as usize;
        (0..count).map(move |k| from + (to - from) * (k as f64 / count as f64))
    };
    legs.into_iter().flat_map(on_leg).collect()
}

/// The surface that a walker at `foot` touches, as text.
///
/// The walker has a radius of 0.45 m, from 0.2 m (above thresholds) to 1.9 m above the floor.
fn touched_at(world: &World, foot: &Vector) -> Option<String> {
    (0..=12).map(|k| foot + Vector::z() * (0.65 + 0.8 * f64::from(k) / 12.0)).find_map(|here| {
        let surface = world.nearest(&here, 0.45)?;
        let (away, to) = ((surface.point_in_world - here).norm(), surface.point_in_world);
        Some(format!(
            "{:.2} m from {:.2} {:.2} {:.2} is {:.2} {:.2} {:.2}",
            away, here.x, here.y, here.z, to.x, to.y, to.z
        ))
    })
}

fn length(route: &Route) -> f64 {
    let points = along(route, 0.01);
    points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}

#[test]
fn routes_keep_clear_of_walls_and_furniture() {
    for name in names(Kind::Scene) {
        let world = World::load(&name).unwrap();
        for (route_name, route) in world.routes() {
            let touched: Vec<String> = along(route, 0.05).iter().filter_map(|foot| touched_at(&world, foot)).collect();
            assert!(touched.is_empty(), "{name}, {route_name}:\n{}", touched.join("\n"));
        }
    }
}

#[test]
fn routes_have_a_floor() {
    for name in names(Kind::Scene) {
        let world = World::load(&name).unwrap();
        for (route_name, route) in world.routes() {
            for foot in along(route, 0.2) {
                let origin_in_world = foot + Vector::z();
                let ray = Ray { origin_in_world, direction_in_world: -Vector::z() };
                // A person who walks by is absent at another time.
                let below = [0.0, 7.0, 19.0].into_iter().filter_map(|t_s| world.cast(&ray, 3.0, t_s));
                let floor_m = below.map(|hit| hit.distance_m).fold(0.0, f64::max);
                assert!((floor_m - 1.0).abs() < 0.35, "{name}, {route_name}: floor {floor_m} m below at {foot:?}");
            }
        }
    }
}

#[test]
fn every_scene_has_a_name_a_route_and_some_structure() {
    for name in names(Kind::Scene) {
        let world = World::load(&name).unwrap();
        assert_eq!(world.name(), name);
        assert!(world.default_route().is_some(), "{name}");
        assert!(world.triangle_count() > 100, "{name}");
        assert!(world.notes().is_empty(), "{name}: {:?}", world.notes());
    }
}

#[test]
fn a_lap_of_the_office_takes_about_a_minute() {
    let world = World::load("office").unwrap();
    let (lower, upper) = world.bounds();
    let size = upper - lower;
    assert!(size.x >= 20.0 && size.y >= 12.0, "{size:?}");
    let route = world.default_route().unwrap();
    assert!(route.closed && (60.0..75.0).contains(&length(route)), "{} m", length(route));
    assert!(world.triangle_count() > 15_000, "{}", world.triangle_count());
}

#[test]
fn in_closed_rooms_every_ray_hits_a_surface() {
    for name in ["office", "mocap_room"] {
        let world = World::load(name).unwrap();
        for foot in along(world.default_route().unwrap(), 0.5) {
            let origin_in_world = foot + Vector::z();
            for (i, j) in (0..72).flat_map(|i| (-8..=8).map(move |j| (i, j))) {
                let (azimuth, elevation) = (f64::from(i) * 5.0_f64.to_radians(), f64::from(j) * 10.0_f64.to_radians());
                let level = Vector::new(azimuth.cos(), azimuth.sin(), 0.0) * elevation.cos();
                let ray = Ray { origin_in_world, direction_in_world: level + Vector::z() * elevation.sin() };
                assert!(world.cast(&ray, 30.0, 0.0).is_some(), "{name}: {ray:?} hits nothing");
            }
        }
    }
}

#[test]
fn the_triangles_are_all_surfaces_and_the_floor_is_the_nearest_below() {
    let office = World::load("office").unwrap();
    let triangles: Vec<_> = office.triangles().collect();
    assert_eq!(triangles.len(), office.triangle_count());
    let (lower, upper) = office.bounds();
    for corner in triangles.iter().flat_map(|(corners, _)| corners) {
        assert!((0..3).all(|k| (lower[k] - 1e-3..=upper[k] + 1e-3).contains(&corner[k])), "{corner}");
    }
    // The route is on the floor, so the nearest surface of a point 5 cm above its start is 5 cm away.
    let start = office.default_route().unwrap().points_in_world[0] + Vector::new(0.0, 0.0, 0.05);
    let (surface, material) = office.nearest_material(&start, 1.0).unwrap();
    assert!(((surface.point_in_world - start).norm() - 0.05).abs() < 1e-6);
    assert_eq!(office.materials()[material.index()].name, "carpet");
}
