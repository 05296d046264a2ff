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

/// The figure of eight of [`write_walk`] at `rate_hz` for 90 s, line by line.
fn walk_at(rate_hz: i32, line: impl Fn(f64, [f64; 3], [f64; 2]) -> String) -> String {
    let pose = |k: i32| {
        let t = f64::from(k) / f64::from(rate_hz);
        let position = [4.0 * (0.3 * t).sin(), 3.0 * (0.6 * t).sin(), 1.0 + 0.2 * t.cos()];
        line(t, position, (0.15 * t).sin_cos().into())
    };
    (0..90 * rate_hz).map(pose).collect()
}

#[test]
fn an_exact_truth_at_any_rate_gives_the_same_errors() {
    let here = tempfile::tempdir().unwrap();
    write_walk(&here.path().join("estimate.tum"), (0, 90), 0.002);
    let tum =
        |t: f64, [x, y, z]: [f64; 3], [s, c]: [f64; 2]| format!("{t:.9} {x:.9} {y:.9} {z:.9} 0 0 {s:.9} {c:.9}\n");
    for rate_hz in [1, 3, 10, 100, 400] {
        std::fs::write(here.path().join("truth.tum"), walk_at(rate_hz, tum)).unwrap();
        let (code, out, stderr) = run(here.path(), "compare --truth truth.tum estimate.tum --json");
        assert_eq!(code, 0, "{stderr}");
        let found: Value = serde_json::from_str(&out).unwrap();
        let figure = |key: &str| found["trajectories"][0][key].as_f64().unwrap();
        // 2 mm on two axes, sinusoidal: 2 mm; the yaw is wrong by 4 mrad. Chords of 1 s are up to 4 * 0.3^2 / 8 = 45 mm inside the path.
        let rmse_mm = 1e3 * figure("position_rmse_m");
        assert!((rmse_mm - 2.0).abs() < 0.1, "{rate_hz} Hz: {rmse_mm}");
        assert!(figure("coverage") > 0.97, "{rate_hz} Hz: {out}");
        assert!((figure("rotation_rmse_deg") - 0.229).abs() < 0.01, "{rate_hz} Hz: {out}");
        assert!(stderr.is_empty(), "{stderr}");
    }
    // Where both are sparse, interpolation over an interval cannot be avoided.
    let text = std::fs::read_to_string(here.path().join("estimate.tum")).unwrap();
    let sparse: Vec<&str> = text.lines().skip(50).step_by(100).collect();
    std::fs::write(here.path().join("sparse.tum"), sparse.join("\n")).unwrap();
    std::fs::write(here.path().join("truth.tum"), walk_at(1, tum)).unwrap();
    let (code, _, stderr) = run(here.path(), "compare --truth truth.tum sparse.tum");
    let note = "note: sparse.tum and the truth have different stamps, and neither has intervals below 1.00 s";
    assert!(code == 0 && stderr.contains(note), "{stderr}");
}

/// The figures of estimate.tum against `truth`, and what is printed to stderr.
fn compared(folder: &Path, truth: &str) -> (Value, String) {
    let (code, out, stderr) = run(folder, &format!("compare --truth {truth} estimate.tum --json"));
    assert_eq!(code, 0, "{truth}: {stderr}");
    let found: Value = serde_json::from_str(&out).unwrap();
    (found["trajectories"][0].clone(), stderr)
}

#[test]
fn a_truth_is_read_in_the_formats_of_benchmarks() {
    let here = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(here.path().join(name), text).unwrap();
    write_walk(&here.path().join("estimate.tum"), (0, 90), 0.002);
    let tum =
        |t: f64, [x, y, z]: [f64; 3], [s, c]: [f64; 2]| format!("{t:.9} {x:.9} {y:.9} {z:.9} 0 0 {s:.9} {c:.9}\n");
    let euroc = |t: f64, [x, y, z]: [f64; 3], [s, c]: [f64; 2]| {
        format!("{},{x:.9},{y:.9},{z:.9},{c:.9},0,0,{s:.9},0.1,0,0,0,0,0,0,0,0\n", (t * 1e9).round())
    };
    let kitti = |_: f64, [x, y, z]: [f64; 3], [s, c]: [f64; 2]| {
        // A turn about z by twice the angle of the half-angle quaternion.
        let (sin, cos) = (2.0 * s * c, c * c - s * s);
        format!("{cos:.9e} {:.9e} 0 {x:.9e} {sin:.9e} {cos:.9e} 0 {y:.9e} 0 0 1 {z:.9e}\n", -sin)
    };
    let position = |t: f64, [x, y, z]: [f64; 3], _: [f64; 2]| format!("{t:.9} {x:.9} {y:.9} {z:.9}\n");
    let leica = |t: f64, [x, y, z]: [f64; 3], _: [f64; 2]| format!("{}, {x:.9}, {y:.9}, {z:.9}\n", (t * 1e9).round());
    let identity = |t: f64, [x, y, z]: [f64; 3], _: [f64; 2]| format!("{t:.9} {x:.9} {y:.9} {z:.9} 0 0 0 1\n");
    let zeros = |t: f64, [x, y, z]: [f64; 3], _: [f64; 2]| format!("{t:.9} {x:.9} {y:.9} {z:.9} 0 0 0 0\n");
    write("truth.tum", &walk_at(20, tum));
    write("euroc.csv", &format!("#timestamp [ns], p_RS_R_x [m], ...\r\n{}", walk_at(20, euroc).replace('\n', "\r\n")));
    write("kitti.txt", &walk_at(20, kitti));
    write("times.txt", &walk_at(20, |t, _, _| format!("{t:.6e}\n")));
    write("total_station.txt", &walk_at(20, position));
    write("leica0.csv", &walk_at(20, leica));
    write("rtk.tum", &walk_at(20, identity));
    write("zeros.tum", &walk_at(20, zeros));
    let compared = |truth: &str| compared(here.path(), truth);
    let (expected, note) = compared("truth.tum");
    assert!(note.is_empty(), "{note}");
    for truth in ["euroc.csv", "kitti.txt --truth-times times.txt", "kitti.txt --truth-rate 20"] {
        let (found, note) = compared(truth);
        assert!(note.is_empty(), "{note}");
        for (key, expected) in expected.as_object().unwrap() {
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs().max(0.1);
            let is_same = match (found[key].as_f64(), expected.as_f64()) {
                (Some(found), Some(expected)) => near(found, expected),
                _ => found[key] == *expected,
            };
            assert!(is_same, "{truth}: {key}: {} and {expected}", found[key]);
        }
    }
    // Positions only: the absolute errors of the position, but no angle and nothing that depends on the axes of the truth.
    for truth in ["total_station.txt", "leica0.csv", "rtk.tum", "zeros.tum"] {
        let (found, note) = compared(truth);
        assert!(note.contains(&format!("note: {truth} has positions without attitudes")), "{note}");
        for key in ["position_rmse_m", "position_median_m", "position_max_m", "coverage", "poses"] {
            assert_eq!(found[key], expected[key], "{truth}: {key}");
        }
        assert!(found["drift_m_per_min"].is_f64() && found["end_error_m"].is_f64(), "{truth}");
        for key in ["rotation_rmse_deg", "rotation_max_deg", "yaw_drift_deg_per_min", "relative_error_per_metre_m"] {
            assert!(found[key].is_null() && expected[key].is_f64(), "{truth}: {key}");
        }
        let (code, out, _) = run(here.path(), &format!("evaluate --estimate estimate.tum --truth {truth}"));
        assert!(code == 0 && out.lines().any(|line| line.split_whitespace().eq(["rotation_rmse_deg", "-"])), "{out}");
        let limited = format!("compare --truth {truth} estimate.tum --fail-above rotation_rmse=1deg");
        let (code, _, stderr) = run(here.path(), &limited);
        assert!(code == 1 && stderr.contains("the truth has no attitudes"), "{stderr}");
    }
}

