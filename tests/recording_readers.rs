//! Independent programs read the recordings. Each test prints `skipped` if a program is not installed.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod recordings;

use std::path::{Path, PathBuf};
use std::process::Command;
use zsim::geometry::Pose;
use zsim::recording::{BaseImuDescription, RunDescription};

/// A recording with messages on every topic.
fn recording_in(folder: &Path) -> PathBuf {
    let path = folder.join("run.mcap");
    let run = recordings::run();
    let head_from_base = Pose::translation(0.0, 0.0, -0.16);
    let imu = BaseImuDescription { noise: run.calibration.imu, rate_hz: 100.0, head_from_base };
    let run = RunDescription { base_imu: Some(imu), ..run };
    std::fs::write(&path, recordings::record_all(run, 200)).unwrap();
    path
}

/// The Python interpreter named by `ZSIM_PYTHON`, else `python3`; `None` if it is not installed.
fn python() -> Option<String> {
    let name = std::env::var("ZSIM_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    Command::new(&name).arg("--version").output().ok().filter(|output| output.status.success()).map(|_| name)
}

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[test]
fn mcap_for_python_and_rosbags_agree_on_every_message() {
    let Some(python) = python() else { return println!("skipped: python is not installed") };
    let folder = tempfile::tempdir().unwrap();
    let output =
        Command::new(python).arg(here("tests/check_mcap.py")).arg(recording_in(folder.path())).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.starts_with("ok ") || said.starts_with("skipped: "), "{said}");
    print!("{said}");
}

#[test]
fn the_acceptance_check_passes() {
    let script = here("../shared/tools/check_mcap.py");
    let Some(python) = python() else { return println!("skipped: python is not installed") };
    let has_modules = Command::new(&python).args(["-c", "import mcap, mcap_ros2, rosbags, numpy"]).output().unwrap();
    if !script.exists() || !has_modules.status.success() {
        return println!("skipped: the acceptance check or its Python modules are not installed");
    }
    let folder = tempfile::tempdir().unwrap();
    let needs = [
        "/scan:sensor_msgs/msg/LaserScan",
        "/imu/data_raw:sensor_msgs/msg/Imu",
        "/points:sensor_msgs/msg/PointCloud2",
        "/tf_static:tf2_msgs/msg/TFMessage",
        "/ground_truth/odom:nav_msgs/msg/Odometry",
    ];
    let output =
        Command::new(python).arg(script).arg(recording_in(folder.path())).arg("--need").args(needs).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
}
