//! Independent programs read the recordings. A test is skipped if its program is not installed.

use crate::skip::{run_or_skip, skip};
use std::path::{Path, PathBuf};
use std::process::Command;
use zsim::geometry::Pose;
use zsim::recording::{BaseImuDescription, RunDescription, write_rosbag2_metadata};

/// A recording with messages on every topic.
fn recording_in(folder: &Path) -> PathBuf {
    let path = folder.join("run.mcap");
    let run = crate::recordings::run();
    let head_from_base = Pose::translation(0.0, 0.0, -0.16);
    let imu = BaseImuDescription { noise: run.calibration.imu, rate_hz: 100.0, head_from_base };
    let run = RunDescription { base_imu: Some(imu), ..run };
    std::fs::write(&path, crate::recordings::record_all(run, 200)).unwrap();
    path
}

/// The Python interpreter named by `ZSIM_PYTHON`, else `python3`.
pub fn python() -> Command {
    Command::new(std::env::var("ZSIM_PYTHON").unwrap_or_else(|_| "python3".to_owned()))
}

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A recording in `folder` that the readers of `check_mcap.py` agree on; `None` if they are not installed.
fn read_by_others(name: &str, folder: &Path) -> Option<PathBuf> {
    let path = recording_in(folder);
    let output = run_or_skip(name, python().arg(here("tests/check_mcap.py")).arg(&path))?;
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
    assert!(stdout.starts_with("ok "), "{stdout}");
    Some(path)
}

#[test]
fn mcap_for_python_and_rosbags_agree_on_every_message() {
    let folder = tempfile::tempdir().unwrap();
    read_by_others("mcap", folder.path());
}

#[test]
fn rosbags_reads_a_folder_with_our_metadata() {
    let folder = tempfile::tempdir().unwrap();
    write_rosbag2_metadata(&recording_in(folder.path())).unwrap();
    let script = here("tests/check_rosbag2.py");
    let Some(output) = run_or_skip("rosbag2", python().arg(script).arg(folder.path())) else { return };
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && stdout.starts_with("ok "),
        "{stdout}{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn the_dataset_of_evalio_agrees_with_mcap_for_python() {
    let folder = tempfile::tempdir().unwrap();
    let mut recordings = Vec::new();
    for lidar in ["mid360", "vlp16", "utm30lx"] {
        let settings = "--scene office --clock coarse --duration 4s --seed 4 --quiet";
        let (code, _, stderr) =
            crate::command::run(folder.path(), &format!("simulate --lidar {lidar} {settings} --out {lidar}.mcap"));
        assert_eq!(code, 0, "{stderr}");
        recordings.push(folder.path().join(format!("{lidar}.mcap")));
    }
    let script = here("tests/check_evalio.py");
    let Some(output) = run_or_skip("evalio", python().arg(script).args(recordings)) else { return };
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(stdout.lines().filter(|line| line.starts_with("ok ")).count(), 3, "{stdout}");
}

#[test]
fn the_acceptance_check_passes() {
    let script = here("../shared/tools/check_mcap.py");
    if !script.exists() {
        return skip("acceptance", "its script is not installed");
    }
    let folder = tempfile::tempdir().unwrap();
    let Some(recording) = read_by_others("acceptance", folder.path()) else { return };
    let needs = [
        "/scan:sensor_msgs/msg/LaserScan",
        "/imu/data_raw:sensor_msgs/msg/Imu",
        "/points:sensor_msgs/msg/PointCloud2",
        "/tf_static:tf2_msgs/msg/TFMessage",
        "/ground_truth/odom:nav_msgs/msg/Odometry",
    ];
    let output = python().arg(script).arg(recording).arg("--need").args(needs).output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
}
