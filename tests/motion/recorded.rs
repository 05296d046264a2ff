//! Motions that replay a recording.

use std::path::Path;
use zsim::geometry::Trajectory;
use zsim::motion::{BaseMotion, MotionSpec};
use zsim::random::Seed;
use zsim::recording::{Reader, RunDescription, Writer};
use zsim::simulation::{Scenario, Simulation};
use zsim::spec::{Source, parse};

/// Simulates a walk through the office and records it into `folder`; returns the simulation.
fn recorded(folder: &Path) -> Simulation {
    let scenario = Scenario { lidar: "lms291".to_owned(), duration_s: 6.0, ..Scenario::in_scene("office") };
    let simulation = Simulation::prepare(&scenario).unwrap();
    let run = RunDescription {
        calibration: simulation.calibration(),
        imu_rate_hz: 100.0,
        base_imu: None,
        manifest: String::new(),
        truth_tf: false,
    };
    let mut writer = Writer::create(&folder.join("walk.mcap"), run).unwrap();
    simulation.run(&mut writer, &mut |_| ()).unwrap();
    writer.finish().unwrap();
    simulation
}

fn replay(folder: &Path, poses: &str) -> Result<Box<dyn BaseMotion>, String> {
    let file = folder.join("again.ron");
    let text = format!("Replay((poses: {poses}, from_route: false, still_s: 0.0, ease_s: 0.5))");
    std::fs::write(&file, text).unwrap();
    let source = Source::read(&file).unwrap();
    let spec: MotionSpec = parse(&source).map_err(|error| error.to_string())?;
    spec.build(&source, None, 6.0, Seed(1)).map_err(|error| error.to_string())
}

/// Largest distance, m, and angle, rad, of a replay from its poses, at full speed.
fn worst(replay: &dyn BaseMotion, poses: &Trajectory) -> (f64, f64) {
    let (start, end) = poses.span().unwrap();
    let within = poses.iter().filter(|(stamp, _)| stamp.seconds_since(start) > 0.5 && end.seconds_since(*stamp) > 0.5);
    within.fold((0.0, 0.0), |(distance, angle), (stamp, pose)| {
        // Half a second late: it reaches full speed in one second.
        let now = replay.at(0.5 + stamp.seconds_since(start)).world_from_body;
        let off = (now.translation.vector - pose.translation.vector).norm();
        (f64::max(distance, off), f64::max(angle, now.rotation.angle_to(&pose.rotation)))
    })
}

#[test]
fn recordings_of_base_and_head_are_replayed() {
    let here = tempfile::tempdir().unwrap();
    let simulation = recorded(here.path());
    let reader = Reader::open(&here.path().join("walk.mcap")).unwrap();

    let base = replay(here.path(), "Recording(file: \"walk.mcap\", topic: \"/ground_truth/base\")").unwrap();
    let poses = reader.poses(Some("/ground_truth/base")).unwrap();
    let (distance, angle) = worst(base.as_ref(), &poses);
    assert!(distance < 1e-9 && angle < 1e-7, "{distance} m, {angle} rad");
    // The replay also matches the simulated motion; clock offset and rate shift it by a few milliseconds.
    let (stamp, _) = poses.iter().nth(4_500).unwrap();
    let played = base.at(0.5 + stamp.seconds_since(poses.stamps()[0]));
    let before = simulation.motion().at(4.5);
    assert!((played.velocity_in_world - before.velocity_in_world).norm() < 0.03, "{played:?} {before:?}");
    assert!(before.velocity_in_world.norm() > 0.5, "the base is walking at that time");

    // Without a topic the replay uses the head, with 100 poses/s.
    let head = replay(here.path(), "Recording(file: \"walk.mcap\")").unwrap();
    let odometry = reader.poses(None).unwrap();
    assert!((590..=601).contains(&odometry.len()), "{}", odometry.len());
    let (distance, angle) = worst(head.as_ref(), &odometry);
    assert!(distance < 1e-9 && angle < 1e-7, "{distance} m, {angle} rad");
    // Between these poses, 10 ms apart, the head matches the poses at 1 kHz.
    let (distance, angle) = worst(head.as_ref(), &reader.poses(Some("/ground_truth/pose")).unwrap());
    assert!(distance < 1e-4 && angle < 2e-3, "{distance} m, {angle} rad");
}

#[test]
fn a_recording_that_cannot_be_replayed_is_an_error() {
    let here = tempfile::tempdir().unwrap();
    recorded(here.path());
    let error_of = |poses: &str| replay(here.path(), poses).err().unwrap_or_else(|| panic!("{poses} was played"));
    let of_scans = error_of("Recording(file: \"walk.mcap\", topic: \"/scan\")");
    assert!(of_scans.contains("topic /scan is missing or not of type nav_msgs/msg/Odometry"), "{of_scans}");
    assert!(
        of_scans.contains("/ground_truth/base (geometry_msgs/msg/PoseStamped)"),
        "the error lists the topics: {of_scans}"
    );
    assert!(error_of("Recording(file: \"walk.mcap\", topic: \"/odom\")").contains("topic /odom is missing"));
    assert!(error_of("Recording(file: \"nowhere.mcap\")").contains("nowhere.mcap"));
    assert!(error_of("Recording(file: \"again.ron\")").contains("not an MCAP file"));
    assert!(error_of("Recording(path: \"walk.mcap\")").contains("path"));

    let whole = std::fs::read(here.path().join("walk.mcap")).unwrap();
    for kept in [whole.len() - 1, whole.len() / 2, 200] {
        std::fs::write(here.path().join("cut.mcap"), &whole[..kept]).unwrap();
        let cut = error_of("Recording(file: \"cut.mcap\")");
        assert!(cut.contains("cut.mcap") && (cut.contains("cut short") || cut.contains("is missing")), "{cut}");
        assert!(cut.contains("again.ron:1:"), "it says where: {cut}");
    }
    let mut damaged = whole.clone();
    let middle = whole.len() / 2;
    damaged[middle..middle + 64].fill(0xA5);
    std::fs::write(here.path().join("damaged.mcap"), &damaged).unwrap();
    assert!(error_of("Recording(file: \"damaged.mcap\")").contains("cut short or damaged"));
}
