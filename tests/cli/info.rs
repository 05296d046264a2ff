//! `zsim info`: sensors, outlook, and its layout.

use crate::command::run;
use crate::recording::foreign::{Foreign, IMU, LaserScan, SCAN, header, imu, scan};
use std::path::Path;

const MS: i64 = 1_000_000;

/// Scans at 10 Hz and IMU samples at 100 Hz for `seconds`; the scans' stamps are `shift_s` later.
fn record(path: &Path, seconds: i64, shift_s: i64, sensors: [&str; 2]) {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for k in 0..seconds * 100 {
        let ns = 1_700_000_000_000_000_000 + k * 10 * MS;
        foreign.message(sensors[1], IMU, ns, &imu(ns, "imu"));
        if k % 10 == 0 {
            // Equal scans would be duplicates.
            let ranges = vec![2.0 + 0.01 * k as f32; 10];
            let stamp = header(ns + shift_s * 1_000_000_000, "laser");
            foreign.message(sensors[0], SCAN, ns, &LaserScan { header: stamp, ranges, ..scan(ns, 0.001, 0.1) });
        }
    }
    foreign.writer.finish().unwrap();
    std::fs::write(path, foreign.writer.into_inner().into_inner()).unwrap();
}

/// The last line of the output of `zsim info`, its continuation joined.
fn last_line(text: &str) -> String {
    let start = text.rfind("zsim estimate: ").unwrap_or_else(|| panic!("{text}"));
    text[start..].trim_end().replace("\n  ", " ")
}

#[test]
fn the_last_line_states_what_an_estimate_would_do() {
    let here = tempfile::tempdir().unwrap();
    let ending = |seconds, shift_s, sensors| {
        record(&here.path().join("run.mcap"), seconds, shift_s, sensors);
        let (code, text, error) = run(here.path(), "info run.mcap");
        assert_eq!((code, error.as_str()), (0, ""), "{text}");
        (last_line(&text), text)
    };
    let (ready, text) = ending(3, 0, ["/scan", "/imu"]);
    assert_eq!(ready, "zsim estimate: ready");
    assert!(text.contains("lidar: /scan, frame laser\nIMU: /imu, frame imu\n"), "{text}");
    assert!(text.contains("note: No transforms join lidar and IMU"), "{text}");
    let (refused, _) = ending(0, 0, ["/scan", "/imu"]);
    assert!(refused.starts_with("zsim estimate: refused: no lidar in the recording"), "{refused}");
    let (json, _) = (run(here.path(), "info run.mcap --json").1, ());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json["estimate"]["refused"].as_str().unwrap().contains("no lidar"), "{json}");
    record(&here.path().join("short.mcap"), 1, 0, ["/scan", "/imu"]);
    let text = run(here.path(), "info short.mcap").1;
    let expected = "zsim estimate: refused: /scan and /imu have 0.9 s in common; at least 1.0 s are needed";
    assert!(last_line(&text).starts_with(expected), "{text}");
    // The estimate agrees.
    let error = run(here.path(), "--quiet estimate short.mcap --out x --metrics-only --open-loop").2;
    assert!(error.contains("0.900 s in common; at least 1.000 s are needed"), "{error}");
}

#[test]
fn numbers_stay_with_their_units_whatever_the_path() {
    let here = tempfile::tempdir().unwrap();
    for length in 1..60 {
        let name = format!("{}.mcap", "n".repeat(length));
        record(&here.path().join(&name), 1, 0, ["/scan", "/imu"]);
        let text = run(here.path(), &format!("info {name}")).1;
        let head: Vec<_> = text.lines().take(3).collect();
        assert!(["0.990 s,", "110 messages,", " MiB"].iter().all(|part| text.contains(part)), "{head:?}");
        assert!(!head.iter().any(|line| line.trim_end().ends_with(|c: char| c.is_ascii_digit())), "{head:?}");
        std::fs::remove_file(here.path().join(&name)).unwrap();
    }
}

#[test]
fn a_long_name_is_cut_and_one_of_megabytes_refused() {
    let here = tempfile::tempdir().unwrap();
    let name = |length: usize| format!("/{}", "n".repeat(length));
    record(&here.path().join("huge.mcap"), 1, 0, ["/scan", &name(4 << 20)]);
    let (code, _, error) = run(here.path(), "info huge.mcap");
    assert!(code == 1 && error.contains("exceeds 4096 bytes") && error.len() < 1000, "{error}");
    record(&here.path().join("run.mcap"), 1, 0, ["/scan", &name(4000)]);
    let (code, text, error) = run(here.path(), "info run.mcap");
    assert!(code == 0 && text.len() < 10_000, "{} characters: {error}", text.len());
    assert!(text.contains('\u{2026}'), "{text}");
    let (_, _, error) = run(here.path(), "estimate run.mcap --out x --lidar-topic /none");
    assert!(error.len() < 10_000, "{} characters", error.len());
}
