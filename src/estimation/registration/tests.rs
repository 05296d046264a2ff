//! A closed-form walk through an empty room, whose open loop was bent.

use super::*;
use crate::estimation::load;
use crate::estimation::surfel::Patch;
use crate::estimation::survey::Sighting;
use crate::geometry::{Matrix, Pose, Rotation, from_roll_pitch_yaw};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const DURATION_S: f64 = 40.0;
/// Corners of the room.
const ROOM: (Vector, Vector) = (Vector::new(-5.0, -4.0, 0.0), Vector::new(5.0, 4.0, 3.0));

/// Two laps of an ellipse.
fn truth(t_s: f64) -> Pose {
    let angle = std::f64::consts::TAU * t_s / 20.0;
    let position = Vector::new(2.5 * angle.cos(), 1.5 * angle.sin(), 1.2 + 0.2 * (3.0 * angle).sin());
    Pose::from_parts(position.into(), from_roll_pitch_yaw(0.3 * (7.0 * angle).sin(), 0.4 * (9.0 * angle).cos(), angle))
}

/// The planted correction, that of nothing at the start: up to 3 cm and 0.4 degrees.
fn bend(t_s: f64) -> (Rotation, Vector) {
    let x = t_s / DURATION_S;
    let turn = Vector::new(2e-4 * (9.0 * x).sin(), 0.0, 7e-3 * x * x);
    (Rotation::from_scaled_axis(turn), Vector::new(0.03 * x, -0.02 * x * x, 0.015 * (7.0 * x).sin()))
}

/// Where a ray from `origin` leaves the room, and the wall's normal, inwards.
fn wall(origin: &Vector, direction: &Vector) -> (Vector, Vector) {
    let leaves = |axis: usize| {
        let corner = if direction[axis] > 0.0 { ROOM.1[axis] } else { ROOM.0[axis] };
        (corner - origin[axis]) / direction[axis]
    };
    let axis = (0..3).min_by(|a, b| leaves(*a).total_cmp(&leaves(*b))).unwrap();
    let mut normal = Vector::zeros();
    normal[axis] = -direction[axis].signum();
    (origin + direction * leaves(axis), normal)
}

/// A trajectory, its covariances, its survey, and the true trajectory.
type Walked = (Trajectory, Vec<(Stamp, PoseCovariance)>, Survey, Trajectory);

/// An open loop bent by `bend`, with patches on the walls known to a millimetre, and the true trajectory.
fn bent(bend: impl Fn(f64) -> (Rotation, Vector)) -> Walked {
    walked(bend, (DURATION_S, 200.0), 1)
}

/// The same with so many seconds, and patches a second, of three resolutions from `finest` on.
fn walked(bend: impl Fn(f64) -> (Rotation, Vector), (duration_s, per_s): (f64, f64), finest: usize) -> Walked {
    let stamp = |t_s: f64| Stamp::from_nanos((t_s * 1e9).round() as i64);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let estimated = |t_s: f64| {
        let (pose, (turn, shift)) = (truth(t_s), bend(t_s));
        Pose::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation)
    };
    let times = || (0..(duration_s * 100.0) as usize).map(|k| k as f64 * 0.01);
    let sighting = |k: usize| {
        let tau_s = k as f64 / per_s;
        let mut normal_number = || random.sample::<f64, _>(StandardNormal);
        let direction = Vector::new(normal_number(), normal_number(), normal_number());
        let level = finest + k % 3;
        let origin = truth(tau_s).translation.vector;
        let (centre, normal) = wall(&origin, &direction);
        let arm = centre + normal * (1e-3 * normal_number()) - origin;
        let (turn, shift) = bend(tau_s);
        let spread = (0.5 * f64::from(1_u32 << level)).powi(2) / 12.0;
        let along = Matrix::identity() - normal * normal.transpose();
        let turn_matrix = turn.to_rotation_matrix().into_inner();
        let covariance = turn_matrix * (along * spread + normal * normal.transpose() * 1e-4) * turn_matrix.transpose();
        let patch =
            Patch { centre: origin + shift + turn * arm, normal: turn * normal, points: 100.0, covariance, level };
        Sighting { tau_s, patch }
    };
    let sightings = (0..((duration_s - 0.05) * per_s) as usize).map(sighting).collect();
    let covariances = times().step_by(10).map(|t| (stamp(t), PoseCovariance::identity() * (1e-5 * t))).collect();
    let trajectory = |pose: &dyn Fn(f64) -> Pose| Trajectory::from_poses(times().map(|t| (stamp(t), pose(t)))).unwrap();
    let survey = Survey { sightings, ..Survey::default() };
    (trajectory(&estimated), covariances, survey, trajectory(&truth))
}

