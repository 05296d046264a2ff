//! Relocalisation in synthetic rooms, a corridor and on bare ground.

use super::super::limits::MAP_LIMITS;
use super::super::localised_pose::offset_pose;
use super::*;
use zsim_base::geometry::from_roll_pitch_yaw;

/// Patches of one resolution of a room of 6 m by 4 m by 2.5 m with a pillar; `at` is the position of the centres within
/// their cells, 0..1.
fn room(edge_m: f64, level: usize, at: f64) -> Vec<Patch> {
    let mut patches = Vec::new();
    let mut wall = |corner: Vector, along: Vector, up: Vector, normal: Vector| {
        let (wide, high) = (along.norm(), up.norm());
        let (columns, rows) = ((wide / edge_m).ceil() as usize, (high / edge_m).ceil() as usize);
        for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let position = |k: usize, of: usize| (k as f64 + at) / of as f64;
            let centre = corner + along * position(i, columns) + up * position(j, rows);
            let (u, v) = (along / wide, up / high);
            let flat = (u * u.transpose() + v * v.transpose()) * (edge_m * edge_m / 12.0);
            let covariance: Matrix = flat + normal * normal.transpose() * 1e-4;
            patches.push(Patch { centre, normal, points: 100.0, covariance, roughness_variance: 0.0, level });
        }
    };
    let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
    wall(Vector::zeros(), x * 6.0, y * 4.0, z);
    wall(z * 2.5, x * 6.0, y * 4.0, -z);
    wall(Vector::zeros(), x * 6.0, z * 2.5, y);
    wall(y * 4.0, x * 6.0, z * 2.5, -y);
    wall(Vector::zeros(), y * 4.0, z * 2.5, x);
    wall(x * 6.0, y * 4.0, z * 2.5, -x);
    wall(Vector::new(2.0, 1.0, 0.0), y * 0.8, z * 2.5, -x);
    wall(Vector::new(2.8, 1.0, 0.0), y * 0.8, z * 2.5, x);
    wall(Vector::new(2.0, 1.8, 0.0), x * 0.8, z * 2.5, y);
    patches
}

fn all_levels(edge_m: f64, at: f64) -> Vec<Patch> {
    (0..3).flat_map(|level| room(edge_m * f64::from(1 << level), level, at)).collect()
}

fn relocaliser(patches: &[Patch]) -> Relocaliser {
    let spec = crate::load("default").unwrap();
    let map = SurfelMap::new(0.4, 3, patches.iter().map(|patch| patch.to_map_surfel(0.002)).collect()).unwrap();
    let solve = SolveSpec { match_sigma_m: 0.01, ..spec.solve };
    Relocaliser::new(&map, &spec.matching, &spec.surfels, &solve)
}

#[test]
fn room_is_found_from_a_start_1_m_and_20_degrees_off() {
    let relocaliser = relocaliser(&all_levels(0.4, 0.5));
    for k in 0..12 {
        let wave = |m: f64| (k as f64 * m + 0.3).sin();
        // The true pose.
        let map_from_query = Pose::from_parts(
            Vector::new(3.0 * wave(0.9), 2.0, -1.0).into(),
            from_roll_pitch_yaw(0.005, -0.004, 3.0 * wave(1.7)),
        );
        let from = map_from_query.inverse_transform_point(&Vector::new(4.0, 2.5, 1.2).into()).coords;
        let query: Vec<Patch> =
            all_levels(0.37, 0.4).iter().map(|patch| patch.moved_by(&map_from_query.inverse())).collect();
        let direction = Vector::new(wave(2.3), wave(3.1), 0.3 * wave(4.7)).normalize();
        let start = offset_pose(&map_from_query, &from, 20_f64.to_radians() * wave(5.3).signum(), direction);
        let found = relocaliser.find(&query, &from, &start, &MAP_LIMITS).unwrap();
        let error = found.map_from_query.inverse() * map_from_query;
        assert!(error.translation.vector.norm() < 2e-3 && error.rotation.angle() < 1e-3, "{k}: {error}");
        assert!(found.inlier_ratio > 0.9, "{}", found.inlier_ratio);
    }
}

