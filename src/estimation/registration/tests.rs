//! A closed-form walk through an empty room, whose open loop was bent.

use super::lidar::Shared;
use super::matches::Sum;
use super::*;
use crate::estimation::load;
use crate::estimation::surfel::Patch;
use crate::estimation::survey::{KnownLidar, Sighting};
use crate::geometry::{Matrix, Pose, Rotation, from_roll_pitch_yaw};
use crate::measurement::{ImuNoise, LidarNoise};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const DURATION_S: f64 = 40.0;
const LASER_IN_HEAD: Vector = Vector::new(0.03, -0.02, 0.08);
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

/// An IMU in the head's origin, and a lidar beside it.
fn calibration() -> Calibration {
    Calibration {
        head_from_laser: Pose::from_parts(LASER_IN_HEAD.into(), Rotation::identity()),
        head_from_imu: Pose::identity(),
        imu: ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 1e-3,
            accel_density_m_per_s2_per_sqrt_hz: 1e-3,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 1e-5,
            accel_bias_walk_m_per_s2_per_sqrt_s: 1e-4,
            gyro_turn_on_bias_rad_per_s: 1e-3,
            accel_turn_on_bias_m_per_s2: 1e-2,
            gyro_limit_rad_per_s: 10.0,
            accel_limit_m_per_s2: 50.0,
        },
        lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
    }
}

/// What an open loop left: its trajectory, covariances and survey, and the true trajectory.
struct Left {
    open: Trajectory,
    covariances: Vec<(Stamp, PoseCovariance)>,
    survey: Survey,
    truth: Trajectory,
}

impl Left {
    /// Registered with the default settings.
    fn registered(&self) -> ClosedLoop {
        self.registered_by(&load("default").unwrap())
    }

    fn registered_by(&self, spec: &EstimatorSpec) -> ClosedLoop {
        let Self { open, covariances, survey, .. } = self;
        let travelled = Travelled { map_from_head: open, covariances, lidar: &LidarCorrection::default(), survey };
        register(travelled, &calibration(), spec)
    }
}

/// An open loop bent by `bend`, with patches on the walls known to a millimetre, and the true trajectory.
fn bent(bend: impl Fn(f64) -> (Rotation, Vector)) -> Left {
    bent_and_seen(bend, 0.0)
}

/// The same by a lidar whose ranges lack `range_m`.
fn bent_and_seen(bend: impl Fn(f64) -> (Rotation, Vector), range_m: f64) -> Left {
    walked(bend, range_m, (DURATION_S, 200.0), 1)
}

/// The same with so many seconds, and patches a second, of three resolutions from `finest` on.
fn walked(
    bend: impl Fn(f64) -> (Rotation, Vector),
    range_m: f64,
    (duration_s, per_s): (f64, f64),
    finest: usize,
) -> Left {
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
        let head = truth(tau_s);
        let origin = (head * nalgebra::Point3::from(LASER_IN_HEAD)).coords;
        let (centre, normal) = wall(&origin, &direction);
        let reach = head.rotation.inverse() * (centre + normal * (1e-3 * normal_number()) - origin);
        let lidar = LidarCorrection { range_m, ..LidarCorrection::default() };
        let arm = head.rotation * (LASER_IN_HEAD + lidar.calibrated(&reach));
        let (turn, shift) = bend(tau_s);
        let spread = (0.5 * f64::from(1_u32 << level)).powi(2) / 12.0;
        let along = Matrix::identity() - normal * normal.transpose();
        let turn_matrix = turn.to_rotation_matrix().into_inner();
        let covariance = turn_matrix * (along * spread + normal * normal.transpose() * 1e-4) * turn_matrix.transpose();
        let patch = Patch {
            centre: head.translation.vector + shift + turn * arm,
            normal: turn * normal,
            points: 100.0,
            covariance,
            roughness_variance: 0.0,
            level,
        };
        Sighting { tau_s, patch, lidar: 0 }
    };
    let sightings = (0..((duration_s - 0.05) * per_s) as usize).map(sighting).collect();
    let covariances = times().step_by(10).map(|t| (stamp(t), PoseCovariance::identity() * (1e-5 * t))).collect();
    let trajectory = |pose: &dyn Fn(f64) -> Pose| Trajectory::from_poses(times().map(|t| (stamp(t), pose(t)))).unwrap();
    let survey = Survey {
        sightings,
        lidars: vec![KnownLidar { lidar: LidarCorrection::default(), until_s: duration_s }],
        ..Survey::default()
    };
    Left { open: trajectory(&estimated), covariances, survey, truth: trajectory(&truth) }
}

/// Root mean square distance of two trajectories' positions, m, and what is left of it but for a shift that is common
/// to all: the map hangs on its first pose, and what that errs all err.
fn apart_m(a: &Trajectory, b: &Trajectory) -> (f64, f64) {
    let apart: Vec<Vector> =
        a.poses().iter().zip(b.poses()).map(|(a, b)| a.translation.vector - b.translation.vector).collect();
    let n = apart.len() as f64;
    let mean = apart.iter().sum::<Vector>() / n;
    let rms = |from: &Vector| (apart.iter().map(|v| (v - from).norm_squared()).sum::<f64>() / n).sqrt();
    (rms(&Vector::zeros()), rms(&mean))
}

