//! `zsim compare`: several trajectories side by side, limits, and errors.

use crate::command::run;
use crate::skip::run_or_skip;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Writes a walk on a figure of eight at 100 Hz from `from_s` to `to_s`, with errors of the size `error`.
fn write_walk(path: &Path, (from_s, to_s): (i32, i32), error: f64) {
    let mut text = String::new();
    for k in 100 * from_s..100 * to_s {
        let t = f64::from(k) * 0.01;
        let side = error * (3.0 * t).sin();
        let (x, y, z) = (4.0 * (0.3 * t).sin() + side, 3.0 * (0.6 * t).sin() - side, 1.0 + 0.2 * t.cos() + error);
        let half_yaw = 0.15 * t + error;
        let (qz, qw) = half_yaw.sin_cos();
        text += &format!("{t:.9} {x:.9} {y:.9} {z:.9} 0 0 {qz:.9} {qw:.9}\n");
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn trajectories_are_compared_side_by_side_as_evo_does() {
    let here = tempfile::tempdir().unwrap();
    for (name, error) in [("truth.tum", 0.0), ("a.tum", 0.002), ("b.tum", 0.02)] {
        write_walk(&here.path().join(name), (0, 90), error);
    }
    let (code, out, stderr) = run(here.path(), "compare --truth truth.tum a.tum b.tum --json --out compared");
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((found["out"].as_str(), found["passed"].as_bool()), (Some("compared"), Some(true)));
    let rmse = |k: usize| found["trajectories"][k]["position_rmse_m"].as_f64().unwrap();
    // The lateral error has the amplitude 0.02 m on two axes: RMS 0.02 m. The constant height is aligned.
    assert!((rmse(1) - 0.02).abs() < 2e-4 && (rmse(0) - 0.002).abs() < 2e-5, "{out}");
    for file in ["comparison.json", "errors.svg", "errors.png", "trajectories.svg", "trajectories.png"] {
        assert!(here.path().join("compared").join(file).metadata().unwrap().len() > 1000, "{file}");
    }
    let mut evo = Command::new("evo_ape");
    let evo = evo.current_dir(here.path()).args(["tum", "truth.tum", "b.tum", "-a"]);
    let Some(evo) = run_or_skip("evo", evo) else { return };
    let text = String::from_utf8(evo.stdout).unwrap();
    for (word, key) in [("rmse", "position_rmse_m"), ("median", "position_median_m"), ("max", "position_max_m")] {
        let line = text.lines().find(|line| line.trim().starts_with(word)).unwrap();
        let theirs: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        let ours = found["trajectories"][1][key].as_f64().unwrap();
        assert!((ours - theirs).abs() < 2e-6, "{word}: {ours} and {theirs}");
    }
}

#[test]
fn a_limit_that_is_exceeded_or_cannot_be_checked_exits_with_1() {
    let here = tempfile::tempdir().unwrap();
    write_walk(&here.path().join("truth.tum"), (0, 90), 0.0);
    write_walk(&here.path().join("good.tum"), (0, 90), 0.001);
    write_walk(&here.path().join("bad.tum"), (0, 90), 0.02);
    write_walk(&here.path().join("short.tum"), (10, 25), 0.001);
    let all = "--fail-above position_rmse=1m --fail-above position_median=1m --fail-above position_max=1m \
               --fail-above rotation_rmse=9deg --fail-above rotation_max=9deg --fail-above drift=1m/min \
               --fail-above yaw_drift=9deg/min --fail-above end_error=1m --fail-above relative_error_per_metre=1m \
               --fail-above relative_error_per_second=1m --fail-above relative_error_per_minute=1m \
               --fail-above relative_error_per_metre=9deg --fail-above relative_error_per_second=9deg \
               --fail-above relative_error_per_minute=9deg";
    for (arguments, expected, words) in [
        ("good.tum --fail-above position_rmse=5mm --min-coverage 99%", 0, ""),
        (&format!("good.tum {all}"), 0, ""),
        ("good.tum bad.tum --fail-above position_rmse=5mm", 1, "bad.tum: position_rmse_m is 0.0"),
        ("short.tum --fail-above drift=1m/min", 1, "short.tum: drift_m_per_min is not known"),
        ("short.tum --fail-above position_rmse=5mm", 0, "note: short.tum covers 16.7 % of the truth"),
        ("short.tum --fail-above position_rmse=5mm --min-coverage 95%", 1, "short.tum: covers 16.7 %"),
        ("good.tum --fail-above position=5mm", 2, "position_rmse, "),
        ("good.tum --fail-above position_rmse=5deg", 2, "mm, cm, m"),
    ] {
        let (code, out, stderr) = run(here.path(), &format!("compare --truth truth.tum {arguments}"));
        assert_eq!(code, expected, "`{arguments}`: {stderr}");
        assert!(stderr.contains(words) && (expected == 2 || out.contains("APE")), "`{arguments}`: {out}{stderr}");
        assert_eq!(stderr.is_empty(), words.is_empty(), "`{arguments}`: {stderr}");
    }
    let limited = "compare --truth truth.tum good.tum bad.tum --fail-above position_rmse=5mm --json";
    let (code, out, _) = run(here.path(), limited);
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, found["passed"].as_bool(), found["violations"].as_array().unwrap().len()), (1, Some(false), 1));
}

