//! Registration of a synthetic trajectory through an empty room, with a known distortion of the open loop.

use super::equations::Shared;
use super::matches::BinPairSums;
use super::*;
use crate::load;
use crate::observed::{LidarCorrectionPeriod, MotionByViews, ObservedSurfel};
use crate::surfel::Patch;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use zsim_base::geometry::{Matrix, Pose, Rotation, from_roll_pitch_yaw};
use zsim_base::measurement::{ImuAveraging, ImuNoise, LidarNoise};

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

/// Distortion of the open loop, zero at the start: up to 3 cm and 0.4 degrees.
fn distortion(t_s: f64) -> (Rotation, Vector) {
    let x = t_s / DURATION_S;
    let turn = Vector::new(2e-4 * (9.0 * x).sin(), 0.0, 7e-3 * x * x);
    (Rotation::from_scaled_axis(turn), Vector::new(0.03 * x, -0.02 * x * x, 0.015 * (7.0 * x).sin()))
}

/// Intersection of a ray from `origin` with the walls, and the inward normal.
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

/// An IMU at the origin of the head, and a lidar with a known offset.
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
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: 10.0,
            accel_limit_m_per_s2: 50.0,
        },
        imu_averaging: ImuAveraging::ConingCorrected,
        lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
    }
}

/// Result of an open loop (trajectory, covariances, observed surfels), and the true trajectory.
struct Setup {
    open: Trajectory,
    covariances: Vec<(Stamp, PoseCovariance)>,
    observed: ObservedSurfels,
    truth: Trajectory,
}

impl Setup {
    /// Registers with the default settings.
    fn registered(&self) -> ClosedLoop {
        self.registered_by(&load("default").unwrap())
    }

    fn registered_by(&self, spec: &EstimatorSpec) -> ClosedLoop {
        let Self { open, covariances, observed, .. } = self;
        let input =
            RegistrationInput { map_from_head: open, covariances, lidar: &LidarCorrection::default(), observed };
        register(input, &calibration(), spec).unwrap()
    }
}

/// An open loop with the given distortion; surfels on the walls have a noise of 1 mm.
fn distorted(distortion: impl Fn(f64) -> (Rotation, Vector)) -> Setup {
    distorted_with_bias(distortion, 0.0)
}

/// The same with a range bias of `range_m`.
fn distorted_with_bias(distortion: impl Fn(f64) -> (Rotation, Vector), range_m: f64) -> Setup {
    simulated(distortion, range_m, DURATION_S, 200.0, 1)
}

/// The same with the given duration and number of surfels per second, of three resolutions from `finest` on.
fn simulated(
    distortion: impl Fn(f64) -> (Rotation, Vector),
    range_m: f64,
    duration_s: f64,
    per_s: f64,
    finest: usize,
) -> Setup {
    let stamp = |t_s: f64| Stamp::from_nanos((t_s * 1e9).round() as i64);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let estimated = |t_s: f64| {
        let (pose, (turn, shift)) = (truth(t_s), distortion(t_s));
        Pose::from_parts((pose.translation.vector + shift).into(), turn * pose.rotation)
    };
    let times = || (0..(duration_s * 100.0) as usize).map(|k| k as f64 * 0.01);
    let surfel = |k: usize| {
        let tau_s = k as f64 / per_s;
        let mut normal_number = || random.sample::<f64, _>(StandardNormal);
        let direction = Vector::new(normal_number(), normal_number(), normal_number());
        let level = finest + k % 3;
        let head = truth(tau_s);
        let origin = (head * nalgebra::Point3::from(LASER_IN_HEAD)).coords;
        let (centre, normal) = wall(&origin, &direction);
        let reach = head.rotation.inverse() * (centre + normal * (1e-3 * normal_number()) - origin);
        let lidar = LidarCorrection { range_m, ..LidarCorrection::default() };
        let arm = head.rotation * (LASER_IN_HEAD + lidar.remove(&reach));
        let (turn, shift) = distortion(tau_s);
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
        ObservedSurfel { tau_s, patch, weakness: 0.0, lidar: 0 }
    };
    let surfels = (0..((duration_s - 0.05) * per_s) as usize).map(surfel).collect();
    let covariances =
        times().step_by(10).map(|t| (stamp(t), PoseCovariance::identity() * (1e-5 * (1.0 + t)))).collect();
    let trajectory = |pose: &dyn Fn(f64) -> Pose| Trajectory::from_poses(times().map(|t| (stamp(t), pose(t)))).unwrap();
    let observed = ObservedSurfels {
        surfels,
        lidars: vec![LidarCorrectionPeriod { lidar: LidarCorrection::default(), until_s: duration_s }],
        ..ObservedSurfels::default()
    };
    Setup { open: trajectory(&estimated), covariances, observed, truth: trajectory(&truth) }
}

