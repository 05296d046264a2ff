//! Where the commands write: messages that nobody reads, inputs, links, and runs at the same time.

use crate::command::{run, zsim};
use std::path::Path;

const SHORT: &str = "simulate --scene mocap_room --duration 4s --quiet";

#[cfg(target_os = "linux")]
#[test]
fn messages_that_cannot_be_written_do_not_end_a_run() {
    use std::fs::{File, OpenOptions};
    use std::process::Stdio;
    let here = tempfile::tempdir().unwrap();
    std::fs::create_dir(here.path().join("out")).unwrap();
    std::fs::write(here.path().join("out/other"), "").unwrap();
    let full = || Stdio::from(OpenOptions::new().write(true).open("/dev/full").unwrap());
    // A pipe whose reader has ended.
    let closed = || {
        let mut ended =
            zsim().arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).stdin(Stdio::piped()).spawn().unwrap();
        let pipe = Stdio::from(ended.stdin.take().unwrap());
        ended.wait().unwrap();
        pipe
    };
    for (k, stderr) in [full(), closed()].into_iter().enumerate() {
        // The folder exists, which is a note.
        let arguments = "--scene mocap_room --duration 4s --open-loop --metrics-only --out out";
        let mut command = zsim();
        let status =
            command.current_dir(here.path()).args(arguments.split(' ')).stdout(Stdio::null()).stderr(stderr).status();
        let code = status.unwrap().code();
        assert!(code == Some(0) || code == Some(3), "{k}: {code:?}");
        assert!(here.path().join(format!("out-{}/metrics.json", k + 2)).is_file(), "{k}");
    }
    // An error that nobody reads still determines the exit code.
    let mut wrong = zsim();
    wrong.args(["check", "missing.ron"]).stdout(closed()).stderr(full());
    assert_eq!(wrong.status().unwrap().code(), Some(2));
    // Results that cannot be written are an error, unless their reader has ended.
    assert_eq!(zsim().arg("--help").stdout(full()).status().unwrap().code(), Some(1));
    assert_eq!(zsim().arg("--help").stdout(closed()).status().unwrap().code(), Some(0));
    for (stdout, expected) in [(full(), 1), (closed(), 0)] {
        let log = File::create(here.path().join("log")).unwrap();
        let status = zsim().args(["spec", "list"]).stdout(stdout).stderr(log).status().unwrap();
        assert_eq!(status.code(), Some(expected));
        let text = std::fs::read_to_string(here.path().join("log")).unwrap();
        assert_eq!(text.contains("stdout cannot be written"), expected == 1, "{text}");
    }
}

#[cfg(unix)]
#[test]
fn no_command_replaces_its_input_under_another_name() {
    use std::os::unix::fs::symlink;
    let here = tempfile::tempdir().unwrap();
    let path = |name: &str| here.path().join(name);
    std::fs::write(path("a.ply"), "a map").unwrap();
    std::fs::hard_link(path("a.ply"), path("hard.ply")).unwrap();
    symlink("a.ply", path("soft.ply")).unwrap();
    std::fs::write(path("a.tum"), "0 0 0 0 0 0 0 1\n").unwrap();
    std::fs::create_dir(path("out")).unwrap();
    std::fs::hard_link(path("a.tum"), path("out/comparison.json")).unwrap();
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/studies/imu_quality.ron"), path("plan.ron"))
        .unwrap();
    let plan = std::fs::read(path("plan.ron")).unwrap();
    for arguments in [
        "map merge a.ply a.ply --out a.ply --force",
        "map merge a.ply a.ply --out hard.ply --force",
        "map merge soft.ply soft.ply --out a.ply --force",
        "map merge hard.ply hard.ply --out soft.ply --force",
        "sweep plan plan.ron -o . --force",
        "study plan.ron -o . --force",
    ] {
        let (code, _, stderr) = run(here.path(), arguments);
        assert!(code == 2 && stderr.contains("would be replaced by the result"), "`{arguments}`: {code} {stderr}");
    }
    assert_eq!(std::fs::read(path("a.ply")).unwrap(), b"a map");
    assert_eq!(std::fs::read(path("plan.ron")).unwrap(), plan);
}