#[test]
fn the_truth_of_a_recording_is_that_of_its_tum_file() {
    let here = tempfile::tempdir().unwrap();
    run(here.path(), "simulate --scene mocap_room --duration 4s --out a.mcap");
    let (code, out, stderr) = run(here.path(), "simulate --scene mocap_room --duration 4s --rosbag2 bag --json");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (code, found["out"].as_str(), found["truth"].as_str()),
        (0, Some("bag"), Some("bag/bag_0.tum")),
        "{stderr}"
    );
    let compared = |truth: &str| -> Value {
        let (code, out, stderr) = run(here.path(), &format!("compare --truth {truth} a.tum --json"));
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str(&out).unwrap()
    };
    let [recording, tum, folder] = ["a.mcap", "a.tum", "bag"].map(compared);
    // TUM files have nine decimals.
    for found in [&recording, &tum, &folder] {
        assert!(found["trajectories"][0]["position_max_m"].as_f64().unwrap() < 2e-9, "{found}");
    }
    assert_eq!(recording["trajectories"][0]["poses"], tum["trajectories"][0]["poses"]);
}

#[test]
fn files_that_cannot_be_compared_are_named() {
    let here = tempfile::tempdir().unwrap();
    write_walk(&here.path().join("truth.tum"), (0, 10), 0.0);
    write_walk(&here.path().join("later.tum"), (100, 110), 0.0);
    std::fs::write(here.path().join("empty.tum"), "# no pose\n").unwrap();
    std::fs::write(here.path().join("text.tum"), "hello\n").unwrap();
    std::fs::write(here.path().join("rest.tum"), "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n").unwrap();
    for (truth, estimate, words) in [
        ("truth.tum", "later.tum", "later.tum cannot be compared with truth.tum"),
        ("truth.tum", "later.tum", "do not overlap in time"),
        ("truth.tum", "empty.tum", "empty.tum: the file has no pose"),
        ("truth.tum", "text.tum", "text.tum:1: "),
        ("truth.tum", "rest.tum", "lie on a line or in a point"),
        ("truth.tum", "missing.tum", "missing.tum: No such file"),
        ("empty.tum", "truth.tum", "empty.tum: the file has no pose"),
        ("text.tum", "truth.tum", "text.tum:1: "),
        ("missing.mcap", "truth.tum", "missing.mcap: No such file"),
    ] {
        let (code, out, stderr) = run(here.path(), &format!("compare --truth {truth} {estimate} --out never"));
        assert!(code == 1 && out.is_empty() && stderr.contains(words), "{truth} {estimate}: {code} {out}{stderr}");
    }
    assert!(!here.path().join("never").exists());
}
