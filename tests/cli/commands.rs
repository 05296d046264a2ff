//! The commands: output, files and errors.

use crate::command::{run, zsim};
use crate::skip;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use zsim::report::Metrics;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The figures without run times and memory use, which are not reproducible.
fn reproducible(mut figures: Value) -> Value {
    for (group, keys) in [
        ("simulation", &["wall_s", "physics_wall_s", "rays_wall_s"][..]),
        ("open_loop", &["wall_s", "fraction_of_acquisition"]),
        ("closed_loop", &["wall_s", "fraction_of_acquisition"]),
    ] {
        let group = figures[group].as_object_mut().unwrap();
        keys.iter().for_each(|key| assert!(group.remove(*key).unwrap().as_f64().unwrap() > 0.0));
    }
    let object = figures.as_object_mut().unwrap();
    object.remove("peak_rss_mib");
    object.remove("out");
    figures
}

#[test]
fn a_full_run_writes_all_files_independent_of_the_number_of_threads() {
    let here = tempfile::tempdir().unwrap();
    let journey = "--scene mocap_room --duration 8s --seed 3 --out run --json";
    let (code, one, stderr) = run(here.path(), &format!("{journey} --threads 1"));
    assert_eq!(code, 0, "{stderr}");
    let (code, two, _) = run(here.path(), &format!("{journey} --threads 2"));
    assert_eq!(code, 0);
    let [one, two]: [Value; 2] = [one, two].map(|text| serde_json::from_str(&text).unwrap());
    assert_eq!((one["out"].as_str(), two["out"].as_str()), (Some("run"), Some("run-2")));
    assert_eq!(reproducible(one.clone()), reproducible(two));
    let bytes = |run: &str| std::fs::read(here.path().join(run).join("recording.mcap")).unwrap();
    assert!(bytes("run") == bytes("run-2"), "one seed, one recording");

    assert_eq!((one["scene"].as_str(), one["duration_s"].as_f64()), (Some("mocap_room"), Some(8.0)));
    // Worst of ten seeds: 0.77 mm for the position, 8.4 and 9.0 mm for the cloud by truth and by estimate.
    assert!(one["open_loop"]["position_rmse_m"].as_f64().unwrap() < 0.0023);
    assert!(one["cloud"]["sigma_by_truth_m"].as_f64().unwrap() < 0.02);
    // The operator is in view at the edge of the scans and must not count as a misplaced wall. Ten seeds: 1.0 to 1.3 %.
    assert!((0.0035..0.038).contains(&one["cloud"]["on_carrier_fraction"].as_f64().unwrap()));
    assert_eq!(one["cloud"]["on_movers_fraction"].as_f64(), Some(0.0));
    assert!(one["cloud"]["sigma_m"].as_f64().unwrap() < 0.027);
    let [open, closed] = ["open_loop", "closed_loop"].map(|loops| one[loops]["position_rmse_m"].as_f64().unwrap());
    assert!(closed < 1.05 * open, "{open} m open, {closed} m closed");
    // The bound is loose for eight seconds of a small room. The head rests for a third of the run; the estimator uses
    // that constraint and the bound does not, so the error may be below the bound. Ten seeds: 1.0 to 1.2 mm.
    let bound_m = one["closed_loop"]["bound_rmse_m"].as_f64().unwrap();
    assert!((3e-4..3.5e-3).contains(&bound_m), "{bound_m}");
    for name in [
        "manifest.ron",
        "truth.tum",
        "open_loop.tum",
        "closed_loop.tum",
        "result.mcap",
        "recording.foxglove.json",
        "result.foxglove.json",
        "head.urdf",
        "cloud.ply",
        "report.html",
        "plots/errors.svg",
        "plots/loops.svg",
        "plots/bound.svg",
        "plots/trajectory.png",
        "plots/pitch.svg",
        "plots/clock.png",
    ] {
        assert!(here.path().join("run").join(name).metadata().unwrap().len() > 1000, "{name}");
    }
    let written = std::fs::read_to_string(here.path().join("run/metrics.json")).unwrap();
    let written: Value = serde_json::from_str(&written).unwrap();
    assert_eq!(written["open_loop"], one["open_loop"]);
    the_verdict_is_that_of_the_bounds(&here.path().join("run"));
    metrics_alone_are_those_of_the_whole_estimate(here.path(), &one);
}