#[test]
fn a_walk_that_was_bent_is_straightened() {
    let left = bent(bend);
    let (closed, open, truth) = (left.registered(), &left.open, &left.truth);
    let (before, after) = (apart_m(open, truth), apart_m(&closed.trajectory, truth));
    assert_eq!(closed.report.left, None);
    assert!(
        before.1 > 0.01 && after.0 < 0.002 && after.1 < 0.0015,
        "{before:?} m before, {after:?} m after: {:?}",
        closed.report
    );
}

/// The same walk, in which floor and ceiling were seen at some times alone.
fn level_seen(when: impl Fn(f64) -> bool) -> ClosedLoop {
    let mut left = bent(bend);
    left.survey.sightings.retain(|seen| seen.patch.normal.z.abs() < 0.5 || when(seen.tau_s));
    left.registered()
}

#[test]
fn a_direction_held_weakly_is_closed_where_what_holds_it_was_seen_again() {
    let passing = level_seen(|t_s| (4.4..5.6).contains(&t_s));
    assert!(passing.report.conditioning < 0.1 && passing.report.seen_again < 0.01, "{:?}", passing.report);
    assert!(passing.report.left.is_some_and(|why| why.contains("seen again")), "{:?}", passing.report);
    // A lap later the head is there again.
    let again = level_seen(|t_s| (4.4..5.0).contains(&(t_s % 20.0)));
    assert!(again.report.conditioning < 0.1 && again.report.seen_again > 0.9, "{:?}", again.report);
    assert_eq!(again.report.left, None);
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
    let length = (120.0, 400.0);
    let left = walked(|t_s| drift(t_s, length.0), 0.0, length, 0);
    let recovered = left.registered();
    let (before, after) = (apart_m(&left.open, &left.truth).0, apart_m(&recovered.trajectory, &left.truth).0);
    assert!(recovered.report.loops.closed > 5, "{:?}", recovered.report);
    // As near as a walk that was bent by centimetres comes.
    assert!(before > 2.0 && after < 0.005, "{before} m before, {after} m after: {:?}", recovered.report);
}

#[test]
fn a_walk_that_did_not_drift_has_no_use_for_loops() {
    let straight = |_| (Rotation::identity(), Vector::zeros());
    let closed = walked(straight, 0.0, (60.0, 400.0), 0).registered();
    assert_eq!((closed.report.loops.verified, closed.report.loops.closed), (0, 0), "{:?}", closed.report);
}

#[test]
fn a_walk_that_was_not_bent_stays() {
    let left = bent(|_| (Rotation::identity(), Vector::zeros()));
    let closed = left.registered();
    // 100 patches in a slot, each known to a millimetre; the offset of the ranges is unknown too.
    let (all, but_for_a_shift) = apart_m(&closed.trajectory, &left.truth);
    assert!(all < 0.001 && but_for_a_shift < 0.0006, "{all} {but_for_a_shift} {:?}", closed.report);
}

#[test]
fn an_offset_of_the_ranges_is_found() {
    let left = bent_and_seen(bend, -0.012);
    let closed = left.registered();
    assert_eq!(closed.report.left, None);
    // 8,000 patches, each known to a millimetre.
    assert!((closed.lidar.range_m + 0.012).abs() < 2e-4, "{:?}", closed.lidar);
    assert!(apart_m(&closed.trajectory, &left.truth).0 < 0.003);
}

#[test]
fn a_lidar_that_sits_otherwise_is_as_the_open_loop_found_it_and_the_head_is_told_from_there() {
    let mut spec = load("default").unwrap();
    spec.extrinsics.estimated = true;
    // Until half of the way the open loop took the lidar for calibrated, then it knew better; what it saw was right
    // throughout.
    let found = LidarCorrection {
        turn: Rotation::from_scaled_axis(Vector::new(0.5, -0.3, 0.4) * 1_f64.to_radians()),
        shift: Vector::new(0.006, -0.009, 0.004),
        ..LidarCorrection::default()
    };
    let mut left = bent(bend);
    let head_from_head = calibration().head_from_laser * calibration().head_from_corrected_laser(&found).inverse();
    let late = |stamp: Stamp| stamp > Stamp::from_nanos(20_000_000_000);
    let told = |(stamp, pose): (Stamp, &Pose)| (stamp, if late(stamp) { pose * head_from_head } else { *pose });
    left.open = Trajectory::from_poses(left.open.iter().map(told)).unwrap();
    left.truth = Trajectory::from_poses(left.truth.iter().map(|(stamp, pose)| (stamp, pose * head_from_head))).unwrap();
    left.survey.lidars = vec![
        KnownLidar { lidar: LidarCorrection::default(), until_s: 20.0 },
        KnownLidar { lidar: found, until_s: DURATION_S },
    ];
    for sighting in &mut left.survey.sightings {
        sighting.lidar = u32::from(sighting.tau_s > 20.0);
    }
    let Left { open, covariances, survey, .. } = &left;
    let travelled = Travelled { map_from_head: open, covariances, lidar: &found, survey };
    let closed = register(travelled, &calibration(), &spec);
    assert_eq!(closed.report.left, None);
    assert!(closed.lidar.turn == found.turn && closed.lidar.shift == found.shift, "{:?}", closed.lidar);
    // The head's origin of the one truth is not that of the other: the map begins elsewhere.
    let (_, but_for_a_shift) = apart_m(&closed.trajectory, &left.truth);
    assert!(but_for_a_shift < 0.003, "{but_for_a_shift}");
}

