//! Ray casts and closest points compared with closed forms and with a search through all triangles.

use approx::assert_relative_eq;
use rand::RngExt;
use zsim::geometry::{Surface, Vector};
use zsim::random::Seed;
use zsim::spec::{Kind, Source, names, parse};
use zsim::world::{Ray, TimedRay, World};

/// A world of `items` with the opaque materials `a` and `b` and transparent `glass`, and further scene `fields`.
pub(super) fn world(items: &str, fields: &str) -> World {
    let text = format!(
        r#"(
            name: "test",
            materials: {{"a": (reflectance: 0.5), "b": (reflectance: 0.1), "glass": (reflectance: 0.1, kind: Glass(transmission: 0.8))}},
            items: [{items}],
            {fields}
        )"#
    );
    let source = Source::in_memory("test", text);
    World::build(&parse(&source).unwrap(), &source).unwrap()
}

fn ray(origin_in_world: Vector, towards: Vector) -> Ray {
    Ray { origin_in_world, direction_in_world: towards.normalize() }
}

/// Directions distributed over the sphere.
fn directions(count: usize) -> Vec<Vector> {
    let mut stream = Seed(5).stream("directions");
    let mut draw = || Vector::from_fn(|_, _| stream.random_range(-1.0..1.0));
    (0..count).map(|_| draw()).filter(|v: &Vector| v.norm() > 0.1).map(|v| v.normalize()).collect()
}

#[test]
fn rays_from_inside_a_box_hit_its_walls() {
    // Slab method: along each axis the walls are at +-size/2 from the centre; the closest one is hit.
    let world = world("Solid(shape: Box(size_m: (8, 6, 4)), material: \"a\", at_m_deg: [(100, 50, 10)])", "");
    let eye_in_box = Vector::new(1.0, -0.5, 0.3);
    for direction in directions(20_000) {
        let half = Vector::new(4.0, 3.0, 2.0);
        let to_wall = |axis: usize| (half[axis] * direction[axis].signum() - eye_in_box[axis]) / direction[axis];
        let (axis, expected) = (0..3).map(|axis| (axis, to_wall(axis))).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let hit = world.cast(&ray(eye_in_box + Vector::new(100.0, 50.0, 12.0), direction), 30.0, 0.0).unwrap();
        assert_relative_eq!(hit.distance_m, expected, epsilon = 1e-9);
        let normal = Vector::ith(axis, -direction[axis].signum());
        assert_relative_eq!(hit.normal_in_world, normal, epsilon = 1e-12);
        assert_eq!(world.material(hit.material).name, "a");
    }
}

#[test]
fn a_cylinder_is_hit_to_within_the_sagitta_of_its_sides() {
    // A regular polygon of n sides in a circle of radius r is within r (1 - cos(pi / n)) of it. The range error is at
    // most that sagitta divided by the cosine of the incidence angle.
    let world = world(
        "Solid(shape: Cylinder(radius_m: 0.5, height_m: 4, sides: 64), material: \"a\", at_m_deg: [(3, 0, -2)])",
        "",
    );
    let sagitta = 0.5 * (1.0 - (std::f64::consts::PI / 64.0).cos());
    for k in -9..=9 {
        let angle = f64::from(k) / 60.0;
        let direction = Vector::new(angle.cos(), angle.sin(), 0.0);
        let beside = 3.0 * angle.sin();
        let expected = 3.0 * angle.cos() - (0.25 - beside * beside).sqrt();
        let incidence = (beside / 0.5).asin();
        let hit = world.cast(&ray(Vector::new(0.0, 0.0, 0.1), direction), 30.0, 0.0).unwrap();
        assert!(hit.distance_m >= expected - 1e-9, "{k}");
        assert!(hit.distance_m <= expected + 1.1 * sagitta / incidence.cos(), "{k}: {} {expected}", hit.distance_m);
    }
}

#[test]
fn a_tilted_plane_distant_from_the_origin_is_hit_to_a_nanometre() {
    // The plane through p with normal n: t = n . (p - o) / n . d. At 50 km single precision has an error of 2 mm.
    let world = world(
        "Solid(shape: Rectangle(size_m: (200, 200)), material: \"b\", at_m_deg: [(50000, -30000, 7, 20, 30, 10)])",
        "",
    );
    let point = Vector::new(50_000.0, -30_000.0, 7.0);
    let turn = zsim::geometry::from_roll_pitch_yaw(10_f64.to_radians(), 30_f64.to_radians(), 20_f64.to_radians());
    let normal = turn * Vector::z();
    let eye = point + normal * 12.0 + turn * Vector::new(3.0, -4.0, 0.0);
    for direction in directions(5000).into_iter().filter(|d| normal.dot(d) < -0.2) {
        let expected = normal.dot(&(point - eye)) / normal.dot(&direction);
        let hit = world.cast(&ray(eye, direction), 100.0, 0.0).unwrap();
        assert_relative_eq!(hit.distance_m, expected, epsilon = 1e-9);
        assert_relative_eq!(hit.normal_in_world, normal, epsilon = 1e-9);
    }
}

