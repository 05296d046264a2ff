//! The commands with hostile input: protected files, out-of-range numbers, control characters in names, and signals.

use crate::command::run;
use std::path::Path;

const SHORT: &str = "simulate --scene mocap_room --duration 1s --quiet";

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap()
}

#[test]
fn simulate_does_not_replace_files_of_other_origin() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("run.tum"), "foreign").unwrap();
    let (code, _, stderr) = run(here.path(), &format!("{SHORT} --out run.mcap"));
    assert!(code == 1 && stderr.contains("run.tum exists: pass --force to replace it"), "{stderr}");
    assert_eq!(read(here.path(), "run.tum"), b"foreign");
    let (code, _, stderr) = run(here.path(), &format!("{SHORT} --out y.tum"));
    assert!(code == 2 && stderr.contains("another ending"), "{stderr}");
    assert!(!here.path().join("y.tum").exists());
}

#[test]
fn reproduce_does_not_replace_a_table_of_other_origin() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("paper-quick.md"), "# My paper").unwrap();
    let (code, _, stderr) = run(here.path(), "reproduce fig3 --quick --out .");
    assert!(code == 2 && stderr.contains("not written by zsim reproduce"), "{stderr}");
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 1);
}

#[test]
fn force_does_not_replace_inputs_or_files_of_a_failed_run() {
    let here = tempfile::tempdir().unwrap();
    let motion = r#"Replay((poses: Tum("in.tum"), from_route: false, still_s: 1.0, ease_s: 1.0))"#;
    std::fs::write(here.path().join("replay.ron"), motion).unwrap();
    let (code, _, stderr) = run(here.path(), &format!("{SHORT} --out in.mcap"));
    assert_eq!(code, 0, "{stderr}");
    let before = ["in.tum", "in.mcap"].map(|name| read(here.path(), name));
    let (code, _, stderr) = run(here.path(), &format!("{SHORT} --motion replay.ron --out in.mcap --force"));
    assert!(code == 2 && stderr.contains("would be replaced by the result"), "{stderr}");
    assert!(before == ["in.tum", "in.mcap"].map(|name| read(here.path(), name)));
    let (code, out, stderr) = run(here.path(), &format!("{SHORT} --seed 2 --out in.mcap --force"));
    assert_eq!((code, out.lines().last()), (0, Some("in.mcap")), "{stderr}");
    assert!(before[1] != read(here.path(), "in.mcap"), "another seed gives another recording");
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 5, "no temporary file remains");
}

#[cfg(unix)]
#[test]
fn a_replaced_folder_has_metrics_only_when_it_is_complete() {
    use std::process::{Command, Stdio};
    let here = tempfile::tempdir().unwrap();
    let has = |name: &str| here.path().join("run").join(name).exists();
    let journey = "--scene mocap_room --quiet --out run --force";
    let (code, _, stderr) = run(here.path(), &format!("{journey} --duration 8s"));
    assert!(code == 0 && has("metrics.json") && has("plots/loops.svg") && has("map.ply"), "{stderr}");
    std::fs::write(here.path().join("run/notes.txt"), "mine").unwrap();
    std::fs::write(here.path().join("run/.partial-x"), "half of a cloud").unwrap();

    let mut child = Command::new(env!("CARGO_BIN_EXE_zsim"))
        .args(journey.split(' ').chain(["--duration", "20min"]))
        .current_dir(here.path())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // A recording longer than the old one shows that the old one has been replaced.
    while here.path().join("run/recording.mcap").metadata().map_or(0, |file| file.len()) < 10_000_000 {
        assert!(child.try_wait().unwrap().is_none(), "the process ended before the signal");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let old_files = ["metrics.json", "report.html", "open_loop.tum", "cloud.ply", "plots/loops.svg", ".partial-x"];
    assert_eq!(old_files.map(has), [false; 6], "the incomplete folder has files of the old run");

    // Without loop closure, no closed-loop file of the first run remains.
    let (code, _, stderr) = run(here.path(), &format!("{journey} --duration 8s --open-loop"));
    assert!(code == 0 && has("metrics.json") && has("open_loop.tum"), "{stderr}");
    assert_eq!(["closed_loop.tum", "plots/loops.svg", "map.ply"].map(has), [false; 3]);
    assert_eq!(read(here.path(), "run/notes.txt"), b"mine", "files of other origin remain");
}

#[test]
fn force_does_not_replace_the_map_used_for_localisation() {
    let here = tempfile::tempdir().unwrap();
    let (code, _, stderr) = run(here.path(), "--scene mocap_room --duration 8s --quiet --out run");
    assert_eq!(code, 0, "{stderr}");
    let map = read(here.path(), "run/map.ply");
    let in_place = "estimate run/recording.mcap --map run/map.ply --extend-map --quiet --out run --force";
    let (code, _, stderr) = run(here.path(), in_place);
    assert!(
        code == 2 && stderr.contains("map.ply is an input of this command and would be replaced by the result"),
        "{stderr}"
    );
    assert!(map == read(here.path(), "run/map.ply"));
}

#[cfg(unix)]
#[test]
fn a_signal_closes_the_files_and_determines_the_exit_code() {
    use std::process::{Command, Stdio};
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let here = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_zsim"))
            .args("simulate --scene mocap_room --duration 20min --quiet --out long.mcap".split(' '))
            .current_dir(here.path())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The signal handlers are installed before the first chunk is written.
        while here.path().join("long.mcap").metadata().map_or(0, |file| file.len()) < 100_000 {
            assert!(child.try_wait().unwrap().is_none(), "the process ended before the signal");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(code));
        let (code, _, stderr) = run(here.path(), "info long.mcap");
        assert_eq!(code, 0, "the recording is complete: {stderr}");
    }
}

