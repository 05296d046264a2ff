//! The pages of zsim in a headless browser.

use crate::command::{exits_with, run, zsim};
use crate::hostile_scene::hostile_scene;
use crate::skip::run_or_skip;
use std::path::Path;
use std::process::Command;

#[test]
fn the_page_works_in_a_browser_and_a_hostile_scene_name_is_inert() {
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let (code, _, errors) = run(
        here.path(),
        &format!("--quiet --scene {} --lidar lms291 --duration 8s --seed 3 --out out", scene.display()),
    );
    assert!(code == 0 || code == 3, "{errors}");
    let report = here.path().join("out/report.html");
    assert!(std::fs::read_to_string(&report).unwrap().contains("&lt;script&gt;window.hostile"));
    use_in_a_browser(&report);
}

#[test]
fn the_page_of_a_scene_works_in_a_browser() {
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let (code, _, errors) = run(here.path(), &format!("scene view {} scene.html", scene.display()));
    assert_eq!(code, 0, "{errors}");
    use_in_a_browser(&here.path().join("scene.html"));
}

/// Copies a shipped head to `folder`; returns its hostile file name.
fn hostile_head(folder: &Path) -> String {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/heads/handheld.ron");
    let name = "<script>window.hostile=1;.ron";
    std::fs::copy(shipped, folder.join(name)).unwrap();
    name.to_owned()
}

#[test]
fn the_page_of_gains_works_in_a_browser() {
    let here = tempfile::tempdir().unwrap();
    let head = hostile_head(here.path());
    let options = "--period 20 --realisations 2 --swing 2,5 --out out";
    let (code, _, errors) = run(here.path(), &format!("gains --head {head} {options}"));
    assert_eq!(code, 0, "{errors}");
    let page = here.path().join("out/report.html");
    assert!(std::fs::read_to_string(&page).unwrap().contains("Gains of &lt;script&gt;window.hostile=1;"));
    use_in_a_browser(&page);
}

#[test]
fn the_page_of_a_spring_works_in_a_browser() {
    let here = tempfile::tempdir().unwrap();
    let head = hostile_head(here.path());
    let (code, _, errors) = run(here.path(), &format!("spring {head} --out out"));
    assert_eq!(code, 0, "{errors}");
    let page = here.path().join("out/report.html");
    assert!(std::fs::read_to_string(&page).unwrap().contains("modes of &lt;script&gt;window.hostile=1;"));
    use_in_a_browser(&page);
}

#[test]
fn the_page_of_a_study_works_in_a_browser() {
    let here = tempfile::tempdir().unwrap();
    let spec = "(base: spring(head: \"handheld\", shake: (pitch_deg: 2.0)), axes: [\
                values(path: \"head.coil_diameter_mm\", values: [22.0, 23.0, 24.0]), \
                values(path: \"head.wire_diameter_mm\", values: [2.6, 2.8]), \
                levels(name: \"<script>window.hostile=2</script>\", levels: [\
                (name: \"<script>window.hostile=3</script>\"), \
                (name: \"><img src=x onerror=window.hostile=4>\", set: {\"head.material\": \"stainless\"})])], \
                sampling: grid, measures: [rocking_hz, peak_gain, spring_mass_g], \
                front: [(measure: spring_mass_g, aim: least), (measure: peak_gain, aim: least)])";
    std::fs::write(here.path().join("coil.ron"), spec).unwrap();
    // The page shows its own path in a command.
    let folder = "it's <script>window.hostile=5;";
    let study = |arguments: &[&str]| {
        exits_with(0, zsim().current_dir(here.path()).args(arguments));
    };
    study(&["study", "coil.ron", "--out", folder]);
    use_in_a_browser(&here.path().join(folder).join("report.html"));
}

#[test]
fn the_page_of_a_study_opens_the_runs_that_it_keeps() {
    let here = tempfile::tempdir().unwrap();
    let spec = "(base: journey(scene: \"mocap_room\", head: \"handheld\", motion: \"hand\", lidar: \"utm30lx\", \
                imu: \"3dm_gx2\", clock: \"drifting\", estimator: \"default\", duration_s: 6.0, \
                limit: (time_s: 300.0, memory_mib: 2048)), \
                axes: [values(path: \"imu\", values: [\"3dm_gx2\", \"tactical\"])], sampling: grid, seeds: [3], \
                measures: [position_rmse_m, rotation_rmse_deg], \
                front: [(measure: position_rmse_m, aim: least), (measure: rotation_rmse_deg, aim: least)])";
    std::fs::write(here.path().join("walks.ron"), spec).unwrap();
    let (code, _, errors) = run(here.path(), "study walks.ron --keep-runs --out out");
    assert_eq!(code, 0, "{errors}");
    use_in_a_browser(&here.path().join("out/report.html"));
}

#[test]
fn the_page_of_the_experiments_works_in_a_browser() {
    let here = tempfile::tempdir().unwrap();
    let (code, _, errors) = run(here.path(), "reproduce fig3 --quick --out <script>window.hostile=1;");
    assert_eq!(code, 0, "{errors}");
    let page = here.path().join("<script>window.hostile=1;/paper-quick/report.html");
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains("zsim reproduce fig3 --quick --out &lt;script&gt;window.hostile=1;"));
    for content in ["<a href=\"fig3/report.html\">", "ratio to the paper", "Not finished yet.", "<svg"] {
        assert!(text.contains(content), "{content}");
    }
    use_in_a_browser(&page);
}

/// Uses a page in a headless browser; fails if something on it does not work.
fn use_in_a_browser(page: &Path) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (script, modules) = (root.join("tests/report/browser.mjs"), root.join("target/ci-node/node_modules"));
    let mut node = Command::new("node");
    let Some(output) = run_or_skip("browser", node.arg(script).arg(modules).arg(page)) else { return };
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