/// The verdict states the error, and the median and the maximum of the bounds of all poses.
fn the_verdict_is_that_of_the_bounds(folder: &Path) {
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let bound_m = |row: &str| -> f64 { row.split(',').nth(1).unwrap().parse().unwrap() };
    let mut bounds_m: Vec<f64> = read("integrity.csv").lines().skip(1).map(bound_m).collect();
    bounds_m.sort_by(f64::total_cmp);
    let (median_m, largest_m) = (bounds_m[bounds_m.len() / 2], bounds_m[bounds_m.len() - 1]);
    let metrics: Metrics = serde_json::from_str(&read("metrics.json")).unwrap();
    let rmse_m = metrics.closed_loop.position_rmse_m.unwrap();
    // Three significant digits.
    let mm = |m: f64| format!("{:.*} mm", (2.0 - (1e3 * m).log10().floor()).max(0.0) as usize, 1e3 * m);
    let verdict =
        format!("verdict: good: RMSE {}; 99 % bound: median {}, at most {}", mm(rmse_m), mm(median_m), mm(largest_m));
    let brief = zsim::report::brief(&metrics);
    assert!(brief.contains(&verdict), "{verdict}\n{brief}");
}

/// Without cloud, result, plots and page the trajectories and all metrics but those of the cloud are the same.
fn metrics_alone_are_those_of_the_whole_estimate(folder: &Path, whole: &Value) {
    let (code, text, stderr) = run(folder, "estimate run/recording.mcap --metrics-only --out alone --json");
    assert_eq!(code, 0, "{stderr}");
    let alone: Value = serde_json::from_str(&text).unwrap();
    for part in ["/integrity", "/losses", "/clock", "/open_loop/position_rmse_m", "/closed_loop/bound_rmse_m"] {
        assert!(whole.pointer(part).is_some_and(|value| !value.is_null()), "{part}");
        assert_eq!(whole.pointer(part), alone.pointer(part), "{part}");
    }
    assert!(alone["cloud"]["points"].is_null());
    let bytes = |path: &str| std::fs::read(folder.join(path)).unwrap();
    assert!(bytes("run/closed_loop.tum") == bytes("alone/closed_loop.tum"));
    let mut files: Vec<String> = std::fs::read_dir(folder.join("alone"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    let expected =
        ["closed_loop.tum", "integrity.csv", "manifest.ron", "map.ply", "metrics.json", "open_loop.tum", "windows.csv"];
    assert_eq!(files, expected);
}

#[test]
fn info_and_estimate_read_a_recording_and_report_loss_when_it_is_truncated() {
    let here = tempfile::tempdir().unwrap();
    let (code, out, _) = run(here.path(), "simulate --scene mocap_room --duration 6s --out a.mcap");
    assert_eq!((code, out.lines().last()), (0, Some("a.mcap")));
    assert!(here.path().join("a.tum").metadata().unwrap().len() > 100_000, "the ground truth is in a.tum");

    let (code, out, _) = run(here.path(), "info a.mcap");
    assert_eq!(code, 0);
    assert!(out.contains("/imu/data_raw") && out.lines().all(|line| line.chars().count() <= 80), "{out}");

    let bytes = std::fs::read(here.path().join("a.mcap")).unwrap();
    std::fs::write(here.path().join("cut.mcap"), &bytes[..bytes.len() * 2 / 3]).unwrap();
    let (code, _, stderr) = run(here.path(), "info cut.mcap --json");
    assert_eq!(code, 3, "{stderr}");
    let (code, out, stderr) = run(here.path(), "estimate cut.mcap --fixed-views 0 --open-loop --quiet");
    assert_eq!((code, out.lines().last()), (3, Some("results/cut")), "{stderr}");
    assert!(stderr.contains("The file is truncated"), "{stderr}");
    let judged = "evaluate --estimate results/cut/open_loop.tum --truth a.tum --cloud results/cut/cloud.ply --scene \
                  mocap_room --json";
    let (code, out, stderr) = run(here.path(), judged);
    assert_eq!(code, 0, "{stderr}");
    let figures: Value = serde_json::from_str(&out).unwrap();
    let metrics = std::fs::read_to_string(here.path().join("results/cut/metrics.json")).unwrap();
    let metrics: Value = serde_json::from_str(&metrics).unwrap();
    let [again, stated] =
        [&figures["position_rmse_m"], &metrics["open_loop"]["position_rmse_m"]].map(|x| x.as_f64().unwrap());
    assert!(!here.path().join("results/cut/closed_loop.tum").exists());
    assert!((again / stated - 1.0).abs() < 1e-3, "{again} and {stated}");
    assert!(figures["sigma_m"].as_f64().unwrap() < 0.05);
}

#[test]
fn a_record_of_the_imu_alone_has_no_scan_no_truth_and_no_file_of_it() {
    let here = tempfile::tempdir().unwrap();
    let command = "simulate --scene open_field --head rigid --motion stand --duration 60s --imu-only --out a.mcap";
    let (code, out, stderr) = run(here.path(), &format!("{command} --json"));
    let figures: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &figures["truth"], figures["beams"].as_u64()), (0, &Value::Null, Some(0)), "{stderr}");
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 1);
    let (_, out, _) = run(here.path(), "info a.mcap --json");
    let info: Value = serde_json::from_str(&out).unwrap();
    let topics = info["topics"].as_array().unwrap().iter().map(|topic| topic["topic"].as_str().unwrap());
    assert_eq!(topics.collect::<Vec<_>>(), ["/imu/data_raw", "/tf_static"], "{info}");
    let (code, _, stderr) = run(here.path(), "estimate a.mcap");
    assert!(code == 1 && stderr.contains("no lidar in the recording"), "{stderr}");
    assert_eq!(run(here.path(), &format!("{command} --truth-tf")).0, 2);
}