/// Root mean square distance of two trajectories' positions, m; both begin in the same place.
fn apart_m(a: &Trajectory, b: &Trajectory) -> f64 {
    let squares =
        a.poses().iter().zip(b.poses()).map(|(a, b)| (a.translation.vector - b.translation.vector).norm_squared());
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn a_walk_that_was_bent_is_straightened() {
    let spec = load("default").unwrap();
    let (open, covariances, survey, truth) = bent(bend);
    let closed = register(&open, &covariances, &survey, &spec);
    let (before, after) = (apart_m(&open, &truth), apart_m(&closed.trajectory, &truth));
    assert_eq!(closed.report.left, None);
    // The first second, on which the map hangs, was seen by 200 patches from all sides: what it errs, all err.
    assert!(before > 0.02 && after < 0.002, "{before} m before, {after} m after: {:?}", closed.report);
}

/// A drift that begins and ends gently, of 5 m and 10 degrees over `duration_s`.
fn drift(t_s: f64, duration_s: f64) -> (Rotation, Vector) {
    let x = t_s / duration_s;
    let grown = x * x * (3.0 - 2.0 * x);
    let turn = Rotation::from_scaled_axis(Vector::z() * (10.0_f64.to_radians() * grown));
    (turn, Vector::new(4.0, 2.8, 1.0).normalize() * (5.0 * grown))
}

#[test]
fn a_drift_of_5_m_and_10_degrees_is_recovered() {
    let spec = load("default").unwrap();
    let length = (120.0, 400.0);
    let (open, covariances, survey, truth) = walked(|t_s| drift(t_s, length.0), length, 0);
    let recovered = register(&open, &covariances, &survey, &spec);
    let (before, after) = (apart_m(&open, &truth), apart_m(&recovered.trajectory, &truth));
    assert!(recovered.report.loops.closed > 5, "{:?}", recovered.report);
    // As near as a walk that was bent by centimetres comes.
    assert!(before > 2.0 && after < 0.005, "{before} m before, {after} m after: {:?}", recovered.report);
}

#[test]
fn a_walk_that_did_not_drift_has_no_use_for_loops() {
    let spec = load("default").unwrap();
    let (open, covariances, survey, _) = walked(|_| (Rotation::identity(), Vector::zeros()), (60.0, 400.0), 0);
    let closed = register(&open, &covariances, &survey, &spec);
    assert_eq!((closed.report.loops.verified, closed.report.loops.closed), (0, 0), "{:?}", closed.report);
}

#[test]
fn a_walk_that_was_not_bent_stays() {
    let spec = load("default").unwrap();
    let (open, covariances, survey, truth) = bent(|_| (Rotation::identity(), Vector::zeros()));
    let closed = register(&open, &covariances, &survey, &spec);
    // 100 patches in a slot, each known to a millimetre.
    assert!(apart_m(&closed.trajectory, &truth) < 0.0005, "{:?}", closed.report);
}

#[test]
fn the_result_is_the_same_to_the_bit_with_one_thread_and_with_two() {
    let spec = load("default").unwrap();
    let (open, covariances, survey, _) = bent(bend);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| register(&open, &covariances, &survey, &spec))
    };
    assert!(with(1) == with(2));
}

