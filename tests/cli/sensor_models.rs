//! Sources of the sensor models of an estimate: calibration file, manifest of the recording, defaults.

use crate::command::run;
use serde_json::Value;
use std::path::Path;
use zsim::recording::{RunDescription, Writer};
use zsim::run::Manifest;
use zsim::simulation::{Scenario, Simulation};
use zsim::spec::{Source, parse, to_text};

const MANIFEST: &str = "from the recording's manifest";

/// A simulation of 6 s, recorded with its manifest as changed by `changed`.
fn record(folder: &Path, changed: impl FnOnce(String) -> String) {
    let scenario = Scenario { duration_s: 6.0, ..Scenario::in_scene("mocap_room") };
    let simulation = Simulation::prepare(&scenario).unwrap();
    let manifest = changed(Manifest::of(&simulation).to_ron().unwrap());
    let description = RunDescription {
        calibration: simulation.calibration(),
        imu_rate_hz: 100.0,
        base_imu: None,
        manifest,
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
    assert!(stderr.contains("note: noise: from the recording's manifest\n"), "{stderr}");

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
    let sources = "noise: IMU 1 from --calibration, 11 assumed; lidar assumed; assumed are IMU noise of a typical IMU";
    assert!(stderr.contains(sources), "{stderr}");
    assert!(own["open_loop"]["position_rmse_m"].as_f64().is_some(), "the truth is still used");
}

#[test]
fn a_manifest_that_cannot_be_parsed_is_a_note_of_the_estimate_and_an_error_of_the_bound() {
    let here = tempfile::tempdir().unwrap();
    record(here.path(), |_| "(sceen: 1)".to_owned());
    let (metrics, stderr) = estimated(here.path(), "");
    assert!(stderr.contains("the manifest in the recording cannot be read") && stderr.contains("sceen"), "{stderr}");
    assert_eq!(noise(&metrics, "imu.gyro_limit_rad_per_s").1, "assumed");
    let (code, _, stderr) = run(here.path(), "bound run.mcap --scene mocap_room");
    assert!(code != 0 && stderr.contains("sceen"), "{code}: {stderr}");
}

/// An estimate of a recording whose manifest has `key` changed to `by` after the start of `section`.
fn estimated_with(section: &str, key: &str, by: &str) -> (Value, String) {
    let here = tempfile::tempdir().unwrap();
    record(here.path(), |manifest| {
        let start = manifest.find(section).unwrap();
        let (before, after) = manifest.split_at(start);
        assert!(after.contains(key), "{section} {key}");
        before.replace(env!("CARGO_PKG_VERSION"), "0.0.9") + &after.replacen(key, by, 1)
    });
    estimated(here.path(), "")
}

#[test]
fn of_a_manifest_with_a_renamed_key_the_other_sensor_is_read() {
    let (metrics, stderr) = estimated_with("lidar: (", "near_sigma_m:", "sigma_near_m:");
    for part in ["written by zsim 0.0.9", "sigma_near_m", "its model of the IMU is used, that of the lidar is unknown"]
    {
        assert!(stderr.contains(part), "{part}: {stderr}");
    }
    assert!(
        stderr.contains("noise: IMU from the recording's manifest; lidar assumed; assumed are range noise"),
        "{stderr}"
    );
    // The 3DM-GX2 measures up to 600 degrees/s, the IMU that is assumed otherwise up to 2000.
    assert_eq!(noise(&metrics, "imu.gyro_limit_rad_per_s"), (600_f64.to_radians(), MANIFEST));
    assert_eq!(noise(&metrics, "lidar.near_sigma_m").1, "assumed");
    assert!(metrics["cloud"]["sigma_m"].is_null() && !metrics["open_loop"]["position_rmse_m"].is_null());
}

#[test]
fn of_a_manifest_without_a_key_of_the_imu_the_lidar_is_read() {
    let (metrics, stderr) = estimated_with("imu: (", "rate_hz: 100.0,", "");
    assert!(stderr.contains("its model of the lidar is used, that of the IMU is unknown"), "{stderr}");
    assert!(stderr.contains("`ImuSpec` needs `rate_hz`"), "{stderr}");
    assert_eq!(noise(&metrics, "imu.gyro_limit_rad_per_s"), (2000_f64.to_radians(), "assumed"));
    assert_eq!(noise(&metrics, "lidar.near_sigma_m"), (0.01, MANIFEST));
}

#[test]
fn of_a_manifest_in_the_form_before_0_1_0_both_sensors_are_read() {
    let here = tempfile::tempdir().unwrap();
    record(here.path(), |manifest| {
        let Manifest { run, .. } = parse(&Source::in_memory("manifest", manifest)).unwrap();
        let (lidar, imu) = run.map(|run| (run.lidar.spec, run.imu.spec)).unwrap();
        let (lidar, imu) = (to_text(&lidar).unwrap(), to_text(&imu).unwrap());
        format!("(version: \"0.0.9\", scenario: (seed: 1), specs: (scene: (), lidar: {lidar}, imu: {imu}))")
    });
    let (metrics, stderr) = estimated(here.path(), "");
    assert!(stderr.contains("written by zsim 0.0.9") && stderr.contains("scenario"), "{stderr}");
    assert_eq!(noise(&metrics, "imu.gyro_limit_rad_per_s"), (600_f64.to_radians(), MANIFEST));
    assert_eq!(noise(&metrics, "lidar.near_sigma_m"), (0.01, MANIFEST));
}

#[test]
fn of_a_manifest_with_a_renamed_key_of_the_scene_both_sensors_are_read() {
    let (metrics, stderr) = estimated_with("scene: (", "materials:", "surfaces:");
    assert!(stderr.contains("its models of IMU and lidar are used, and the cloud is not evaluated"), "{stderr}");
    assert!(stderr.contains("note: noise: from the recording's manifest\n"), "{stderr}");
    assert_eq!(noise(&metrics, "lidar.near_sigma_m"), (0.01, MANIFEST));
    assert!(metrics["cloud"]["sigma_m"].is_null());
}

/// The shipped consumer IMU ended as "implausible IMU scale" or lost, because the limit was a constant, and because errors of the
/// gyroscope too fast for the correction spline counted as a contradiction.
#[test]
fn an_imu_is_judged_by_the_scale_error_of_its_model() {
    let here = tempfile::tempdir().unwrap();
    let simulate = "simulate --scene courtyard --imu consumer --seed 2 --duration 30s --out run.mcap";
    assert_eq!(run(here.path(), simulate).0, 0);
    let estimate = |arguments: &str| {
        let command = format!("estimate run.mcap --open-loop --metrics-only --force --json --out result {arguments}");
        let (code, out, stderr) = run(here.path(), &command);
        let metrics: Value = serde_json::from_str(&out).unwrap_or_else(|_| panic!("{stderr}"));
        let of = |key: &str, value: &str| metrics[key][value].as_f64().unwrap();
        let causes = metrics["integrity"]["causes"].to_string();
        (code, of("open_loop", "position_rmse_m"), of("integrity", "within_bound"), causes)
    };
    // 2.9 mm in 30 s; 17 mm before.
    let (code, rmse_m, within, causes) = estimate("");
    assert_eq!((code, causes.as_str()), (0, "[]"));
    assert!(rmse_m < 0.009 && within > 0.99, "{rmse_m} m, {within} within the bound");

    let precise = "(imu: (gyro_scale_error: 5e-4, gyro_misalignment_rad: 5e-4, accel_scale_error: 5e-4, accel_misalignment_rad: 5e-4))";
    std::fs::write(here.path().join("precise.ron"), precise).unwrap();
    let (code, .., causes) = estimate("--calibration precise.ron");
    assert!(code == 3 && causes.contains("imu_scale"), "{code}: {causes}");
    for scale in ["-0.01", "NaN", "inf", "50"] {
        std::fs::write(here.path().join("wrong.ron"), format!("(imu: (gyro_scale_error: {scale}))")).unwrap();
        let (code, _, stderr) = run(here.path(), "estimate run.mcap --calibration wrong.ron --out wrong");
        assert!(code != 0 && code != 3 && stderr.contains("scale error of the gyroscope"), "{scale}: {code} {stderr}");
    }
}

/// A simulated sensor may have no noise; the estimator weights its residuals by the noise. This was an error after the whole
/// simulation, also for a shipped IMU.
#[test]
fn sensors_without_noise_are_estimated() {
    let here = tempfile::tempdir().unwrap();
    let exact =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/lidars/utm30lx_exact.ron")).unwrap();
    let exact = exact.replace("near_sigma_m: 0.010", "near_sigma_m: 0").replace("far_sigma_m: 0.030", "far_sigma_m: 0");
    std::fs::write(here.path().join("noiseless.ron"), exact).unwrap();
    let command = "--scene mocap_room --imu ideal_1khz --lidar noiseless.ron --clock exact --duration 10s --metrics-only --out run";
    let (code, _, stderr) = run(here.path(), command);
    assert_eq!(code, 0, "{stderr}");
    let metrics: Value = serde_json::from_slice(&std::fs::read(here.path().join("run/metrics.json")).unwrap()).unwrap();
    assert!(metrics["open_loop"]["position_rmse_m"].as_f64().unwrap() < 2e-3, "{metrics}");
    let (value, source) = noise(&metrics, "imu.gyro_density_rad_per_s_per_sqrt_hz");
    assert_eq!((value, source), (1e-6, "the least that is used; it is 0 in the recording's manifest"));
}
