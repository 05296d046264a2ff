//! `zsim play` and `zsim live`, between two processes and with another implementation of DDS.

use crate::command::run;
use crate::skip::{run_or_skip, skip};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

/// Arguments that choose the topics of a recording that an estimate needs.
pub(super) const TOPICS: &str = "--topic /scan --topic /imu/data_raw --topic /tf_static";

/// The folder with the program that connects to DDS; `None`, reported as a skipped check, if it is not built.
pub(super) fn bridge() -> Option<PathBuf> {
    let bridge = Path::new(env!("CARGO_BIN_EXE_zsim")).with_file_name("zsim-ros2");
    if !bridge.is_file() {
        skip("ros2", "zsim-ros2 is not built");
        return None;
    }
    Some(bridge)
}

/// A simulated recording of `seconds`.
pub(super) fn recording(folder: &Path, seconds: u32) -> PathBuf {
    let arguments = format!("-q simulate --scene mocap_room --duration {seconds}s --seed 4 --out r.mcap");
    assert_eq!(run(folder, &arguments).0, 0);
    folder.join("r.mcap")
}

fn start(folder: &Path, arguments: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_zsim"));
    let command = command.current_dir(folder).args(arguments.split_whitespace());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

pub(super) fn stop(mut process: Child) {
    process.kill().unwrap();
    process.wait().unwrap();
}

pub(super) fn json(output: &Output) -> serde_json::Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(text.lines().last().filter(|line| line.starts_with('{')).unwrap_or(&text))
        .unwrap_or_else(|error| panic!("{error}: {text} {}", String::from_utf8_lossy(&output.stderr)))
}

/// A player and an estimate of two processes; then the player starts again, and the estimate goes on with a new map.
#[test]
fn a_live_estimate_is_that_of_the_recording_and_survives_a_restart_of_the_player() {
    if bridge().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    recording(here, 16);
    let live = start(here, "live --domain 61 --idle 6s --duration 100s --out live --json --quiet");
    let play = format!("play r.mcap --domain 61 --wait --quiet --json {TOPICS}");
    let played = start(here, &play).wait_with_output().unwrap();
    assert!(played.status.success());
    assert_eq!(json(&played)["messages"]["/scan"], 640);
    let again = start(here, &play);
    std::thread::sleep(Duration::from_secs(9));
    stop(again);
    let live = live.wait_with_output().unwrap();
    let result = json(&live);
    assert_eq!(result["restarts"], 1, "{result}");

    // Everything arrived, and in the order of the recording: the trajectory is that of a file, to the byte.
    let recorded = here.join("live/recording.mcap");
    let count = |topic: &str| {
        let info = run(here, &format!("info {} --json", recorded.display())).1;
        let info: serde_json::Value = serde_json::from_str(&info).unwrap();
        let topics = info["topics"].as_array().unwrap();
        topics.iter().find(|each| each["topic"] == topic).unwrap()["messages"].as_u64().unwrap()
    };
    assert!(count("/scan") > 640 && count("/imu/data_raw") > 1600, "both runs of the player are recorded");
    let (code, ..) = run(here, "-q estimate r.mcap --open-loop --ignore-manifest --lidar-topic /scan --out file");
    assert_eq!(code, 0);
    let read = |name: &str| std::fs::read_to_string(here.join(name)).unwrap();
    let (live, file) = (read("live/open_loop.tum"), read("file/open_loop.tum"));
    // At the second start the last window of the first run was not complete.
    assert!(live.lines().count() > 1000 && file.starts_with(&live), "the live trajectory is that of the file");
}

#[test]
fn a_live_estimate_in_a_given_map_is_that_of_the_recording() {
    if bridge().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    recording(here, 14);
    assert_eq!(run(here, "-q estimate r.mcap --out first").0, 0);
    let map = "--map first/map.ply --start 0.2,-0.1,0,3";
    let arguments = format!("live --domain 65 --idle 3s --duration 60s --out live --quiet {map}");
    let live = start(here, &arguments);
    let played = start(here, &format!("play r.mcap --domain 65 --wait --quiet {TOPICS}")).wait_with_output().unwrap();
    assert!(played.status.success());
    assert!(live.wait_with_output().unwrap().status.code().is_some());
    run(here, &format!("-q estimate live/recording.mcap --open-loop --out file {map}"));
    let read = |name: &str| std::fs::read_to_string(here.join(name)).unwrap();
    let live = read("live/open_loop.tum");
    assert!(live.lines().count() > 1000);
    assert_eq!(live, read("file/open_loop.tum"));
}