#[test]
fn a_map_that_is_turned_and_shifted_is_registered_alike() {
    let spec = load("default").unwrap();
    let (open, covariances, survey, _) = bent(bend);
    let there = Pose::from_parts(Vector::new(30.0, -7.0, 2.0).into(), from_roll_pitch_yaw(0.0, 0.0, 1.0));
    let moved = |sighting: &Sighting| {
        let (turn, patch) = (there.rotation.to_rotation_matrix().into_inner(), sighting.patch);
        let covariance = turn * patch.covariance * turn.transpose();
        let centre = turn * patch.centre + there.translation.vector;
        Sighting { patch: Patch { centre, normal: turn * patch.normal, covariance, ..patch }, ..*sighting }
    };
    let survey_there = Survey { sightings: survey.sightings.iter().map(moved).collect(), ..survey };
    let here = register(&open, &covariances, &survey, &spec).trajectory.transformed(&there);
    let there = register(&open.transformed(&there), &covariances, &survey_there, &spec).trajectory;
    // The cells by which chapters are compared stand otherwise in the room: other pairs may be matched.
    assert!(apart_m(&here, &there) < 0.0005, "{}", apart_m(&here, &there));
}

#[test]
fn nothing_seen_leaves_the_open_loop() {
    let spec = load("default").unwrap();
    let (open, covariances, ..) = bent(bend);
    let closed = register(&open, &covariances, &Survey::default(), &spec);
    assert_eq!(closed.trajectory, open);
    assert!(closed.report.left.is_some());
    assert_eq!(register(&Trajectory::new(), &[], &Survey::default(), &spec).trajectory, Trajectory::new());
}

/// Two patches of a wall a few millimetres apart, the first of which moves with the correction at its time alone.
#[test]
fn derivatives_of_a_match_are_those_of_differences() {
    let spec = load("default").unwrap();
    let (open, covariances, survey, _) = bent(|_| (Rotation::identity(), Vector::zeros()));
    let length_s = 0.5 * spec.registration.knot_spacing_s;
    // In the middles of two slots.
    let times_s = [4.5 * length_s, 60.5 * length_s];
    let wall = survey.sightings.iter().find(|sighting| sighting.patch.normal.x > 0.5).unwrap();
    let sighting = |k: usize| {
        let centre = Vector::new(-4.9 + 0.004 * k as f64, 0.4 + 0.1 * k as f64, 1.4);
        Sighting { tau_s: times_s[k], patch: Patch { centre, ..wall.patch } }
    };
    let survey = Survey { sightings: vec![sighting(0), sighting(1)], ..survey };
    let course = Course::new(&open, &covariances, survey.origin, &spec.registration).unwrap();
    let matcher = Matcher::new(&spec.registration.matching(&spec.matching), &spec.registration.surfels(&spec.surfels));
    let scene = Scene::new(&survey, &course, &spec.registration);
    let (first_knot, knots) = course.knots();
    let sum = |scene: &Scene| {
        let mut neighbours = Neighbours::unknown(spec.registration.levels);
        neighbours.use_from(0, scene, &matcher, 1);
        let (neighbours, of_all) = (&neighbours.in_use, &spec.registration);
        Matches { scene, neighbours, matcher: &matcher, spec: of_all, gate_m: 0.1, weakest: Vector::z() }
            .sum(&neighbours.pairs)
    };
    let (link, tally) = sum(&scene);
    assert_eq!(tally.matches, 1);
    // The first is 4 mm behind the second, along a normal in x.
    let e = -tally.rms_m();
    let derivative = link.first.right / (-tally.weights * e);
    let step = 1e-6;
    for axis in 0..6 {
        let moved = |by: f64| {
            let mut x = vec![0.0; 6 * knots];
            let segment = (scene.middles[scene.slots[0] as usize].first - first_knot) as usize;
            (segment..segment + 4).for_each(|knot| x[6 * knot + axis] = by);
            let mut scene = Scene::new(&survey, &course, &spec.registration);
            scene.correct(first_knot, &x);
            -sum(&scene).1.rms_m()
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        // Left out is how the common normal turns with one of the two, by their distance of 0.1 m.
        assert!((difference - derivative[axis]).abs() < 0.06, "{axis}: {difference} and {}", derivative[axis]);
    }
}
