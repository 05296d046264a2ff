//! The examples in `examples/`: each script runs, and writes the files that it names.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The examples, and the files that each must write.
const EXAMPLES: [(&str, &[&str]); 5] = [
    ("ci", &["recording.mcap", "recording.tum", "estimate.tum", "comparison/comparison.json"]),
    ("own_recording", &["estimate/metrics.json", "estimate/cloud.ply", "estimate/report.html"]),
    ("own_scene", &["workshop.svg", "workshop/metrics.json", "workshop/report.html"]),
    ("spring_design", &["springs/pareto.csv", "springs/pareto.svg"]),
    ("sweep", &["sweep/slurm/array.sh", "sweep/table.parquet", "sweep/study.md"]),
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
        let here = tempfile::tempdir().unwrap();
        let output = script(name, here.path()).output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        for file in files {
            let bytes = std::fs::metadata(here.path().join(file)).map(|file| file.len()).unwrap_or(0);
            assert!(bytes > 0, "{name}: {file} is missing or empty");
        }
        assert!(folder().join(name).join("README.md").is_file(), "{name} has a README.md");
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