#[cfg(unix)]
#[test]
fn nothing_is_written_or_removed_through_a_link_in_a_folder_of_results() {
    use std::os::unix::fs::symlink;
    let here = tempfile::tempdir().unwrap();
    let other = here.path().join("other");
    std::fs::create_dir(&other).unwrap();
    for name in ["trajectory.svg", "gains.svg", "array.sh", "000.mcap"] {
        std::fs::write(other.join(name), "mine").unwrap();
    }
    std::fs::write(
        here.path().join("springs.ron"),
        r#"(base: spring(head: "handheld", shake: (pitch_deg: 2.0)), axes: [values(path: "head.coil_diameter_mm", values: [22.0, 23.0])],
            sampling: grid, measures: [rocking_hz])"#,
    )
    .unwrap();
    assert_eq!(run(here.path(), "sweep plan springs.ron -o submitted").0, 0);
    assert_eq!(run(here.path(), &format!("{SHORT} --out a.mcap")).0, 0);
    for (folder, link, arguments) in [
        ("run", "plots", "--scene mocap_room --duration 4s --open-loop --out run --force"),
        ("estimated", "plots", "estimate a.mcap --out estimated --force"),
        ("gains", "plots", "gains --period 10 --up-to 3 --realisations 2 --out gains --force"),
        ("swept", "parts", "study springs.ron --out swept --force"),
        ("planned", "tmp", "sweep plan springs.ron --out planned --force"),
        ("drawn", "plots", "study springs.ron --out drawn --force"),
        ("submitted", "slurm", "sweep submit submitted --slurm --dry-run"),
        ("submitted", "parts", "sweep run submitted"),
        ("suite", "recordings", "benchmark plan -o suite --force"),
        ("paper-quick", "fig3", "reproduce fig3 --quick --out . --force"),
    ] {
        let place = here.path().join(folder).join(link);
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        if place.is_dir() {
            std::fs::remove_dir_all(&place).unwrap();
        }
        symlink(&other, &place).unwrap();
        let (code, _, stderr) = run(here.path(), &format!("{arguments} --quiet"));
        assert!(code == 1 && stderr.contains(&format!("{link} is a link")), "`{arguments}`: {code} {stderr}");
        std::fs::remove_file(&place).unwrap();
    }
    let names = std::fs::read_dir(&other).unwrap().count();
    assert_eq!(names, 4, "nothing was written through a link");
    assert_eq!(std::fs::read(other.join("trajectory.svg")).unwrap(), b"mine");

    // A link in place of a file is replaced.
    let folder = here.path().join("compared");
    std::fs::create_dir(&folder).unwrap();
    symlink(other.join("gains.svg"), folder.join("errors.svg")).unwrap();
    let (code, _, stderr) = run(here.path(), "compare --truth a.mcap a.tum --out compared --force");
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(std::fs::read(other.join("gains.svg")).unwrap(), b"mine");
    assert!(std::fs::symlink_metadata(folder.join("errors.svg")).unwrap().is_file());
}

#[cfg(unix)]
#[test]
fn recording_and_truth_of_simultaneous_runs_are_of_one_run() {
    let here = tempfile::tempdir().unwrap();
    assert_eq!(run(here.path(), &format!("{SHORT} --out run.mcap")).0, 0);
    let start = |seed: usize| {
        let arguments = format!("{SHORT} --seed {seed} --out run.mcap --force");
        zsim().current_dir(here.path()).args(arguments.split(' ')).stderr(std::process::Stdio::piped()).spawn().unwrap()
    };
    let ended: Vec<_> =
        (2..5).map(start).collect::<Vec<_>>().into_iter().map(|run| run.wait_with_output().unwrap()).collect();
    assert!(ended.iter().any(|run| run.status.success()));
    for run in ended.iter().filter(|run| !run.status.success()) {
        let stderr = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(1) && stderr.contains("run.mcap is in use by another zsim"), "{stderr}");
    }
    let (code, out, stderr) = run(here.path(), "compare --truth run.mcap run.tum --json");
    assert_eq!(code, 0, "{stderr}");
    let found: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(found["trajectories"][0]["position_max_m"].as_f64().unwrap() < 2e-9, "{out}");
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 4, "no temporary file remains");
}

#[cfg(unix)]
#[test]
fn an_output_in_use_is_refused_until_its_run_is_killed() {
    let here = tempfile::tempdir().unwrap();
    std::fs::copy(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/studies/imu_quality.ron"),
        here.path().join("s.ron"),
    )
    .unwrap();
    let long = "simulate --scene mocap_room --duration 20min --quiet --out long.mcap";
    let sweep = "sweep run swept --threads 1 --quiet";
    assert_eq!(run(here.path(), "sweep plan s.ron -o swept").0, 0);
    for (first, second, words) in [
        (long, "simulate --scene mocap_room --duration 1s --quiet --out long.mcap --force", "long.mcap is in use"),
        (sweep, "sweep plan s.ron -o swept --force", "swept is in use"),
    ] {
        let mut child = zsim().current_dir(here.path()).args(first.split(' ')).spawn().unwrap();
        let started = std::time::Instant::now();
        // A second run that is sooner than the first takes its name, and the first another one.
        let is_written = || {
            let mut names = std::fs::read_dir(here.path()).unwrap().map(|entry| entry.unwrap().file_name());
            names.any(|name| name.to_string_lossy().contains("long"))
        };
        while first == long && !is_written() && started.elapsed().as_secs() < 20 {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let refused = loop {
            let (code, _, stderr) = run(here.path(), second);
            let is_refused = code == 1 && stderr.contains(words);
            if is_refused || started.elapsed().as_secs() > 20 {
                break is_refused;
            }
        };
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(refused, "`{second}` during `{first}`");
        let (code, _, stderr) = run(here.path(), second);
        assert_eq!(code, 0, "`{second}` after the kill: {stderr}");
    }
}