#[test]
fn out_of_range_numbers_are_refused_with_their_limit() {
    let here = tempfile::tempdir().unwrap();
    let write = |name: &str, kind: &str, from: &str, to: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs").join(kind);
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{from}");
        std::fs::write(here.path().join(name), text.replacen(from, to, 1)).unwrap();
    };
    write("lidar.ron", "lidars/utm30lx.ron", "rate_hz: 40", "rate_hz: 1e6");
    write("many.ron", "lidars/utm30lx.ron", "beams: 1081", "beams: 99999999999");
    write("imu.ron", "imus/3dm_gx2.ron", "rate_hz: 100", "rate_hz: 1e18");
    for (arguments, words) in [
        ("check lidar.ron", "0.1 to 1000"),
        ("check many.ron", "from 0 to 4294967295, found 99999999999"),
        ("check imu.ron", "1 to 10000"),
        ("simulate --scene mocap_room --lidar lidar.ron", "0.1 to 1000"),
        ("simulate --scene mocap_room --duration 1e8s", "at most 604800 s (7 days)"),
        ("coverage --duration 1e5s --motion stand", "at most 3600 s"),
        ("gains --step 1e-12", "expected 0.00001 to 0.1 s"),
        ("gains --realisations 1000000000", "at most 1000"),
        ("gains --realisations 1000 --period 100", "more than 10000000"),
        ("gains --period 1e9", "more than 10000:"),
        ("check office --threads 1000000", "from 1 to 1024"),
    ] {
        let (code, _, stderr) = run(here.path(), arguments);
        assert!(code == 2 && stderr.contains(words), "`{arguments}`: {code} {stderr}");
    }
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 3, "no file remains");
}