#[test]
fn the_result_is_the_same_to_the_bit_with_one_thread_and_with_two() {
    let left = bent(bend);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| left.registered())
    };
    assert!(with(1) == with(2));
}

#[test]
fn a_map_that_is_turned_and_shifted_is_registered_alike() {
    let left = bent(bend);
    let there = Pose::from_parts(Vector::new(30.0, -7.0, 2.0).into(), from_roll_pitch_yaw(0.0, 0.0, 1.0));
    let moved = |sighting: &Sighting| {
        let (turn, patch) = (there.rotation.to_rotation_matrix().into_inner(), sighting.patch);
        let covariance = turn * patch.covariance * turn.transpose();
        let centre = turn * patch.centre + there.translation.vector;
        Sighting { patch: Patch { centre, normal: turn * patch.normal, covariance, ..patch }, ..*sighting }
    };
    let here = left.registered().trajectory.transformed(&there);
    let sightings = left.survey.sightings.iter().map(moved).collect();
    let survey = Survey { sightings, ..left.survey.clone() };
    let there = Left { open: left.open.transformed(&there), survey, ..left }.registered().trajectory;
    // The cells by which chapters are compared stand otherwise in the room: other pairs may be matched.
    assert!(apart_m(&here, &there).0 < 0.0005, "{:?}", apart_m(&here, &there));
}

#[test]
fn nothing_seen_leaves_the_open_loop() {
    let left = Left { survey: Survey::default(), ..bent(bend) };
    let closed = left.registered();
    assert_eq!(closed.trajectory, left.open);
    assert!(closed.report.left.is_some());
    let nothing = Left { open: Trajectory::new(), covariances: Vec::new(), ..left };
    assert_eq!(nothing.registered().trajectory, Trajectory::new());
}

/// Two patches of a wall a few millimetres apart, the first of which moves with the correction at its time alone.
#[test]
fn derivatives_of_a_match_are_those_of_differences() {
    let spec = load("default").unwrap();
    let Left { open, covariances, survey, .. } = bent(|_| (Rotation::identity(), Vector::zeros()));
    let length_s = 0.5 * spec.registration.knot_spacing_s;
    // In the middles of two slots.
    let times_s = [4.5 * length_s, 60.5 * length_s];
    let wall = survey.sightings.iter().find(|sighting| sighting.patch.normal.x > 0.5).unwrap();
    let sighting = |k: usize| {
        let centre = Vector::new(-4.9 + 0.004 * k as f64, 0.4 + 0.1 * k as f64, 1.4);
        Sighting { tau_s: times_s[k], patch: Patch { centre, ..wall.patch }, lidar: 0 }
    };
    let survey = Survey { sightings: vec![sighting(0), sighting(1)], ..survey };
    let course = Course::new(&open, &covariances, survey.origin, &spec.registration).unwrap();
    let matcher = Matcher::new(&spec.registration.matching(&spec.matching), &spec.registration.surfels(&spec.surfels));
    let mount = Mount::new(&calibration(), (&LidarCorrection::default(), false), &spec);
    let scene = Scene::new(&survey, &course, &mount, &spec.registration);
    let (first_knot, knots) = course.knots();
    let sum = |scene: &Scene| {
        let mut neighbours = Neighbours::unknown(spec.registration.levels);
        neighbours.use_from(0, scene, &matcher, 1);
        let (neighbours, of_all) = (&neighbours.in_use, &spec.registration);
        Matches { scene, neighbours, matcher: &matcher, spec: of_all, gate_m: 0.1, weakest: Vector::z() }
            .sum(&neighbours.pairs)
    };
    let Sum { link, tally, .. } = sum(&scene);
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
            let mut scene = Scene::new(&survey, &course, &mount, &spec.registration);
            scene.correct(first_knot, &x, &Shared::zeros());
            -sum(&scene).tally.rms_m()
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        // Left out is how the common normal turns with one of the two, by their distance of 0.1 m.
        assert!((difference - derivative[axis]).abs() < 0.06, "{axis}: {difference} and {}", derivative[axis]);
    }
}
