//! What the commands print on terminals and in pipes, and how signals end them.

use crate::command::run;
use std::path::Path;

/// Maximum width of a line, columns.
const MAX_WIDTH: usize = 80;

const SPRINGS: &str = r#"(
    base: spring(head: "handheld", shake: (pitch_deg: 2.0)),
    axes: [values(path: "head.coil_diameter_mm", values: [22.0, 23.0]),
           levels(name: "material of the wire in many words", levels: [
               (name: "spring steel"), (name: "stainless", set: { "head.material": "stainless" })])],
    sampling: grid,
    measures: [rocking_hz, peak_gain, spring_mass_g, stress_share, sag_mm, field_of_view_deg, rate_deg_per_s],
)"#;

/// Runs a command that succeeds or finds a loss, and checks that its text is plain and narrow.
///
/// A word that is longer than a line, such as a path, may stand alone on it.
fn check(folder: &Path, arguments: &str) {
    let (code, out, stderr) = run(folder, arguments);
    assert!(code == 0 || code == 3, "`{arguments}`: {stderr}");
    assert!(!out.contains('\u{1b}') && !stderr.contains('\u{1b}'), "`{arguments}` prints escapes: {out}{stderr}");
    for line in out.lines().filter(|line| line.trim().contains(' ')) {
        assert!(line.chars().count() <= MAX_WIDTH, "`{arguments}`: {} columns: {line}", line.chars().count());
    }
}

#[test]
fn tables_fit_a_terminal_and_pipes_get_no_escapes() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("springs.ron"), SPRINGS).unwrap();
    for arguments in [
        "simulate --scene mocap_room --duration 8s --out a.mcap",
        "info a.mcap",
        "estimate a.mcap --out estimated",
        "estimate a.mcap --out profiled --profile --verbose",
        "bound a.mcap",
        "base estimated/open_loop.tum --head handheld --out base",
        "evaluate --estimate estimated/open_loop.tum --truth a.tum",
        "compare --truth a.mcap estimated/open_loop.tum estimated/closed_loop.tum --out compared --verbose",
        "gains --period 10 --up-to 3 --realisations 2 --swing 2 --out gains",
        "coverage --duration 5s",
        "spring handheld",
        "study springs.ron --out swept",
        "sweep status swept",
        "reproduce fig3 --quick",
        "spec list",
        "spec list faults",
        "check springs.ron",
    ] {
        check(here.path(), arguments);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_ends_every_long_command_with_its_code() {
    use std::process::{Command, Stdio};
    let here = tempfile::tempdir().unwrap();
    assert_eq!(run(here.path(), "simulate --scene mocap_room --duration 40s --out a.mcap").0, 0);
    assert_eq!(run(here.path(), "sweep plan imu_quality -o swept").0, 0);
    let commands = [
        "gains --out gains",
        "coverage --duration 50min",
        "--scene mocap_room --duration 20min --out whole",
        "estimate a.mcap --out estimated",
        "study imu_quality --out study",
        "sweep run swept",
    ];
    for (k, arguments) in commands.into_iter().enumerate() {
        let (signal, code) = if k % 2 == 0 { ("INT", 130) } else { ("TERM", 143) };
        let mut child = Command::new(env!("CARGO_BIN_EXE_zsim"))
            .args(arguments.split(' '))
            .args(["--quiet", "--threads", "1"])
            .current_dir(here.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        while !handles_signals(child.id()) {
            assert!(child.try_wait().unwrap().is_none(), "`{arguments}` ended before the signal");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        assert!(Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(code), "`{arguments}` and SIG{signal}");
    }
}

/// Whether a process has handlers of SIGINT and SIGTERM (signals 2 and 15), by its mask of caught signals in proc(5).
#[cfg(target_os = "linux")]
fn handles_signals(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or_default();
    [2, 15].iter().all(|signal| mask >> (signal - 1) & 1 == 1)
}