#[test]
fn a_ray_has_no_hit_out_of_range_or_backwards() {
    let world = world("Solid(shape: Box(size_m: (1, 10, 10)), material: \"a\", at_m_deg: [(10.5, 0, -5)])", "");
    let ahead = ray(Vector::zeros(), Vector::x());
    assert_relative_eq!(world.cast(&ahead, 10.001, 0.0).unwrap().distance_m, 10.0, epsilon = 1e-9);
    assert!(world.cast(&ahead, 9.999, 0.0).is_none());
    assert!(world.cast(&ray(Vector::zeros(), -Vector::x()), 30.0, 0.0).is_none());
}

#[test]
fn a_ray_through_glass_hits_the_surface_after_it() {
    let items = r#"Solid(shape: Rectangle(size_m: (2, 2)), material: "glass", at_m_deg: [(2, 0, 0, 0, 90)]),
        Solid(shape: Box(size_m: (1, 4, 4)), material: "b", at_m_deg: [(5.5, 0, -2)])"#;
    let world = world(items, "");
    let ray = ray(Vector::zeros(), Vector::new(1.0, 0.1, 0.05));
    let stretch = ray.direction_in_world.x.recip();
    let pane = world.cast(&ray, 30.0, 0.0).unwrap();
    assert!(world.material(pane.material).is_transparent());
    assert_relative_eq!(pane.distance_m, 2.0 * stretch, epsilon = 1e-9);
    let wall = world.cast_beyond(&ray, pane.distance_m, 30.0, 0.0).unwrap();
    assert_eq!(world.material(wall.material).name, "b");
    assert_relative_eq!(wall.distance_m, 5.0 * stretch, epsilon = 1e-9);
    let back = world.cast_beyond(&ray, wall.distance_m, 30.0, 0.0).unwrap();
    assert_relative_eq!(back.distance_m, 6.0 * stretch, epsilon = 1e-9);
    assert!(world.cast_beyond(&ray, wall.distance_m, 5.5, 0.0).is_none());
}

#[test]
fn moving_objects_are_hit_at_their_position_at_the_time_of_the_ray() {
    // The person, a box of 0.4 m, walks from y = -4 to 4 m in 8 s at x = 5 m. The door leaf rotates about (2, 0) from
    // the x direction to the y direction in 2 s.
    let fields = r#"
        templates: {
            "person": [Solid(shape: Box(size_m: (0.4, 0.4, 1.8)), material: "b")],
            "leaf": [Solid(shape: Box(size_m: (1, 0.04, 2)), material: "a", at_m_deg: [(0.5, 0)])],
        },
        movers: [
            (template: "person", repeats: false, waypoints: [(time_s: 0, at_m_deg: (5, -4)), (time_s: 8, at_m_deg: (5, 4))]),
            (template: "leaf", repeats: true, waypoints: [
                (time_s: 0, at_m_deg: (2, 0)), (time_s: 2, at_m_deg: (2, 0, 0, 90)), (time_s: 4, at_m_deg: (2, 0)),
            ]),
        ]"#;
    let world = world("Solid(shape: Box(size_m: (20, 20, 0.1)), material: \"a\", at_m_deg: [(0, 0, -0.1)])", fields);
    let towards_x = |y: f64| ray(Vector::new(0.0, y, 1.0), Vector::x());
    // At 6 s the person is at y = 2.
    let hit = world.cast(&towards_x(2.1), 30.0, 6.0).unwrap();
    assert_relative_eq!(hit.distance_m, 4.8, epsilon = 1e-9);
    assert_relative_eq!(hit.normal_in_world, -Vector::x(), epsilon = 1e-12);
    assert!(world.cast(&towards_x(2.1), 30.0, 4.0).is_none());
    // At 2 s the leaf is normal to the ray at y = 0.5, with its face at x = 2 - 0.02; the same one period later.
    for time in [2.0, 6.0] {
        assert_relative_eq!(world.cast(&towards_x(0.5), 30.0, time).unwrap().distance_m, 1.98, epsilon = 1e-9);
    }
    // At 1 s the leaf is at 45 degrees: its middle plane is at x = 2 + y, and its face closer by half the thickness
    // times sqrt(2).
    let expected = 2.5 - 0.02 * 2_f64.sqrt();
    assert_relative_eq!(world.cast(&towards_x(0.5), 30.0, 1.0).unwrap().distance_m, expected, epsilon = 1e-9);
    // No hit with a range limit in front of the leaf.
    assert!(world.cast(&towards_x(0.5), 1.9, 2.0).is_none());
}

