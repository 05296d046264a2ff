//! Sources of the sensor models of an estimate: calibration file, manifest of the recording, defaults.

use crate::command::run;
use serde_json::Value;
use std::path::Path;
use zsim::recording::{RunDescription, Writer};
use zsim::simulation::{Scenario, Simulation};

const MANIFEST: &str = "from the recording's manifest";

/// A simulation of 6 s, recorded with `manifest`.
fn record(folder: &Path, manifest: &str) {
    let scenario = Scenario { duration_s: 6.0, ..Scenario::in_scene("mocap_room") };
    let simulation = Simulation::prepare(&scenario).unwrap();
    let description = RunDescription {
        calibration: simulation.calibration(),
        imu_rate_hz: 100.0,
        base_imu: None,
        manifest: manifest.to_owned(),
        truth_tf: false,
    };
    let mut writer = Writer::create(&folder.join("run.mcap"), description).unwrap();
    simulation.run(&mut writer, &mut |_| ()).unwrap();
    writer.finish().unwrap();
}

/// Metrics of an estimate, and the notes on the terminal.
fn estimated(folder: &Path, arguments: &str) -> (Value, String) {
    let (code, out, stderr) = run(folder, &format!("estimate run.mcap --open-loop --json --out result {arguments}"));
    assert!(code == 0 || code == 3, "{stderr}");
    (serde_json::from_str(&out).unwrap(), stderr)
}

/// Value and source of a noise parameter.
fn noise<'a>(metrics: &'a Value, key: &str) -> (f64, &'a str) {
    let all = metrics["sensors"]["noise"].as_array().unwrap();
    let found = all.iter().find(|parameter| parameter["key"] == key).unwrap();
    (found["value"].as_f64().unwrap(), found["source"].as_str().unwrap())
}

#[test]
fn each_value_is_from_the_calibration_else_the_manifest_else_assumed() {
    let here = tempfile::tempdir().unwrap();
    let (code, _, stderr) = run(here.path(), "simulate --scene mocap_room --duration 6s --out run.mcap");
    assert_eq!(code, 0, "{stderr}");
    let (simulated, stderr) = estimated(here.path(), "");
    assert_eq!(noise(&simulated, "imu.gyro_limit_rad_per_s"), (600_f64.to_radians(), MANIFEST));
    assert_eq!(noise(&simulated, "lidar.near_sigma_m"), (0.01, MANIFEST));
    assert_eq!(simulated["sensors"]["imu_averaging"], "coning_corrected");
    assert_eq!(simulated["sensors"]["imu_averaging_source"], MANIFEST);
    assert!(!stderr.contains("assumed"), "{stderr}");

    std::fs::write(
        here.path().join("own.ron"),
        "(imu: (gyro_density_rad_per_s_per_sqrt_hz: 6e-4), imu_averaging: none)",
    )
    .unwrap();
    let (own, stderr) = estimated(here.path(), "--calibration own.ron --ignore-manifest");
    assert_eq!(noise(&own, "imu.gyro_density_rad_per_s_per_sqrt_hz"), (6e-4, "from --calibration"));
    assert_eq!(noise(&own, "imu.gyro_limit_rad_per_s"), (2000_f64.to_radians(), "assumed"));
    assert_eq!(noise(&own, "lidar.near_sigma_m").1, "assumed");
    assert_eq!(own["sensors"]["imu_averaging"], "none");
    assert_eq!(own["sensors"]["imu_averaging_source"], "from --calibration");
    assert!(stderr.contains("assumed: IMU noise of a typical IMU"), "{stderr}");
    assert!(own["open_loop"]["position_rmse_m"].as_f64().is_some(), "the truth is still used");
}

#[test]
fn a_manifest_that_cannot_be_parsed_is_a_note_of_the_estimate_and_an_error_of_the_bound() {
    let here = tempfile::tempdir().unwrap();
    record(here.path(), "(sceen: 1)");
    let (metrics, stderr) = estimated(here.path(), "");
    assert!(stderr.contains("the manifest in the recording cannot be read") && stderr.contains("sceen"), "{stderr}");
    assert_eq!(noise(&metrics, "imu.gyro_limit_rad_per_s").1, "assumed");
    let (code, _, stderr) = run(here.path(), "bound run.mcap --scene mocap_room");
    assert!(code != 0 && stderr.contains("sceen"), "{code}: {stderr}");
}
