//! `zsim benchmark`.

use crate::command::run;
use serde_json::Value;
use std::path::Path;

/// Two recordings of 6 s, each for two settings of the estimator.
const SUITE: &str = r#"(
    base: journey(
        scene: "mocap_room", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
        estimator: "default", duration_s: 6.0, limit: (time_s: 300.0, memory_mib: 2048),
    ),
    axes: [
        values(path: "scene", values: ["mocap_room", "office"]),
        values(path: "estimator.fixed_views", values: [5, 0]),
    ],
    sampling: grid,
    seeds: [3],
    measures: [position_rmse_m],
)"#;

const NAMES: [&str; 2] = ["000-mocap_room-5-s3", "001-office-5-s3"];

fn zsim(folder: &Path, arguments: &str) -> String {
    let (code, stdout, stderr) = run(folder, arguments);
    assert_eq!(code, 0, "`{arguments}`: {stderr}");
    stdout
}

fn planned(folder: &Path) {
    std::fs::write(folder.join("s.ron"), SUITE).unwrap();
    zsim(folder, "benchmark plan s.ron -o suite");
}

#[test]
fn recordings_are_those_of_simulate_without_the_truth_and_a_second_start_continues() {
    let here = tempfile::tempdir().unwrap();
    planned(here.path());
    let file = |path: &str| std::fs::read(here.path().join("suite").join(path)).unwrap();
    let recording = format!("recordings/{}.mcap", NAMES[0]);
    zsim(here.path(), "simulate --scene mocap_room --duration 6s --seed 3 --out alone.mcap");
    let truth = file(&format!("truth/{}.tum", NAMES[0]));
    assert!(truth == std::fs::read(here.path().join("alone.tum")).unwrap());
    let topics = zsim(here.path(), &format!("info suite/{recording}"));
    assert!(topics.contains("/imu/data_raw") && topics.contains("/scan"), "{topics}");
    let (code, _, stderr) = run(here.path(), &format!("compare --truth suite/{recording} alone.tum"));
    assert!(code == 1 && stderr.contains("no ground truth"), "{stderr}");

    let before = file(&recording);
    std::fs::remove_file(here.path().join("suite").join(&recording)).unwrap();
    let other = here.path().join(format!("suite/recordings/{}.mcap", NAMES[1]));
    let modified = std::fs::metadata(&other).unwrap().modified().unwrap();
    zsim(here.path(), "benchmark plan s.ron -o suite");
    assert!(file(&recording) == before);
    assert_eq!(std::fs::metadata(&other).unwrap().modified().unwrap(), modified);

    // Another suite replaces the recordings only by --force, and all that differ.
    std::fs::write(here.path().join("s.ron"), SUITE.replace("seeds: [3]", "seeds: [4]")).unwrap();
    let (code, _, stderr) = run(here.path(), "benchmark plan s.ron -o suite");
    assert!(code == 2 && stderr.contains("another suite") && other.exists(), "{stderr}");
    zsim(here.path(), "benchmark plan s.ron -o suite --force");
    assert!(!other.exists() && here.path().join("suite/recordings/001-office-5-s4.mcap").exists());
}

#[test]
fn scores_are_those_of_compare_and_failures_count() {
    let here = tempfile::tempdir().unwrap();
    planned(here.path());
    for folder in ["whole", "partial"] {
        std::fs::create_dir(here.path().join(folder)).unwrap();
    }
    for name in NAMES {
        let run_estimate = format!("estimate suite/recordings/{name}.mcap --open-loop --quiet --out e --force");
        let (code, _, stderr) = run(here.path(), &run_estimate);
        assert!(code == 0 || code == 3, "{stderr}");
        std::fs::copy(here.path().join("e/open_loop.tum"), here.path().join(format!("whole/{name}.tum"))).unwrap();
    }
    // The other system has half of a trajectory, and none for the second recording.
    let text = std::fs::read_to_string(here.path().join(format!("whole/{}.tum", NAMES[0]))).unwrap();
    let half: Vec<&str> = text.lines().take(text.lines().count() / 2).collect();
    std::fs::write(here.path().join(format!("partial/{}.tum", NAMES[0])), half.join("\n") + "\n").unwrap();

    let score = "benchmark score suite --system <b>=whole --system partial=partial --json";
    let scores: Value = serde_json::from_str(&zsim(here.path(), score)).unwrap();
    let [whole, partial] = [0, 1].map(|index| &scores["systems"][index]);
    assert_eq!((whole["succeeded"].as_u64(), partial["succeeded"].as_u64()), (Some(2), Some(0)));
    assert!(partial["median_position_rmse_m"].is_null());
    let alone = NAMES.map(|name| {
        let out = zsim(here.path(), &format!("compare --truth suite/truth/{name}.tum whole/{name}.tum --json"));
        let figures: Value = serde_json::from_str(&out).unwrap();
        figures["trajectories"][0]["position_rmse_m"].as_f64().unwrap()
    });
    let median = whole["median_position_rmse_m"].as_f64().unwrap();
    assert!((median - 0.5 * (alone[0] + alone[1])).abs() < 1e-12, "{median} and {alone:?}");
    let runs = &partial["recordings"];
    assert!(runs[NAMES[0]]["failure"].as_str().unwrap().starts_with("covers"), "{runs}");
    assert_eq!(runs[NAMES[1]]["failure"], "no trajectory");
    let csv = std::fs::read_to_string(here.path().join("suite/scores.csv")).unwrap();
    assert_eq!(csv.lines().count(), 5);
    let page = std::fs::read_to_string(here.path().join("suite/scores.html")).unwrap();
    assert!(page.contains("&lt;b&gt;") && !page.contains("<th scope=\"row\"><b>"));

    // A suite that names files outside of its folder is rejected.
    let suite = std::fs::read_to_string(here.path().join("suite/suite.json")).unwrap();
    std::fs::write(here.path().join("suite/suite.json"), suite.replacen("truth/", "../", 1)).unwrap();
    let (code, _, stderr) = run(here.path(), score);
    assert!(code != 0 && stderr.contains("not the name of a recording"), "{stderr}");
}