#[test]
fn the_nearest_point_of_a_box_is_the_clamped_point() {
    // Outside a box the closest point is the coordinate-wise clamp (Ericson 2005, section 5.1.3).
    let world = world("Solid(shape: Box(size_m: (2, 4, 6)), material: \"a\", at_m_deg: [(0, 0, -3)])", "");
    for direction in directions(3000) {
        let point = direction * 8.0;
        let clamped = point.inf(&Vector::new(1.0, 2.0, 3.0)).sup(&Vector::new(-1.0, -2.0, -3.0));
        let found = world.nearest(&point, 10.0).unwrap();
        // The search compares distances in single precision, so that almost equal distances of several metres may be
        // confused.
        assert_relative_eq!(found.point_in_world, clamped, epsilon = 3e-3);
        assert_relative_eq!((found.point_in_world - point).norm(), (clamped - point).norm(), epsilon = 2e-6);
        assert_relative_eq!(found.normal_in_world.norm(), 1.0, epsilon = 1e-12);
        let away = (clamped - point).norm();
        assert!(world.nearest(&point, away - 1e-4).is_none() && world.nearest(&point, away + 1e-4).is_some());
    }
}

/// Random triangles in a cube, as a mesh in memory, and as a world loaded from a file.
fn random_triangles(count: usize) -> (Vec<[Vector; 3]>, World) {
    let mut stream = Seed(9).stream("triangles");
    let mut draw = |size: f64| Vector::from_fn(|_, _| stream.random_range(-size..size));
    let triangles: Vec<[Vector; 3]> = (0..count)
        .map(|_| {
            let middle = draw(5.0);
            [middle + draw(0.5), middle + draw(0.5), middle + draw(0.5)]
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let corners = triangles.iter().flatten().map(|c| format!("v {} {} {}\n", c.x, c.y, c.z));
    let faces = (0..count).map(|k| format!("f {} {} {}\n", 3 * k + 1, 3 * k + 2, 3 * k + 3));
    std::fs::write(folder.path().join("soup.obj"), corners.chain(faces).collect::<String>()).unwrap();
    let text = r#"(name: "soup", materials: {"a": (reflectance: 0.5)}, items: [Solid(shape: Mesh(file: "soup.obj"), material: "a")])"#;
    std::fs::write(folder.path().join("soup.ron"), text).unwrap();
    let world = World::load(folder.path().join("soup.ron").to_str().unwrap()).unwrap();
    (triangles, world)
}

/// Distance to the intersection of a ray with a triangle: barycentric coordinates by areas, in double precision.
fn crossing(ray: &Ray, [a, b, c]: &[Vector; 3]) -> Option<f64> {
    let normal = (b - a).cross(&(c - a));
    let distance = normal.dot(&(a - ray.origin_in_world)) / normal.dot(&ray.direction_in_world);
    let at = ray.at(distance);
    let is_left_of = |from: &Vector, to: &Vector| normal.dot(&(to - from).cross(&(at - from))) >= 0.0;
    (distance >= 0.0 && is_left_of(a, b) && is_left_of(b, c) && is_left_of(c, a)).then_some(distance)
}

#[test]
fn the_tree_agrees_with_a_search_through_all_triangles() {
    let (triangles, world) = random_triangles(2000);
    assert_eq!(world.triangle_count(), 2000);
    let mut errors: Vec<f64> = directions(5000)
        .into_iter()
        .map(|direction| {
            let ray = ray(direction.yzx() * 2.0, direction);
            let by_all = triangles.iter().filter_map(|t| crossing(&ray, t)).fold(f64::INFINITY, f64::min);
            let by_tree = world.cast(&ray, 100.0, 0.0).map_or(f64::INFINITY, |hit| hit.distance_m);
            if by_all == by_tree { 0.0 } else { (by_all - by_tree).abs() }
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    // A ray that grazes an edge may hit or miss, so the test uses quantiles instead of the maximum.
    assert!(errors[errors.len() * 999 / 1000] < 1e-9, "{:?}", &errors[errors.len() - 8..]);
}

#[test]
fn the_closest_point_agrees_with_a_search_through_all_triangles() {
    let (triangles, world) = random_triangles(200);
    for point in directions(100).into_iter().map(|d| d * 4.0) {
        let by_all = triangles.iter().map(|t| distance_by_sampling(&point, t)).fold(f64::INFINITY, f64::min);
        let found = world.nearest(&point, 20.0).unwrap();
        let by_tree = (found.point_in_world - point).norm();
        // The sampled distance is an upper bound, within its step of 1/40 of a triangle of 1 m.
        assert!(by_tree <= by_all + 1e-6 && by_tree >= by_all - 0.03, "{by_tree} {by_all}");
    }
}

fn distance_by_sampling(point: &Vector, [a, b, c]: &[Vector; 3]) -> f64 {
    let samples = (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (f64::from(i) / 40.0, f64::from(j) / 40.0)));
    samples.map(|(s, t)| (a + (b - a) * s + (c - a) * t - point).norm()).fold(f64::INFINITY, f64::min)
}

#[test]
fn no_ray_passes_between_the_triangles_of_a_closed_room() {
    // Rays at edges, corners and face diagonals of the boxes, where triangles join.
    let world = world("Solid(shape: Box(size_m: (7, 5, 3)), material: \"a\")", "");
    let eye = Vector::new(0.3, -0.2, 1.1);
    for k in 0..=2000 {
        let t = f64::from(k) / 2000.0;
        let diagonal = Vector::new(3.5, -2.5 + 5.0 * t, 3.0 * t);
        let edge = Vector::new(-3.5 + 7.0 * t, 2.5, 3.0);
        for target in [diagonal, edge] {
            let hit = world.cast(&ray(eye, target - eye), 30.0, 0.0).unwrap();
            assert_relative_eq!(hit.distance_m, (target - eye).norm(), epsilon = 1e-5);
        }
    }
}

#[test]
fn a_world_can_be_shared_between_threads() {
    fn is_shared<T: Send + Sync>(_: &T) {}
    is_shared(&World::load("mocap_room").unwrap());
}

/// Groups of rays from random positions in a scene, as from a lidar that moves: 16 rays of one group are spread over up to
/// 0.1 to 100 degrees, by less than a centimetre at their origins, and over 1 ms.
fn groups_of_rays(world: &World, groups: usize) -> Vec<TimedRay> {
    let (lower, upper) = world.bounds();
    let mut stream = Seed(11).stream(world.name());
    let mut rays = Vec::with_capacity(16 * groups);
    for _ in 0..groups {
        let middle = Vector::from_fn(|axis, _| stream.random_range(lower[axis]..=upper[axis]));
        let mut draw = |scale: f64| Vector::from_fn(|_, _| scale * stream.random_range(-1.0..1.0));
        let (axis, fan, jitter) = (draw(1.0).normalize(), draw(1.0), draw(0.004));
        let spread = [0.001, 0.01, 0.05, 0.3, 2.0][rays.len() / 16 % 5];
        let (start_s, reach_m) = (20.0 * fan.x.abs(), 5.0 + 30.0 * fan.y.abs());
        rays.extend((0..16).map(|k| {
            let along = f64::from(k) / 15.0 - 0.5;
            let direction = axis + (fan * along + draw(0.03)) * spread;
            TimedRay { ray: ray(middle + jitter * along, direction), reach_m, t_s: start_s + 1e-3 * along }
        }));
    }
    rays
}

#[test]
fn groups_of_rays_hit_what_single_rays_hit_in_all_scenes() {
    // Both find the face in single precision and compute the distance from its plane. Where two faces are within the
    // rounding of single precision, at an edge, either can be found: allow one ray in 100,000.
    let (mut count, mut other) = (0, 0);
    for name in names(Kind::Scene) {
        let world = World::load(&name).unwrap();
        let rays = groups_of_rays(&world, 8000);
        let together = world.cast_all(&rays);
        assert_eq!(together.len(), rays.len());
        let mut hits = 0;
        for (timed, found) in rays.iter().zip(&together) {
            let alone = world.cast(&timed.ray, timed.reach_m, timed.t_s);
            let is_same = match (found, &alone) {
                (Some(found), Some(alone)) => (found.distance_m - alone.distance_m).abs() < 5e-6,
                (found, alone) => found.is_none() && alone.is_none(),
            };
            (hits, other) = (hits + usize::from(found.is_some()), other + usize::from(!is_same));
        }
        assert!(hits > rays.len() / 20, "{name}: {hits} of {} rays hit a surface", rays.len());
        count += rays.len();
    }
    assert!(count > 1_000_000, "{count} rays");
    assert!(other <= count / 100_000, "{other} of {count} rays hit another surface in a group");
}