/// Root mean square distance of the positions of two trajectories, m: total, and after removal of the mean difference.
///
/// The first pose defines the map; an error of that pose is common to all others.
fn rms_distance_m(a: &Trajectory, b: &Trajectory) -> (f64, f64) {
    let difference: Vec<Vector> =
        a.poses().iter().zip(b.poses()).map(|(a, b)| a.translation.vector - b.translation.vector).collect();
    let n = difference.len() as f64;
    let mean = difference.iter().sum::<Vector>() / n;
    let rms = |from: &Vector| (difference.iter().map(|v| (v - from).norm_squared()).sum::<f64>() / n).sqrt();
    (rms(&Vector::zeros()), rms(&mean))
}

#[test]
fn distorted_trajectory_is_corrected() {
    let setup = distorted(distortion);
    let (closed, open, truth) = (setup.registered(), &setup.open, &setup.truth);
    let (before, after) = (rms_distance_m(open, truth), rms_distance_m(&closed.trajectory, truth));
    assert_eq!(closed.report.rejected_because, None);
    assert!(
        before.1 > 0.01 && after.0 < 0.002 && after.1 < 0.0015,
        "{before:?} m before, {after:?} m after: {:?}",
        closed.report
    );
}

#[test]
fn each_pose_has_a_positive_definite_covariance_below_that_of_the_open_loop() {
    let setup = distorted(distortion);
    let found = setup.registered().covariances;
    assert_eq!((found.len(), found[0]), (setup.covariances.len(), setup.covariances[0]));
    for ((at, covariance), (stamp, of_open_loop)) in found.iter().zip(&setup.covariances) {
        assert!(at == stamp && covariance.cholesky().is_some(), "{covariance}");
        assert!((of_open_loop - covariance).symmetric_eigenvalues().min() > -1e-12, "{covariance} {of_open_loop}");
    }
}

/// Views pull every lap to the first lap's distortion, so revisited surfaces agree; the motion of the second lap does not.
#[test]
fn distortion_that_views_repeat_is_found_in_the_motion_without_them() {
    const LAP_S: f64 = 20.0;
    let phase = |t_s: f64| std::f64::consts::TAU * t_s / LAP_S;
    let mut setup = distorted(|t_s| (Rotation::identity(), Vector::z() * (0.03 * phase(t_s).sin())));
    // Only the floor below and the ceiling above show the height.
    setup.observed.surfels.retain(|surfel| {
        let away = surfel.patch.centre - truth(surfel.tau_s).translation.vector;
        surfel.patch.normal.z.abs() < 0.5 || away.xy().norm() < 0.5
    });
    let with = rms_distance_m(&setup.registered().trajectory, &setup.truth).0;
    // The first lap was distorted by the sensors; the second one would have been correct.
    let at = |trajectory: &Trajectory, s: f64| trajectory.at(Stamp::from_nanos((s * 1e9) as i64)).unwrap();
    let change = |k: usize| {
        let (from_s, until_s) = (LAP_S + 0.5 * k as f64, LAP_S + 0.5 * (k + 1) as f64);
        let without = at(&setup.truth, from_s).inverse() * at(&setup.truth, until_s);
        let change = at(&setup.open, from_s) * without * at(&setup.open, until_s).inverse();
        MotionByViews { from_s, until_s, change, covariance_per_s: nalgebra::Matrix6::zeros() }
    };
    let steps = ((DURATION_S - LAP_S) / 0.5) as usize - 1;
    setup.observed.by_views = (0..steps).map(change).collect();
    let without = rms_distance_m(&setup.registered().trajectory, &setup.truth).0;
    assert!(with > 0.01 && without < 0.8 * with, "{with} m with, {without} m without");
}

/// Registers the same trajectory with floor and ceiling observed only `when` requested.
fn registered_with_floor(when: impl Fn(f64) -> bool) -> ClosedLoop {
    let mut setup = distorted(distortion);
    setup.observed.surfels.retain(|surfel| surfel.patch.normal.z.abs() < 0.5 || when(surfel.tau_s));
    setup.registered()
}