#[test]
fn a_truth_that_cannot_be_read_is_an_error_with_file_line_and_remedy() {
    let here = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(here.path().join(name), text).unwrap();
    write_walk(&here.path().join("a.tum"), (0, 10), 0.0);
    let row = "1 0 0 0 0 1 0 0 0 0 1 0\n";
    write("kitti.txt", &row.repeat(3));
    write("stretched.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n");
    write("short.txt", "0\n1\n");
    write("long.txt", "0\n1\n2\n3\n");
    write("seconds.csv", "1.5,0,0,0,1,0,0,0\n");
    write("columns.csv", "1,0,0,0,1\n");
    write("mixed.tum", "1 0 0 0\n2 0 0 0 0 0 0 1\n");
    write("back.csv", "2,0,0,0\n1,0,0,0\n");
    for (truth, code, words) in [
        ("kitti.txt", 1, "kitti.txt:1: 12 numbers are a pose in the KITTI format, which has no stamp: pass the times"),
        ("kitti.txt --truth-times short.txt", 1, "kitti.txt:3: short.txt has only 2 times"),
        ("kitti.txt --truth-times long.txt", 1, "long.txt:4: 4 times are given, and kitti.txt has only 3 poses"),
        ("kitti.txt --truth-rate 0", 2, "the frequency must be above 0 Hz"),
        ("kitti.txt --truth-rate 1e-4", 2, "--truth-rate 0.0001: expected 0.001 to 1000000 Hz"),
        ("kitti.txt --truth-rate 10 --truth-times long.txt", 2, "cannot be used with"),
        ("stretched.txt --truth-rate 10", 1, "stretched.txt:1: columns 1 to 3, 5 to 7 and 9 to 11 are not a rotation"),
        ("a.tum --truth-rate 10", 1, "a.tum:1: this file has its own stamps"),
        ("seconds.csv", 1, "seconds.csv:1: `1.5` is not a time in whole nanoseconds"),
        ("columns.csv", 1, "columns.csv:1: a line needs `t, x, y, z` or"),
        ("mixed.tum", 1, "mixed.tum:2: this pose has an attitude, and the poses before it have none"),
        ("back.csv", 1, "back.csv:2: the stamp 1 ns is not later than the previous stamp 2 ns"),
        ("/dev/zero", 1, "/dev/zero: is a device, not a regular file"),
    ] {
        let (found, _, stderr) = run(here.path(), &format!("compare --truth {truth} a.tum"));
        assert!(found == code && stderr.contains(words), "{truth}: {found} {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn control_characters_of_names_do_not_reach_terminal_or_svg() {
    let here = tempfile::tempdir().unwrap();
    write_walk(&here.path().join("truth.tum"), (0, 10), 0.0);
    write_walk(&here.path().join("\u{1b}[31mred\u{7}.tum"), (0, 10), 0.01);
    let (code, out, stderr) = run(here.path(), "compare --truth truth.tum \u{1b}[31mred\u{7}.tum --out compared");
    assert!(code == 0 && !out.contains('\u{1b}') && out.contains("\\u{1b}[31mred\\u{7}"), "{out}{stderr}");
    for file in ["errors.svg", "trajectories.svg"] {
        let svg = std::fs::read_to_string(here.path().join("compared").join(file)).unwrap();
        assert!(svg.contains("\\u{1b}[31mred\\u{7}") && !svg.contains(['\u{1b}', '\u{7}']), "{file}");
    }
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
