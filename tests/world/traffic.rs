//! Moving objects in the shipped scenes: people in the office, a vehicle in the courtyard.

use std::f64::consts::TAU;
use zsim::geometry::{Surface, Vector};
use zsim::motion::{self, BaseMotion};
use zsim::random::Seed;
use zsim::spec::{Kind, find, parse};
use zsim::world::{MoverSpec, Ray, SceneSpec, World};

/// The motion `name` along the default route of a scene.
fn motion_in(name: &str, world: &World, duration_s: f64) -> Box<dyn BaseMotion> {
    let (spec, source) = motion::load(name).unwrap();
    spec.build(&source, world.default_route(), duration_s, Seed(1)).unwrap()
}

/// Position of a mover on the floor, linear between its waypoints.
fn position_of(mover: &MoverSpec, t_s: f64) -> Vector {
    let (first, last) = (mover.waypoints[0].time_s, mover.waypoints[mover.waypoints.len() - 1].time_s);
    let t_s = first + (t_s - first).rem_euclid(last - first);
    let at = |k: usize| mover.waypoints[k].at_m_deg.world_from_body().translation.vector;
    let after = mover.waypoints.partition_point(|point| point.time_s <= t_s).min(mover.waypoints.len() - 1);
    let (from, to) = (mover.waypoints[after - 1].time_s, mover.waypoints[after].time_s);
    at(after - 1).lerp(&at(after), (t_s - from) / (to - from))
}

fn people() -> Vec<MoverSpec> {
    parse::<SceneSpec>(&find(Kind::Scene, "office_people").unwrap()).unwrap().movers
}

#[test]
fn people_in_the_office_do_not_walk_through_walls() {
    let world = World::load("office_people").unwrap();
    for (index, person) in people().iter().enumerate() {
        let (first, last) = (person.waypoints[0], person.waypoints[person.waypoints.len() - 1]);
        let gap = first.at_m_deg.world_from_body().inv_mul(&last.at_m_deg.world_from_body());
        assert!(
            person.repeats && gap.translation.vector.norm() + gap.rotation.angle() < 1e-6,
            "{index} jumps at the end"
        );
        for step in 0..((last.time_s - first.time_s) / 0.1) as usize {
            let foot = position_of(person, 0.1 * step as f64);
            // A person has a radius of 0.3 m; checked from the knees, above thresholds and mats, to the head.
            for height_m in [0.5, 0.8, 1.1, 1.4] {
                let near = world.nearest(&(foot + Vector::z() * height_m), 0.3);
                assert!(near.is_none(), "person {index} at {foot:?}: {near:?}");
            }
        }
    }
}

#[test]
fn people_keep_their_distance_and_are_visible() {
    let world = World::load("office_people").unwrap();
    let hand = motion_in("hand", &world, 180.0);
    let people = people();
    assert!(people.len() >= 5);
    let mut in_sight = 0;
    for step in 0..720 {
        let t_s = 0.25 * f64::from(step);
        let laser = hand.at(t_s).world_from_body.translation.vector + Vector::z() * 0.224;
        let places: Vec<Vector> = people.iter().map(|person| position_of(person, t_s)).collect();
        for (index, one) in places.iter().enumerate() {
            assert!((one - laser).xy().norm() > 0.45, "person {index} runs into the laser at {t_s} s");
            for (other, two) in places.iter().enumerate().skip(index + 1) {
                assert!(one.metric_distance(two) > 0.4, "{index} and {other} run into each other at {t_s} s");
            }
        }
        // A ray to a person's chest hits the person before any wall.
        let seen = places.iter().filter(|foot| {
            let to = *foot + Vector::z() * 1.2 - laser;
            let ray = Ray { origin_in_world: laser, direction_in_world: to.normalize() };
            world.cast(&ray, 20.0, t_s).is_some_and(|hit| (hit.distance_m - to.norm()).abs() < 0.35)
        });
        in_sight += seen.count();
    }
    let visible_fraction = in_sight as f64 / 720.0;
    assert!(visible_fraction > 0.5, "mean visible fraction of people {visible_fraction}");
}

#[test]
fn a_vehicle_drives_round_the_courtyard_without_collisions() {
    let world = World::load("courtyard").unwrap();
    let vehicle = motion_in("vehicle", &world, 120.0);
    let (mut length_m, mut before) = (0.0, vehicle.at(0.0));
    for step in 1..=1200 {
        let t_s = 0.1 * f64::from(step);
        let now = vehicle.at(t_s);
        let position_of = now.world_from_body.translation.vector;
        length_m += (position_of - before.world_from_body.translation.vector).xy().norm();
        before = now;
        // The vehicle's corners are 0.85 m from its centre. Checked from the height of a kerb to that of the driver's head.
        let middle = (now.world_from_body * nalgebra::Point3::new(-0.3, 0.0, -0.8)).coords;
        for (height_m, turn) in [0.3, 0.7, 1.2, 1.8].into_iter().flat_map(|h| (0..36).map(move |k| (h, k))) {
            let (sin, cos) = (TAU * f64::from(turn) / 36.0).sin_cos();
            let origin_in_world = Vector::new(middle.x, middle.y, height_m);
            let ray = Ray { origin_in_world, direction_in_world: Vector::new(cos, sin, 0.0) };
            let hit = world.cast(&ray, 0.85, t_s);
            assert!(hit.is_none(), "at {t_s} s, {middle:?}: {hit:?}");
        }
        // The vehicle moves along its heading, with a lateral acceleration below the friction limit.
        let velocity = now.velocity_in_world.xy();
        let ahead = (now.world_from_body.rotation * Vector::x()).xy().normalize();
        let sideways = (velocity - ahead * velocity.dot(&ahead)).norm();
        assert!(velocity.norm() < 2.0 && sideways < 0.6, "at {t_s} s: {velocity:?}, {sideways} m/s sideways");
        assert!(now.angular_velocity_in_world.z.abs() * velocity.norm() < 0.2 * 9.81, "at {t_s} s");
    }
    // 120 s at 1.5 m/s less the rest and eight corners: more than a lap of 97 m.
    assert!(length_m > 97.0 && length_m < 180.0, "{length_m} m");
}

#[test]
fn nothing_in_the_assembly_plant_runs_into_the_operator_or_through_walls() {
    let world = World::load("assembly_plant").unwrap();
    let hand = motion_in("hand", &world, 180.0);
    let mut moved = 0;
    for step in 0..720 {
        let t_s = 0.25 * f64::from(step);
        let at = hand.at(t_s).world_from_body.translation.vector;
        for height_m in [0.4, 1.0, 1.4] {
            let near = world.distance_to_movers_m(&Vector::new(at.x, at.y, height_m), 0.9, t_s);
            assert!(near.is_none(), "{near:?} m from the operator at {t_s} s, {at:?}");
        }
        moved += usize::from(world.distance_to_movers_m(&at, 4.0, t_s).is_some());
    }
    assert!(moved > 20, "people or vehicles pass within 4 m in {moved} of 720 samples only");
    // The people walk free of all static objects.
    let movers = parse::<SceneSpec>(&find(Kind::Scene, "assembly_plant").unwrap()).unwrap().movers;
    for (index, person) in movers.iter().enumerate().filter(|(_, mover)| mover.template == "person") {
        for step in 0..480 {
            let foot = position_of(person, 0.25 * f64::from(step));
            for height_m in [0.5, 1.0, 1.5] {
                let near = world.nearest(&(foot + Vector::z() * height_m), 0.3);
                assert!(near.is_none(), "person {index} at {foot:?}: {near:?}");
            }
        }
    }
}