#[test]
fn symmetric_room_started_at_the_wrong_end_matches_better_elsewhere() {
    let relocaliser = relocaliser(&all_levels(0.4, 0.5));
    let query = all_levels(0.37, 0.4);
    let from = Vector::new(4.0, 2.5, 1.2);
    // The room rotated by 180 degrees about the middle: only the pillar differs.
    let half = from_roll_pitch_yaw(0.0, 0.0, std::f64::consts::PI);
    let wrong = Pose::from_parts(Vector::new(6.0, 4.0, 0.0).into(), half);
    let found = relocaliser.find(&query, &from, &wrong, &MAP_LIMITS).unwrap();
    assert!(
        pose_distance(&found.map_from_query, &wrong, &from).0 < 0.1 && found.inlier_ratio > 0.7,
        "{}",
        found.inlier_ratio
    );
    let better = relocaliser.find_better_elsewhere(&query, &from, &found).unwrap();
    let (distance_m, angle) = pose_distance(&better.map_from_query, &Pose::identity(), &from);
    assert!(distance_m < 2e-3 && angle < 1e-3, "{distance_m} m, {angle} rad");
    // From the correct end no pose is better.
    let found = relocaliser.find(&query, &from, &Pose::identity(), &MAP_LIMITS).unwrap();
    assert_eq!(relocaliser.find_better_elsewhere(&query, &from, &found), None);
}

/// Patches of one resolution of a corridor along x, 2 m wide, without end walls, between `from_m` and `to_m`.
fn corridor(level: usize, from_m: f64, to_m: f64) -> Vec<Patch> {
    let edge_m = 0.4 * f64::from(1 << level);
    let mut patches = Vec::new();
    for i in 0..((to_m - from_m) / edge_m) as usize {
        let x = Vector::x() * (from_m + (i as f64 + 0.5) * edge_m);
        let mut wall = |place: Vector, normal: Vector| {
            let across = Matrix::identity() - normal * normal.transpose();
            let covariance = across * (edge_m * edge_m / 12.0) + normal * normal.transpose() * 1e-4;
            let centre = x + place;
            patches.push(Patch { centre, normal, points: 100.0, covariance, roughness_variance: 0.0, level });
        };
        for k in 0..((2.0 / edge_m) as usize).max(1) {
            let along = (k as f64 + 0.5) * edge_m;
            wall(Vector::new(0.0, along, 0.0), Vector::z());
            wall(Vector::new(0.0, 0.0, along), Vector::y());
            wall(Vector::new(0.0, 2.0, along), -Vector::y());
        }
    }
    patches
}

#[test]
fn corridor_keeps_the_expected_pose_along_it_with_a_large_covariance() {
    let all = |from_m: f64, to_m: f64| (0..3).flat_map(|level| corridor(level, from_m, to_m)).collect::<Vec<_>>();
    let relocaliser = relocaliser(&all(0.0, 24.0));
    let from = Vector::new(14.0, 1.0, 1.2);
    let query = all(8.0, 20.0);
    // The expected pose is 0.2 m to the side, with a heading error of 0.1 rad.
    let start = offset_pose(&Pose::identity(), &from, 0.1, Vector::new(0.0, 0.2, 0.0));
    let found = relocaliser.find(&query, &from, &start, &RelocalisationLimits::after_gap(1.0, 0.01)).unwrap();
    let error = found.map_from_query.transform_point(&from.into()).coords - from;
    assert!(error.y.abs() < 2e-3 && error.z.abs() < 2e-3 && error.x.abs() < 0.05, "{error}");
    assert!(found.map_from_query.rotation.angle() < 1e-3, "{}", found.map_from_query);
    let sigma = |k: usize| found.covariance[(k, k)].sqrt();
    assert!(sigma(3) > 0.2 && sigma(4) < 0.01, "{} m along, {} m across", sigma(3), sigma(4));
    // In a complete map an ambiguous pose is rejected.
    assert!(relocaliser.find(&query, &from, &start, &MAP_LIMITS).unwrap_err().contains("matches as well"));
}

#[test]
fn bare_ground_is_rejected() {
    let ground = |from_m: f64, to_m: f64| {
        let all = (0..3).flat_map(|level| corridor(level, from_m, to_m));
        all.filter(|patch| patch.normal == Vector::z()).collect::<Vec<_>>()
    };
    let (from, start) = (Vector::new(14.0, 1.0, 1.2), Pose::identity());
    let found = relocaliser(&ground(0.0, 24.0)).find(
        &ground(8.0, 20.0),
        &from,
        &start,
        &RelocalisationLimits::after_gap(0.5, 0.01),
    );
    assert!(found.is_err(), "{found:?}");
}

#[test]
fn distant_pose_and_too_few_surfels_are_rejected() {
    let relocaliser = relocaliser(&all_levels(0.4, 0.5));
    let far = Pose::translation(30.0, 0.0, 0.0);
    let query = all_levels(0.4, 0.5);
    let from = Vector::new(4.0, 2.5, 1.2);
    assert!(relocaliser.find(&query, &from, &far, &MAP_LIMITS).unwrap_err().contains("match the map"));
    let few: Vec<Patch> = query.iter().take(20).copied().collect();
    let message = relocaliser.find(&few, &from, &Pose::identity(), &MAP_LIMITS).unwrap_err();
    assert!(message.contains("20 finest surfels"), "{message}");
}
