//! The pages of zsim in a headless browser.

use crate::command::run;
use crate::live_run::hostile_scene;
use crate::skip::run_or_skip;
use std::path::Path;
use std::process::Command;

#[test]
fn the_page_works_in_a_browser_and_a_hostile_scene_name_is_inert() {
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let (code, _, errors) =
        run(here.path(), &format!("--quiet --scene {} --duration 8s --seed 3 --out out", scene.display()));
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
fn the_page_of_a_study_works_in_a_browser() {
    let here = tempfile::tempdir().unwrap();
    let spec = "(base: spring(head: \"handheld\", shake: (pitch_deg: 2.0)), axes: [\
                values(path: \"head.coil_diameter_mm\", values: [22.0, 23.0, 24.0]), \
                values(path: \"head.wire_diameter_mm\", values: [2.6, 2.8])], \
                sampling: grid, measures: [rocking_hz, peak_gain])";
    std::fs::write(here.path().join("coil.ron"), spec).unwrap();
    let (code, _, errors) = run(here.path(), "study coil.ron --out out");
    assert_eq!(code, 0, "{errors}");
    use_in_a_browser(&here.path().join("out/report.html"));
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
