//! The examples in `examples/`: each script runs, and writes the files that it names.

use crate::skip::run_or_skip;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The examples, and the files that each must write.
const EXAMPLES: [(&str, &[&str]); 8] = [
    ("ci", &["recording.mcap", "recording.tum", "estimate.tum", "comparison/comparison.json"]),
    ("claims", &["claims/table.csv", "claims/study.md"]),
    ("evalio", &["recordings/recording.mcap", "kiss/recording.tum", "comparison/comparison.json"]),
    ("own_recording", &["estimate/metrics.json", "estimate/cloud.ply", "estimate/report.html"]),
    ("own_scene", &["workshop.svg", "workshop/metrics.json", "workshop/report.html"]),
    ("spring_design", &["springs/pareto.csv", "springs/pareto.svg"]),
    ("sweep", &["sweep/slurm/array.sh", "sweep/table.csv", "sweep/study.md"]),
    ("viewers", &["recording.mcap", "estimate/result.mcap", "head/head.urdf"]),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

/// A command that runs the script of an example in `here`, with zsim on the `PATH`.
fn script(example: &str, here: &Path) -> Command {
    let binary = Path::new(env!("CARGO_BIN_EXE_zsim")).parent().unwrap();
    let others = std::env::var_os("PATH").unwrap();
    let path = std::env::join_paths([binary.to_path_buf()].into_iter().chain(std::env::split_paths(&others))).unwrap();
    let mut command = Command::new("bash");
    command.arg(folder().join(example).join("run.sh")).current_dir(here).env("PATH", path);
    command
}

#[test]
fn each_example_runs_and_writes_its_files() {
    let mut names: Vec<_> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.path().is_dir())
        .map(|entry| entry.file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, EXAMPLES.map(|(name, _)| name), "each folder in examples/ is tested");
    for (name, files) in EXAMPLES {
        assert!(folder().join(name).join("README.md").is_file(), "{name} has a README.md");
        let here = tempfile::tempdir().unwrap();
        let Some(output) = run_or_skip(name, &mut script(name, here.path())) else { continue };
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        for file in files {
            let bytes = std::fs::metadata(here.path().join(file)).map(|file| file.len()).unwrap_or(0);
            assert!(bytes > 0, "{name}: {file} is missing or empty");
        }
    }
}

#[test]
fn the_example_of_ci_fails_above_its_limit_and_without_part_of_the_trajectory() {
    let here = tempfile::tempdir().unwrap();
    let slam = here.path().join("truth.sh");
    // The truth has no error, and its first half is too short.
    std::fs::write(&slam, "#!/bin/sh\nhead -n ${LINES_OF_TRUTH} recording.tum >\"$2\"\n").unwrap();
    let run = |lines: &str, limit: &str| {
        let mut command = script("ci", here.path());
        let output = command
            .arg(&slam)
            .env("LINES_OF_TRUTH", lines)
            .env("LIMIT_M", limit)
            .env("DURATION", "8s")
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
    };
    let executable = Command::new("chmod").arg("+x").arg(&slam).status().unwrap();
    assert!(executable.success());
    let (code, text) = run("1000000", "0.001");
    assert_eq!(code, Some(0), "{text}");
    // TUM has nine decimals: the error is not exactly zero.
    let (code, text) = run("1000000", "0");
    assert!(code == Some(1) && text.contains("estimate.tum: position_rmse_m is"), "{code:?} {text}");
    let (code, text) = run("4000", "0.001");
    assert!(code == Some(1) && text.contains("estimate.tum: covers 50.0 % of the truth"), "{code:?} {text}");
}

/// The topics of a Foxglove layout: those of its 3-D panels, and the first part of the paths of its plots.
fn topics_of_layout(layout: &serde_json::Value) -> Vec<String> {
    let panels = layout["configById"].as_object().unwrap();
    let of_views =
        panels.values().filter_map(|panel| panel["topics"].as_object()).flat_map(|topics| topics.keys().cloned());
    let paths = panels.values().filter_map(|panel| panel["paths"].as_array()).flatten();
    let of_plots = paths.map(|path| path["value"].as_str().unwrap().split('.').next().unwrap().to_owned());
    of_views.chain(of_plots).collect()
}

/// The identifiers of the panels in the tree of a layout.
fn panels_of(tree: &serde_json::Value) -> Vec<String> {
    match tree.as_str() {
        Some(panel) => vec![panel.to_owned()],
        None => ["first", "second"].iter().flat_map(|side| panels_of(&tree[side])).collect(),
    }
}

#[test]
fn layouts_for_viewers_show_topics_of_their_files() {
    let here = tempfile::tempdir().unwrap();
    assert!(script("viewers", here.path()).status().unwrap().success());
    for (layout, file) in [("recording", "recording.mcap"), ("estimate/result", "estimate/result.mcap")] {
        let text = std::fs::read_to_string(here.path().join(format!("{layout}.foxglove.json"))).unwrap();
        let layout: serde_json::Value = serde_json::from_str(&text).unwrap();
        let bytes = std::fs::read(here.path().join(file)).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().expect("a summary");
        let topics: Vec<&str> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();
        let shown = topics_of_layout(&layout);
        assert!(shown.len() > 5, "{shown:?}");
        for topic in shown {
            assert!(topics.contains(&topic.as_str()), "{file} has no {topic}: {topics:?}");
        }
        let mut panels = panels_of(&layout["layout"]);
        panels.sort();
        let defined: Vec<&String> = layout["configById"].as_object().unwrap().keys().collect();
        assert!(
            panels.iter().eq(defined.iter().copied().collect::<std::collections::BTreeSet<_>>()),
            "{panels:?} {defined:?}"
        );
    }
}
