//! Swaying plants: rays compared with each triangle at its place at that time.

use zsim::geometry::Vector;
use zsim::spec::{Source, parse};
use zsim::world::{Ray, World};

/// Forty leaning plants in the wind over a floor.
fn field() -> World {
    let text = r#"(
        name: "field",
        materials: { "grass": (reflectance: 0.5) },
        templates: { "plant": [
            Solid(shape: Rectangle(size_m: (0.3, 1.2)), material: "grass", at_m_deg: [(0, 0, 0.5, 0, 0, 80), (0.1, 0, 0.5, 90, 0, 100)]),
            Solid(shape: Box(size_m: (0.2, 0.2, 0.3)), material: "grass", at_m_deg: [(0.1, 0.1, 0.9)]),
        ] },
        items: [Solid(shape: Box(size_m: (20, 20, 0.2)), material: "grass", at_m_deg: [(0, 0, -0.5)])],
        swaying: [(
            scatter: (template: "plant", seed: 1, count: 40, region_m: ((-3, -3, 0), (3, 3, 0)), min_spacing_m: 0.3, turn: Upright),
            wind_deg: 40, lean_deg: 8, amplitude_deg: 15, frequency_hz: 0.7, gust_speed_m_per_s: 3,
        )],
    )"#;
    let source = Source::in_memory("field.ron", text);
    World::build(&parse(&source).unwrap(), &source).unwrap()
}

/// Distance along a ray to a triangle: the solution of `origin + s direction = a + u (b - a) + v (c - a)`.
fn distance(ray: &Ray, [a, b, c]: [Vector; 3]) -> Option<f64> {
    let columns = nalgebra::Matrix3::from_columns(&[b - a, c - a, -ray.direction_in_world]);
    let solution = columns.lu().solve(&(ray.origin_in_world - a))?;
    let (u, v, s) = (solution.x, solution.y, solution.z);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && s >= 0.0).then_some(s)
}

/// Rays from the edge of the field, spread over its plants by the golden angle.
fn rays() -> impl Iterator<Item = Ray> {
    (0..400).map(|k| {
        let (sin, cos) = (2.4 * f64::from(k)).sin_cos();
        let target = Vector::new(2.5 * cos, 2.5 * sin, 0.003 * f64::from(k) - 0.3);
        let origin_in_world = Vector::new(-4.0, 0.01 * f64::from(k) - 2.0, 1.1);
        Ray { origin_in_world, direction_in_world: (target - origin_in_world).normalize() }
    })
}

#[test]
fn a_ray_meets_the_plant_that_is_there_at_that_time() {
    let world = field();
    let (mut on_plants, mut moved) = (0, 0);
    for time_s in [0.0, 0.4, 3.1] {
        let triangles: Vec<[Vector; 3]> =
            world.triangles().chain(world.moving_triangles(time_s)).map(|(triangle, _)| triangle).collect();
        for ray in rays() {
            let expected = triangles.iter().filter_map(|triangle| distance(&ray, *triangle)).min_by(f64::total_cmp);
            let found = world.cast(&ray, 30.0, time_s).map(|hit| hit.distance_m);
            // A ray within a micrometre of an edge may pass on either side of it.
            let agree = (expected.unwrap_or(30.0) - found.unwrap_or(30.0)).abs() < 1e-5;
            assert!(agree, "{ray:?} at {time_s} s: {found:?}, not {expected:?}");
            let hit = found.map(|found_m| ray.at(found_m));
            let is_on_plant = |hit: &Vector| world.distance_to_movers_m(hit, 1e-4, time_s).is_some();
            on_plants += usize::from(hit.as_ref().is_some_and(is_on_plant));
            moved += usize::from(found != world.cast(&ray, 30.0, time_s + 0.5).map(|hit| hit.distance_m));
        }
    }
    assert!(on_plants > 400 && moved > 400, "{on_plants} hits on plants, {moved} of them move");
}