#[test]
fn the_bound_of_slam_is_above_that_of_localisation_for_any_number_of_threads() {
    let here = tempfile::tempdir().unwrap();
    run(here.path(), "simulate --scene mocap_room --duration 8s --out a.mcap");
    let bound = |options: &str| -> Value {
        let (code, out, stderr) = run(here.path(), &format!("bound a.mcap --json {options}"));
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str(&out).unwrap()
    };
    let [known, unknown] = ["", "--map unknown --threads 1"].map(bound);
    let aligned = |figures: &Value| figures["bound_rmse_m"].as_f64().unwrap();
    assert_eq!((known["map"].as_str(), unknown["map"].as_str()), (Some("known"), Some("unknown")));
    assert!(aligned(&unknown) > 1.02 * aligned(&known), "{known} {unknown}");
    assert!(known["planes"].is_null() && unknown["planes"].as_u64() > Some(50), "{unknown}");
    assert_eq!(unknown["joint_beam_fraction"].as_f64(), Some(1.0));
    assert_eq!(unknown, bound("--map unknown --threads 2"));
    bound("--map unknown --out bound");
    let csv = std::fs::read_to_string(here.path().join("bound/bound.csv")).unwrap();
    assert!(csv.starts_with("stamp_ns,x_m") && csv.lines().count() > 25, "{csv}");
}

#[test]
fn evaluate_agrees_with_evo() {
    // `evo_ape tum truth.tum estimate.tum -a` (evo 1.38.1) gives rmse 0.029285.
    let data = root().join("tests/data/evo");
    let (code, out, _) = run(&data, "evaluate --estimate estimate.tum --truth truth.tum --json");
    let figures: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert!((figures["position_rmse_m"].as_f64().unwrap() - 0.029_285).abs() < 1e-6);
    assert!(figures["drift_m_per_min"].is_null(), "12 s are too short for a drift");
}

#[test]
fn invalid_usage_and_invalid_specs_exit_with_2() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("bad.ron"), "(\n    name: \"x\",\n    colour: 3,\n)\n").unwrap();
    for (arguments, words) in [
        ("", "Usage"),
        ("--duration 3s", "--scene"),
        ("--scene office --duration soon", "not a duration"),
        ("--scene office --seed x", "invalid value"),
        ("--scene nowhere", "built in are: "),
        ("--scene bad.ron", "bad.ron:3:"),
        ("--scene office --head nosuch", "no such head"),
        ("--scene office --fixed-views 100000", "fixed_views"),
        ("--scene office info x.mcap", "--scene before a command"),
        ("simulate", "--scene"),
        ("evaluate --estimate a.tum", "--truth"),
        ("check bad.ron", "^"),
        ("fly", "unrecognized"),
    ] {
        let (code, _, stderr) = run(here.path(), arguments);
        assert_eq!(code, 2, "`{arguments}`: {stderr}");
        assert!(stderr.contains(words), "`{arguments}` prints: {stderr}");
        assert!(!stderr.contains("panicked"));
    }
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 1, "no file remains");
}