#[test]
fn counts_of_studies_and_springs_are_refused_with_their_limit() {
    let here = tempfile::tempdir().unwrap();
    let spring = |axes: &str, sampling: &str| {
        format!(
            r#"(base: spring(head: "handheld", shake: (pitch_deg: 2.0)), axes: [{axes}], sampling: {sampling}, measures: [rocking_hz])"#
        )
    };
    let linear = |steps: &str| format!(r#"linear(path: "head.coil_diameter_mm", from: 16.0, to: 40.0{steps})"#);
    let list = |count: usize| format!(r#"values(path: "head.coil_diameter_mm", values: [{}])"#, "20.0,".repeat(count));
    let log = |k: usize| format!(r#"log(path: "head.coil_diameter_mm", from: 16.0, to: 40.0, name: Some("a{k}"))"#);
    let many: String = (0..1001).map(|k| log(k) + ",").collect();
    let twenty: String = (0..20).map(|k| log(k) + ",").collect();
    let shipped = |name: &str, from: &str, to: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/studies").join(name);
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{name}: {from}");
        text.replacen(from, to, 1)
    };
    for (name, text, words) in [
        (
            "most",
            spring(&linear(", steps: Some(9223372036854775807)"), "grid"),
            "9223372036854775807 steps: expected at most 10000",
        ),
        ("more", spring(&linear(", steps: Some(5000000000)"), "grid"), "5000000000 steps: expected at most 10000"),
        ("values", spring(&list(10_001), "grid"), "10001 values: expected at most 10000"),
        ("axes", spring(&many, "sobol(count: 8)"), "1001 axes: expected at most 1000"),
        (
            "count",
            spring(&linear(""), "latin_hypercube(count: 18446744073709551615, seed: 1)"),
            "expected 1 to 10000000",
        ),
        ("both", spring(&twenty, "latin_hypercube(count: 9000000, seed: 1)"), "expected at most 5000000 samples"),
        ("blocks", shipped("timing.ron", "block_s: 5.0", "block_s: 1e-300"), "expected at most 10000"),
        (
            "seeds",
            shipped("timing.ron", "seeds: [", &format!("seeds: [{}", "1,".repeat(10_001))),
            "expected at most 10000",
        ),
        (
            "evaluated",
            shipped("spring_design.ron", "evaluations: 10000", "evaluations: 9223372036854775807"),
            "at most 1000000",
        ),
        ("verified", shipped("spring_design.ron", "candidates: 16", "candidates: 9223372036854775807"), "at most 1000"),
        ("designs", shipped("spring_office.ron", "designs: 60", "designs: 9223372036854775807"), "at most 10000"),
    ] {
        let file = format!("{name}.ron");
        std::fs::write(here.path().join(&file), text).unwrap();
        for command in ["check", if words.contains("at most 1000000") { "spring design" } else { "check" }] {
            let (code, _, stderr) = run(here.path(), &format!("{command} {file}"));
            assert!(code == 2 && stderr.contains(words), "`{command} {name}`: {code} {stderr}");
        }
    }
    let coil = "coil(coil_diameter_mm: 25.0, wire_diameter_mm: 3e-6, active_coils: 1e9, free_length_mm: 150.0, material: spring_steel)";
    std::fs::write(here.path().join("coil.ron"), coil).unwrap();
    let (code, _, stderr) = run(here.path(), "spring export coil.ron --out robot");
    assert!(code == 1 && stderr.contains("1e9 active coils; expected at most 1000"), "{code} {stderr}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_larger_than_the_disk_is_not_started() {
    // 2^20 beams at 28 Hz are 3e7 beams/s of 16 bytes each: 280 TB in 7 days.
    let here = tempfile::tempdir().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/lidars/mid360.ron");
    let text = std::fs::read_to_string(path).unwrap();
    let text = text.replace("rate_hz: 10,", "rate_hz: 28,").replace("beams: 20000,", "beams: 1048576,");
    std::fs::write(here.path().join("dense.ron"), text).unwrap();
    let dense = "simulate --scene mocap_room --motion stand --lidar dense.ron --duration 168h --out a.mcap";
    let (code, _, stderr) = run(here.path(), dense);
    assert!(code == 1 && stderr.contains("GB free"), "{stderr}");
    assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 1);
}

#[test]
fn empty_and_out_of_range_trajectories_are_errors() {
    let here = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(here.path().join(name), text).unwrap();
    let poses = "1 0 0 0 0 0 0 1\n2 0 1 0 0 0 0 1\n3 1 0 0 0 0 0 1\n";
    write("empty.tum", "");
    write("poses.tum", poses);
    write("marked.tum", &format!("\u{feff}{poses}"));
    write("far.tum", &poses.replacen("2 0 1", "2 0 1e200", 1));
    for (arguments, words) in [
        ("base empty.tum", "empty.tum: a trajectory of 0 poses; 3 are needed"),
        (
            "evaluate --estimate far.tum --truth poses.tum",
            "far.tum: the pose at t = 2.000000000 s has a coordinate of 1e200 m",
        ),
        ("evaluate --estimate poses.tum --truth far.tum", "far.tum: "),
    ] {
        let (code, _, stderr) = run(here.path(), arguments);
        assert!(code == 1 && stderr.contains(words), "`{arguments}`: {code} {stderr}");
    }
    let (code, out, stderr) = run(here.path(), "evaluate --estimate marked.tum --truth poses.tum");
    assert!(code == 0 && out.contains("position_rmse_m"), "with a byte order mark: {stderr}");
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    let here = tempfile::tempdir().unwrap();
    let name = "\u{1b}]0;title\u{7}.ron";
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/imus/3dm_gx2.ron"), here.path().join(name))
        .unwrap();
    for (arguments, code) in [(format!("check {name}"), 0), (format!("check missing{name}"), 2)] {
        let (ended, out, stderr) = run(here.path(), &arguments);
        assert_eq!(ended, code, "{stderr}");
        assert!(!(out + &stderr).contains(['\u{1b}', '\u{7}']));
    }
    let (_, out, _) = run(here.path(), &format!("check {name}"));
    assert!(out.starts_with("\\u{1b}]0;title\\u{7}.ron: "), "{out}");
}