#[test]
fn another_dds_receives_what_is_played() {
    let Some(bridge) = bridge() else { return };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let recording = recording(here, 6);
    // The player waits for the subscriber.
    let player = start(here, &format!("play r.mcap --domain 62 --wait --quiet {TOPICS}"));
    let mut check = Command::new("python3");
    check.arg(script()).args(["play", "62"]).arg(&recording);
    let Some(output) = run_or_skip("cyclonedds", &mut check) else { return stop(player) };
    let player = player.wait_with_output().unwrap();
    assert!(player.status.success(), "{}", String::from_utf8_lossy(&player.stderr));
    assert!(output.status.success(), "{}: {}", bridge.display(), String::from_utf8_lossy(&output.stderr));
    assert_eq!(json(&output)["/imu/data_raw"], 600);
}

#[test]
fn a_live_estimate_of_another_dds_is_published_to_it() {
    if bridge().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let recording = recording(here, 10);
    let live = start(here, "live --domain 63 --idle 4s --duration 60s --out live --json --quiet");
    let mut check = Command::new("python3");
    check.arg(script()).args(["live", "63"]).arg(&recording);
    let Some(output) = run_or_skip("cyclonedds", &mut check) else { return stop(live) };
    let live = live.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (published, result) = (json(&output), json(&live));
    assert_eq!(live.status.code(), Some(0), "{result}");
    assert_eq!((&result["scans"], &result["imu_samples"]), (&400.into(), &1000.into()), "nothing is lost");
    assert_eq!(published["frames"], serde_json::json!(["map", "head", "head"]));
    assert_eq!(published["fields"], serde_json::json!(["x", "y", "z", "intensity"]));
    assert_eq!(published["level"], 0);
    // The subscriber discovers one of the two topics first.
    let count = |topic: &str| published["counts"][topic].as_i64().unwrap();
    assert!(count("/odom") > 800 && (count("/odom") - count("/tf")).abs() < 100, "{published}");
    assert!(published["counts"]["/cloud"].as_u64() > Some(8) && published["points"].as_u64() > Some(10_000));
    // The newest pose has the time of a pose of the file, and differs little from the final one.
    let stamp = published["stamp"].as_str().unwrap();
    let file = std::fs::read_to_string(here.join("live/open_loop.tum")).unwrap();
    let same = file.lines().find(|line| line.starts_with(stamp)).unwrap();
    let numbers: Vec<f64> = same.split(' ').map(|word| word.parse().unwrap()).collect();
    for (axis, position) in published["position"].as_array().unwrap().iter().enumerate() {
        let difference_m = position.as_f64().unwrap() - numbers[axis + 1];
        assert!(difference_m.abs() < 0.03, "axis {axis}: {difference_m} m");
    }
}

pub(super) fn script() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check_ros2.py")
}

#[test]
fn what_cannot_be_played_is_said_before_anything_is_published() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    recording(here, 1);
    let (code, _, error) = run(here, "play r.mcap --topic /camera");
    assert_eq!(code, 2);
    assert!(error.contains("no topic /camera") && error.contains("/imu/data_raw"), "{error}");
    assert_eq!(run(here, "play missing.mcap").0, 1);
    assert_eq!(run(here, "play r.mcap --rate 0").0, 2);
    assert_eq!(run(here, "play r.mcap --rate nan").0, 2);
    assert_eq!(run(here, "live --domain 233").0, 2);
    std::fs::write(here.join("empty.mcap"), b"").unwrap();
    assert_ne!(run(here, "play empty.mcap").0, 0);
}

#[test]
fn without_the_program_for_dds_the_commands_say_how_to_get_it() {
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("zsim");
    std::fs::copy(env!("CARGO_BIN_EXE_zsim"), &alone).unwrap();
    let output = Command::new(&alone).arg("live").env("PATH", folder.path()).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(error.contains("cargo build --release --package zsim-ros2"), "{error}");
}

#[test]
fn without_sensors_a_live_estimate_says_what_is_missing_and_writes_nothing() {
    if bridge().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (code, _, error) = run(folder.path(), "live --domain 64 --duration 2s --quiet --out live");
    assert_eq!(code, 1);
    assert!(error.contains("a lidar and an IMU") && error.contains("no topics at all"), "{error}");
    assert!(!error.contains("peer"), "{error}");
    let (code, _, error) = run(folder.path(), "live --domain 64 --duration 1s --quiet --peer 127.0.0.2");
    assert!(code == 1 && error.contains("the DDS of a peer must not offer multicast"), "{error}");
    let (code, _, error) = run(folder.path(), "live --domain 64 --duration 1s --quiet --peer no.such.host.invalid");
    assert!(code == 1 && error.contains("peer `no.such.host.invalid`"), "{error}");
    assert!(!folder.path().join("live").exists());
}
