//! A head as a robot model of other simulators, compared with MuJoCo.

use crate::command::run;
use crate::skip::run_or_skip;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Largest relative difference between the natural frequencies of the head in zsim and of its model in MuJoCo.
fn difference_in_mujoco(head: &str) -> Option<f64> {
    let here = tempfile::tempdir().unwrap();
    let (code, _, errors) = run(here.path(), &format!("spring export {head} --out robot"));
    assert_eq!(code, 0, "{head}: {errors}");
    let (code, report, errors) = run(here.path(), &format!("spring {head} --json"));
    assert_eq!(code, 0, "{head}: {errors}");
    let report: Value = serde_json::from_str(&report).unwrap();
    let modes = report["modes"].as_array().unwrap();
    let mut frequencies: Vec<f64> = modes.iter().map(|mode| mode["frequency_hz"].as_f64().unwrap()).collect();
    frequencies.sort_by(f64::total_cmp);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check_mujoco.py");
    let mut python = Command::new("python3");
    python.arg(script).arg(here.path().join("robot")).args(frequencies.iter().map(f64::to_string));
    let output = run_or_skip("mujoco", &mut python)?;
    let (words, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{head}: {words}{errors}");
    Some(words.trim().strip_prefix("ok ").unwrap().parse().unwrap())
}

#[test]
fn heads_have_the_same_modes_in_mujoco() {
    // Without couplings to the last digit. Wire that moves with the head, and screws, are approximated.
    for (head, allowed) in [
        ("elastic_cables", 3e-5),
        ("rope_pendulum", 3e-5),
        ("handheld", 6e-3),
        ("backpack", 6e-3),
        ("hanging", 6e-3),
        ("vehicle_three_springs", 6e-3),
    ] {
        let Some(difference) = difference_in_mujoco(head) else { return };
        println!("{head}: {difference}");
        assert!(difference < allowed, "{head}: {difference}");
    }
}

#[test]
fn sdf_has_the_springs_and_urdf_the_frames_of_recordings() {
    let here = tempfile::tempdir().unwrap();
    run(here.path(), "spring export handheld --out robot");
    let read = |name: &str| std::fs::read_to_string(here.path().join("robot").join(name)).unwrap();
    let (urdf, sdf) = (read("head.urdf"), read("head.sdf"));
    for frame in ["base", "head", "laser", "imu_link"] {
        assert!(urdf.contains(&format!("<link name=\"{frame}\"")), "{frame}");
    }
    assert_eq!(sdf.matches("<spring_stiffness>").count(), 6);
    for text in [&urdf, &sdf] {
        let (open, closed) = (text.matches("<joint ").count(), text.matches("</joint>").count());
        assert_eq!(open, closed, "{text}");
    }
}

#[test]
fn a_head_without_elastic_joints_is_refused_with_the_reason() {
    let here = tempfile::tempdir().unwrap();
    for (head, reason) in
        [("rigid", "there is no spring"), ("universal_joint", "two rotations"), ("nodding", "a motor")]
    {
        let (code, _, errors) = run(here.path(), &format!("spring export {head} --out robot"));
        assert_eq!(code, 1, "{head}");
        assert!(errors.contains(reason), "{head}: {errors}");
        assert!(!here.path().join("robot").exists(), "{head}");
    }
}