#[test]
fn weak_direction_is_accepted_only_with_revisited_surfaces() {
    let passing = registered_with_floor(|t_s| (4.4..5.6).contains(&t_s));
    assert!(passing.report.conditioning < 0.1 && passing.report.revisited < 0.01, "{:?}", passing.report);
    assert!(passing.report.rejected_because.is_some_and(|why| why.contains("revisited")), "{:?}", passing.report);
    // One lap later the head is at the same position.
    let again = registered_with_floor(|t_s| (4.4..5.0).contains(&(t_s % 20.0)));
    assert!(again.report.conditioning < 0.1 && again.report.revisited > 0.9, "{:?}", again.report);
    assert_eq!(again.report.rejected_because, None);
}

/// A drift of 5 m and 10 degrees over `duration_s`, with a smooth start and end.
fn drift(t_s: f64, duration_s: f64) -> (Rotation, Vector) {
    let x = t_s / duration_s;
    let grown = x * x * (3.0 - 2.0 * x);
    let turn = Rotation::from_scaled_axis(Vector::z() * (10.0_f64.to_radians() * grown));
    (turn, Vector::new(4.0, 2.8, 1.0).normalize() * (5.0 * grown))
}

#[test]
fn drift_of_5_m_and_10_degrees_is_corrected_by_loop_closure() {
    let duration_s = 120.0;
    let setup = simulated(|t_s| drift(t_s, duration_s), 0.0, duration_s, 400.0, 0);
    let recovered = setup.registered();
    let (before, after) =
        (rms_distance_m(&setup.open, &setup.truth).0, rms_distance_m(&recovered.trajectory, &setup.truth).0);
    assert!(recovered.report.loops.closed > 5, "{:?}", recovered.report);
    // As accurate as with a distortion of centimetres.
    assert!(before > 2.0 && after < 0.005, "{before} m before, {after} m after: {:?}", recovered.report);
}

#[test]
fn trajectory_without_drift_needs_no_loop_closure() {
    let straight = |_| (Rotation::identity(), Vector::zeros());
    let closed = simulated(straight, 0.0, 60.0, 400.0, 0).registered();
    assert_eq!((closed.report.loops.verified, closed.report.loops.closed), (0, 0), "{:?}", closed.report);
}

#[test]
fn undistorted_trajectory_is_unchanged() {
    let setup = distorted(|_| (Rotation::identity(), Vector::zeros()));
    let closed = setup.registered();
    // 100 surfels per time bin with a noise of 1 mm; the range bias is unknown, too.
    let (all, but_for_a_shift) = rms_distance_m(&closed.trajectory, &setup.truth);
    assert!(all < 0.001 && but_for_a_shift < 0.0006, "{all} {but_for_a_shift} {:?}", closed.report);
}

#[test]
fn range_bias_is_estimated() {
    let setup = distorted_with_bias(distortion, -0.012);
    let closed = setup.registered();
    assert_eq!(closed.report.rejected_because, None);
    // 8,000 surfels with a noise of 1 mm.
    assert!((closed.lidar.range_m + 0.012).abs() < 2e-4, "{:?}", closed.lidar);
    assert!(rms_distance_m(&closed.trajectory, &setup.truth).0 < 0.003);
}

/// The power of an echo falls with the square of the range, and the range is longer by 0.1 mm at 1 m, 10 mm at 10 m.
#[test]
fn range_bias_of_weak_echoes_is_estimated() {
    const BIAS_PER_M: f64 = 1e-4;
    let mut setup = distorted(distortion);
    let mut squares = Vec::new();
    for surfel in &mut setup.observed.surfels {
        let head = setup.open.at(Stamp::from_nanos((surfel.tau_s * 1e9).round() as i64)).unwrap();
        let ray = surfel.patch.centre - (head * nalgebra::Point3::from(LASER_IN_HEAD)).coords;
        surfel.patch.centre += ray * (BIAS_PER_M * ray.norm());
        squares.push(ray.norm_squared());
        surfel.weakness = 1e-6 * ray.norm_squared();
    }
    squares.sort_by(f64::total_cmp);
    let closed = setup.registered();
    let expected = -BIAS_PER_M * squares[squares.len() / 2];
    assert!((closed.report.weak_range_m / expected - 1.0).abs() < 0.1, "{expected} {:?}", closed.report);
    setup.observed.surfels.iter_mut().for_each(|surfel| surfel.weakness = 0.0);
    let without = setup.registered();
    assert_eq!(without.report.weak_range_m, 0.0);
    let error = |closed: &ClosedLoop| rms_distance_m(&closed.trajectory, &setup.truth).0;
    assert!(error(&closed) < 0.7 * error(&without), "{} {}", error(&closed), error(&without));
}