#[test]
fn failures_at_run_time_exit_with_1_and_one_line() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("text.mcap"), "no recording").unwrap();
    for (arguments, words) in [
        ("info missing.mcap", "missing.mcap: No such file"),
        ("estimate missing.mcap", "missing.mcap: No such file"),
        ("estimate text.mcap", "not an MCAP file"),
        ("evaluate --estimate text.mcap --truth text.mcap", "text.mcap:1: "),
    ] {
        let (code, _, stderr) = run(here.path(), arguments);
        assert_eq!(code, 1, "`{arguments}`: {stderr}");
        assert!(stderr.contains(words) && stderr.lines().count() == 1, "`{arguments}` prints: {stderr}");
    }
}

#[test]
fn every_shipped_scene_and_spec_is_valid() {
    let folders = [
        "scenes",
        "specs/heads",
        "specs/motions",
        "specs/lidars",
        "specs/imus",
        "specs/clocks",
        "specs/faults",
        "specs/estimators",
    ];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(root().join(folder)).unwrap());
    let files: Vec<_> =
        files.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_some_and(|e| e == "ron")).collect();
    assert!(files.len() > 10);
    let output = zsim().current_dir(root()).arg("check").args(&files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_kind_of_a_spec_is_determined_from_its_text() {
    let here = tempfile::tempdir().unwrap();
    std::fs::copy(root().join("specs/imus/3dm_gx2.ron"), here.path().join("mine.ron")).unwrap();
    let (code, out, _) = run(here.path(), "check mine.ron");
    assert_eq!((code, out.trim()), (0, "mine.ron: IMU, OK"));
}

#[test]
fn help_and_completions_go_to_stdout() {
    let here = tempfile::tempdir().unwrap();
    for verb in ["", "simulate", "estimate", "evaluate", "check", "info", "completions", "man"] {
        let (code, out, stderr) = run(here.path(), &format!("{verb} --help"));
        assert_eq!((code, stderr.as_str()), (0, ""));
        assert!(out.trim_end().lines().last().unwrap().trim().starts_with("zsim"), "{out}");
    }
    for shell in ["bash", "zsh", "fish"] {
        let (code, out, _) = run(here.path(), &format!("completions {shell}"));
        assert!(code == 0 && out.contains("fixed-views"), "{shell}");
    }
}

#[test]
fn manual_pages_are_well_formed() {
    let here = tempfile::tempdir().unwrap();
    let (code, out, stderr) = run(here.path(), "man --out pages");
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(out.ends_with("pages\n"), "{out}");
    let pages: Vec<PathBuf> =
        std::fs::read_dir(here.path().join("pages")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(pages.len() > 25, "{}", pages.len());
    for page in &pages {
        let text = std::fs::read_to_string(page).unwrap();
        let name = page.file_stem().unwrap().to_string_lossy().into_owned();
        assert!(text.contains(&format!(".TH {name} 1 ")), "{name}: {text}");
        for section in ["NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS"] {
            assert!(text.contains(&format!("\n.SH {section}\n")), "{name}: {section}");
        }
    }
    // groff warns of unknown requests and of unbalanced macros.
    let mut groff = Command::new("groff");
    if let Some(formatted) = skip::run_or_skip("groff", groff.args(["-man", "-Tutf8", "-ww", "-z"]).args(&pages)) {
        let complaints = String::from_utf8_lossy(&formatted.stderr).into_owned();
        assert!(formatted.status.success() && complaints.is_empty(), "{complaints}");
    }
    let (code, out, _) = run(here.path(), "man --out pages");
    assert!(code == 0 && out.ends_with("pages-2\n"), "an existing folder is kept: {out}");
}
