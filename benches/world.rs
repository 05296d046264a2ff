//! Speed of ray casts for a lidar that swings on its spring along the route: rays per second.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails by panicking")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use zsim::geometry::{Surface, Vector, from_roll_pitch_yaw};
use zsim::spec::{Source, parse};
use zsim::world::{Ray, TimedRay, World};

const MAX_RANGE_M: f64 = 30.0;

/// Rays of a laser with 1081 beams over 270 degrees, swinging by 45 degrees at 1.3 Hz, every 100th scan of a walk.
fn rays(world: &World) -> Vec<Ray> {
    let points = &world.default_route().unwrap().points_in_world;
    let scan = |k: usize| {
        let leg = k % (points.len() - 1);
        let fraction = (k * 7 % 10) as f64 / 10.0;
        let origin_in_world = points[leg].lerp(&points[leg + 1], fraction) + Vector::z() * 1.1;
        let pitch = 0.8 * (std::f64::consts::TAU * 1.3 * k as f64 * 0.377).sin();
        let world_from_head = from_roll_pitch_yaw(0.3 * pitch, pitch, k as f64 * 0.7);
        (0..1081).map(move |beam| {
            let angle = (f64::from(beam) * 0.25 - 135.0).to_radians();
            let direction_in_world = world_from_head * Vector::new(angle.cos(), angle.sin(), 0.0);
            Ray { origin_in_world, direction_in_world }
        })
    };
    (0..60).flat_map(scan).collect()
}

/// Rolling ground of a million triangles under trees, as in a surveyed mesh.
fn million() -> World {
    let text = r#"(
        name: "million",
        materials: {"ground": (reflectance: 0.3), "wood": (reflectance: 0.4)},
        templates: {"tree": [Solid(shape: Cylinder(radius_m: 0.2, height_m: 5), material: "wood")]},
        items: [
            Solid(shape: HeightField(size_m: (60, 60), heights: Rolling(seed: 1, cells: (700, 700), amplitude_m: 0.8, wavelength_m: 12)),
                material: "ground"),
            Scatter((template: "tree", seed: 2, count: 150, region_m: ((-28, -28, -1), (28, 28, -1)), min_spacing_m: 2, turn: Upright)),
        ],
        routes: {"way": (closed: false, points_m: [(-20, -20, 1), (20, -20, 1), (20, 20, 1)])},
        default_route: "way",
    )"#;
    let source = Source::in_memory("million", text);
    World::build(&parse(&source).unwrap(), &source).unwrap()
}

fn casts(c: &mut Criterion) {
    let mut group = c.benchmark_group("cast");
    for world in [World::load("office").unwrap(), World::load("courtyard").unwrap(), million()] {
        let rays = rays(&world);
        let timed: Vec<TimedRay> =
            rays.iter().map(|ray| TimedRay { ray: *ray, reach_m: MAX_RANGE_M, t_s: 0.0 }).collect();
        group.throughput(Throughput::Elements(rays.len() as u64));
        group.sample_size(20);
        let scene = format!("{}, {} triangles", world.name(), world.triangle_count());
        group.bench_function(format!("{scene}, single rays"), |b| {
            b.iter(|| rays.iter().filter(|ray| world.cast(black_box(ray), MAX_RANGE_M, 0.0).is_some()).count());
        });
        group.bench_function(format!("{scene}, scans"), |b| {
            let cast = |scan: &[TimedRay]| world.cast_all(black_box(scan)).iter().flatten().count();
            b.iter(|| timed.chunks(1081).map(cast).sum::<usize>());
        });
    }
}

fn nearest(c: &mut Criterion) {
    let world = World::load("office").unwrap();
    let rays = rays(&world);
    let points: Vec<Vector> =
        rays.iter().filter_map(|ray| Some(ray.at(world.cast(ray, MAX_RANGE_M, 0.0)?.distance_m + 0.02))).collect();
    let mut group = c.benchmark_group("nearest");
    group.throughput(Throughput::Elements(points.len() as u64));
    group.sample_size(20);
    group.bench_function("office", |b| {
        b.iter(|| points.iter().filter(|point| world.nearest(black_box(point), 0.5).is_some()).count());
    });
}

fn builds(c: &mut Criterion) {
    c.bench_function("build office", |b| b.iter(|| World::load("office").unwrap().triangle_count()));
}

criterion_group!(benches, casts, nearest, builds);
criterion_main!(benches);