#[test]
fn open_loop_extrinsics_are_kept_and_the_head_is_recalibrated() {
    let mut spec = load("default").unwrap();
    spec.extrinsics.estimated = true;
    // The open loop used the calibration in the first half and the corrected extrinsics in the second; the surfels are
    // correct throughout.
    let found = LidarCorrection {
        rotation: Rotation::from_scaled_axis(Vector::new(0.5, -0.3, 0.4) * 1_f64.to_radians()),
        translation: Vector::new(0.006, -0.009, 0.004),
        ..LidarCorrection::default()
    };
    let mut setup = distorted(distortion);
    let head_from_head = calibration().head_from_laser * calibration().head_from_corrected_laser(&found).inverse();
    let late = |stamp: Stamp| stamp > Stamp::from_nanos(20_000_000_000);
    let to_head = |(stamp, pose): (Stamp, &Pose)| (stamp, if late(stamp) { pose * head_from_head } else { *pose });
    setup.open = Trajectory::from_poses(setup.open.iter().map(to_head)).unwrap();
    setup.truth =
        Trajectory::from_poses(setup.truth.iter().map(|(stamp, pose)| (stamp, pose * head_from_head))).unwrap();
    setup.observed.lidars = vec![
        LidarCorrectionPeriod { lidar: LidarCorrection::default(), until_s: 20.0 },
        LidarCorrectionPeriod { lidar: found, until_s: DURATION_S },
    ];
    for surfel in &mut setup.observed.surfels {
        surfel.lidar = u32::from(surfel.tau_s > 20.0);
    }
    let Setup { open, covariances, observed, .. } = &setup;
    let input = RegistrationInput { map_from_head: open, covariances, lidar: &found, observed };
    let closed = register(input, &calibration(), &spec).unwrap();
    assert_eq!(closed.report.rejected_because, None);
    assert!(
        closed.lidar.rotation == found.rotation && closed.lidar.translation == found.translation,
        "{:?}",
        closed.lidar
    );
    // The origins of the head frames differ, and so does the start of the map.
    let (_, but_for_a_shift) = rms_distance_m(&closed.trajectory, &setup.truth);
    assert!(but_for_a_shift < 0.003, "{but_for_a_shift}");
}

#[test]
fn result_is_bit_identical_with_one_and_two_threads() {
    let setup = distorted(distortion);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| setup.registered())
    };
    assert!(with(1) == with(2));
}

#[test]
fn registration_is_invariant_to_the_map_frame() {
    let setup = distorted(distortion);
    let there = Pose::from_parts(Vector::new(30.0, -7.0, 2.0).into(), from_roll_pitch_yaw(0.0, 0.0, 1.0));
    let moved = |surfel: &ObservedSurfel| {
        let (turn, patch) = (there.rotation.to_rotation_matrix().into_inner(), surfel.patch);
        let covariance = turn * patch.covariance * turn.transpose();
        let centre = turn * patch.centre + there.translation.vector;
        ObservedSurfel { patch: Patch { centre, normal: turn * patch.normal, covariance, ..patch }, ..*surfel }
    };
    let here = setup.registered().trajectory.transformed(&there);
    let surfels = setup.observed.surfels.iter().map(moved).collect();
    let observed = ObservedSurfels { surfels, ..setup.observed.clone() };
    let there = Setup { open: setup.open.transformed(&there), observed, ..setup }.registered().trajectory;
    // The cells for the selection of submap pairs differ, so other pairs may be matched.
    assert!(rms_distance_m(&here, &there).0 < 0.0005, "{:?}", rms_distance_m(&here, &there));
}

#[test]
fn no_observed_surfels_keep_the_open_loop() {
    let setup = Setup { observed: ObservedSurfels::default(), ..distorted(distortion) };
    let closed = setup.registered();
    assert_eq!(closed.trajectory, setup.open);
    assert!(closed.report.rejected_because.is_some());
    let nothing = Setup { open: Trajectory::new(), covariances: Vec::new(), ..setup };
    assert_eq!(nothing.registered().trajectory, Trajectory::new());
}

