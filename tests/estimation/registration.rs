//! Loop closure by global registration, on closed-form walks and on scenes.

use crate::estimation::fixture::{Room, Run, Score, Walk, calibration};
use zsim::estimation::{ClosedLoop, Estimator, OpenLoop, RegistrationInput, load, register};
use zsim::evaluation::{Errors, Pairs};
use zsim::geometry::{Pose, Rotation, Trajectory, Vector};
use zsim::measurement::Calibration;
use zsim::recording::{Reader, RunDescription, TopicPreference, Writer};
use zsim::simulation::{Scenario, Simulation};
use zsim::spec::{Kind, names};

/// One recording with few loops, and two with several laps or a closed corridor.
fn runs() -> [Run; 3] {
    let walk = |semi_axes_m, lap_s| Walk { start_s: 1.5, ..Walk::new(semi_axes_m, lap_s) };
    [
        Run::new(Room::furnished(), walk((1.8, 1.2), 12.0), 21, 8.0),
        Run::new(Room::furnished(), walk((1.8, 1.2), 12.0), 22, 28.0),
        Run::new(Room::corridor_loop(), walk((7.25, 3.75), 30.0), 23, 34.0),
    ]
}

fn open_loop_of(run: &Run) -> OpenLoop {
    let mut estimator = Estimator::new(&load("default").unwrap(), &calibration()).unwrap().recording_surfels();
    run.measurements().into_iter().for_each(|measurement| estimator.push(measurement).unwrap());
    estimator.finish().unwrap()
}

fn registered(open: &OpenLoop, calibration: &Calibration) -> ClosedLoop {
    let covariances: Vec<_> = open.poses.iter().map(|pose| (pose.stamp, pose.covariance)).collect();
    let OpenLoop { trajectory, lidar, observed, .. } = open;
    let travelled = RegistrationInput { map_from_head: trajectory, covariances: &covariances, lidar, observed };
    register(travelled, calibration, &load("default").unwrap()).unwrap()
}

fn closed(open: &OpenLoop) -> OpenLoop {
    let closed = registered(open, &calibration());
    assert_eq!(closed.report.rejected_because, None, "{:?}", closed.report);
    OpenLoop { trajectory: closed.trajectory, ..open.clone() }
}

#[test]
fn loop_closure_increases_the_error_by_at_most_5_percent_and_a_fifth_of_a_millimetre() {
    for (index, run) in runs().iter().enumerate() {
        let open = open_loop_of(run);
        let (before, after) = (Score::of(&open, run).rmse_m, Score::of(&closed(&open), run).rmse_m);
        // In the loop of corridors the open loop errs by 0.77 mm, and loop closure adds 0.1 mm.
        assert!(after < 1.05 * before + 2e-4, "run {index}: {before} m before, {after} m after");
    }
}

#[test]
fn the_open_loop_does_not_depend_on_the_storage_of_surfels() {
    let run = Run::new(Room::furnished(), Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 12.0) }, 24, 7.0);
    let mut plain = Estimator::new(&load("default").unwrap(), &calibration()).unwrap();
    run.measurements().into_iter().for_each(|measurement| plain.push(measurement).unwrap());
    let (plain, with_surfels) = (plain.finish().unwrap(), open_loop_of(&run));
    assert!(plain.poses == with_surfels.poses);
    assert!(plain.observed.is_empty() && with_surfels.observed.len() > 1000, "{}", with_surfels.observed.len());
}

/// The open loop of a short run through a shipped scene, the true trajectory, and the head's calibration.
fn through(scene: &str, duration_s: f64) -> (OpenLoop, Trajectory, Calibration) {
    let scenario = Scenario { duration_s, ..Scenario::in_scene(scene) };
    let simulation = Simulation::prepare(&scenario).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.mcap");
    let calibration = simulation.calibration();
    let manifest = zsim::spec::to_text(&scenario).unwrap();
    let run = RunDescription { calibration, imu_rate_hz: 100.0, base_imu: None, manifest, truth_tf: false };
    let mut writer = Writer::create(&path, run).unwrap();
    simulation.run(&mut writer, &mut |_| ()).unwrap();
    writer.finish().unwrap();
    let reader = Reader::open(&path).unwrap();
    let selection = reader.select(&TopicPreference::default()).unwrap();
    let mut estimator =
        Estimator::new(&load("default").unwrap(), &simulation.calibration()).unwrap().recording_surfels();
    reader.measurements(&selection).for_each(|measurement| estimator.push(measurement.unwrap()).unwrap());
    (estimator.finish().unwrap(), reader.truth_trajectory().unwrap(), simulation.calibration())
}

fn rmse_m(trajectory: &Trajectory, truth: &Trajectory) -> f64 {
    let pairs = Pairs::associate(trajectory, truth).unwrap();
    Errors::after(&pairs, &pairs.world_from_map().unwrap()).position_rmse_m()
}

#[test]
fn loop_closure_increases_the_error_in_no_scene_by_more_than_5_percent_and_half_a_millimetre() {
    let scenes = names(Kind::Scene);
    assert!(scenes.len() >= 7, "{scenes:?}");
    for scene in &scenes {
        let (open, truth, calibration) = through(scene, 20.0);
        let closed = registered(&open, &calibration);
        let (before, after) = (rmse_m(&open.trajectory, &truth), rmse_m(&closed.trajectory, &truth));
        // In the corridors, where little holds the position along them, it adds 0.1 to 0.4 mm to 1 to 2 mm in four of five seeds.
        assert!(after < 1.05 * before + 5e-4, "{scene}: {before} m before, {after} m after: {:?}", closed.report);
    }
}

/// `trajectory` with a smooth drift of 5 m and 10 degrees.
fn with_drift(trajectory: &Trajectory) -> Trajectory {
    let (first, last) = trajectory.span().unwrap();
    let drifted = |(stamp, pose): (_, &Pose)| {
        let x = last.seconds_since(stamp) / last.seconds_since(first);
        let grown = 1.0 - x * x * (3.0 - 2.0 * x);
        let turn = Rotation::from_scaled_axis(Vector::z() * (10.0_f64.to_radians() * grown));
        let shift = Vector::new(4.0, 2.8, 1.0).normalize() * (5.0 * grown);
        (stamp, Pose::from_parts(shift.into(), turn) * pose)
    };
    Trajectory::from_poses(trajectory.iter().map(drifted)).unwrap()
}

#[test]
fn a_drift_of_5_m_and_10_degrees_is_corrected() {
    let walk = Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 12.0) };
    let run = Run::new(Room::furnished(), walk, 25, 60.0);
    let open = open_loop_of(&run);
    let trajectory = with_drift(&open.trajectory);
    let observed = open.observed.along(&open.trajectory, &trajectory);
    let with_drift = OpenLoop { trajectory, observed, ..open.clone() };
    let recovered = registered(&with_drift, &calibration());
    let score =
        |trajectory: &Trajectory| Score::of(&OpenLoop { trajectory: trajectory.clone(), ..open.clone() }, &run).rmse_m;
    let (before, after) = (score(&with_drift.trajectory), score(&recovered.trajectory));
    assert!(before > 1.0, "{before} m");
    assert!(recovered.report.loops.closed >= 2, "{:?}", recovered.report);
    // Worst of ten seeds: 5.3 mm.
    assert!(after < 0.016, "{before} m before, {after} m after: {:?}", recovered.report);
}