/// Two patches of a wall at a distance of 4 mm, each of the given number of points, at the middles of two time bins.
struct PatchesOfWall {
    spec: EstimatorSpec,
    observed: ObservedSurfels,
    corrected: CorrectedTrajectory,
    lidar_model: LidarModel,
    matcher: Matcher,
}

impl PatchesOfWall {
    fn of_points(points: f64) -> Self {
        let spec = load("default").unwrap();
        let Setup { open, covariances, observed, .. } = distorted(|_| (Rotation::identity(), Vector::zeros()));
        let length_s = 0.5 * spec.registration.knot_spacing_s;
        let times_s = [4.5 * length_s, 60.5 * length_s];
        let wall = observed.surfels.iter().find(|surfel| surfel.patch.normal.x > 0.5).unwrap();
        let surfel = |k: usize| {
            let centre = Vector::new(-4.9 + 0.004 * k as f64, 0.4 + 0.1 * k as f64, 1.4);
            ObservedSurfel { tau_s: times_s[k], patch: Patch { centre, points, ..wall.patch }, ..*wall }
        };
        let observed = ObservedSurfels { surfels: vec![surfel(0), surfel(1)], ..observed };
        let corrected = CorrectedTrajectory::new(&open, &open, &covariances, observed.origin, &spec.registration);
        let matcher = Matcher::new(&spec.matching, &spec.registration.surfels(&spec.surfels));
        let lidar_model = LidarModel::new(&calibration(), &LidarCorrection::default(), &observed, &spec);
        Self { corrected: corrected.unwrap(), spec, observed, lidar_model, matcher }
    }

    fn scene(&self) -> Scene {
        Scene::new(&self.observed, &self.corrected, &self.lidar_model, &self.spec.registration)
    }

    fn sum(&self, scene: &Scene) -> BinPairSums {
        let (spec, matcher) = (&self.spec.registration, &self.matcher);
        let mut neighbours = Neighbours::new(matcher.levels);
        neighbours.update(0, scene, matcher, 1);
        let neighbours = &neighbours.active;
        Matches { scene, neighbours, matcher, spec, gate_m: 0.1, revisit_s: 10.0, weakest: Vector::z() }
            .sum(&neighbours.pairs)
    }
}

/// Only the first patch moves with the correction.
#[test]
fn derivatives_of_a_match_match_finite_differences() {
    let patches = PatchesOfWall::of_points(100.0);
    let scene = patches.scene();
    let (first_knot, knots) = patches.corrected.knots();
    let BinPairSums { pair_term, statistics, .. } = patches.sum(&scene);
    assert_eq!(statistics.matches, 1);
    // The first is 4 mm below the second along the normal, x.
    let e = -statistics.rms_m();
    let derivative = pair_term.first.right / (-statistics.weights * e);
    let step = 1e-6;
    for axis in 0..6 {
        let moved = |by: f64| {
            let mut x = vec![0.0; 6 * knots];
            let segment = (scene.bin_bases[scene.bins[0] as usize].first - first_knot) as usize;
            (segment..segment + 4).for_each(|knot| x[6 * knot + axis] = by);
            let mut scene = patches.scene();
            scene.correct(first_knot, &x, &Shared::zeros());
            -patches.sum(&scene).statistics.rms_m()
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        // The derivative neglects the rotation of the common normal, with a lever arm of 0.1 m.
        assert!((difference - derivative[axis]).abs() < 0.06, "{axis}: {difference} and {}", derivative[axis]);
    }
}

/// The mean of a quarter of the points has four times the variance.
#[test]
fn a_match_of_few_points_has_the_variance_of_its_means() {
    let full_points = load("default").unwrap().registration.full_weight_points as f64;
    let match_of = |points: f64| {
        let patches = PatchesOfWall::of_points(points);
        let scene = patches.scene();
        patches.sum(&scene).statistics
    };
    let (full, few) = (match_of(full_points), match_of(0.25 * full_points));
    let variance = PatchesOfWall::of_points(full_points).observed.surfels[0].patch.covariance[(0, 0)];
    // With a Cauchy kernel the inverse weight is the variance plus a multiple of the squared distance; each of the two surfels
    // has one match.
    let added = (few.weights.recip() - full.weights.recip()) * 2.0;
    assert!((added / (2.0 * 3.0 * variance) - 1.0).abs() < 1e-6, "{added} and {variance}");
    assert_eq!(match_of(2.0 * full_points).weights, full.weights);
}
