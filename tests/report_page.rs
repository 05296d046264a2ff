//! The page of a run in a headless browser.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod command;

use command::run;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs as a script if a page does not escape it.
const HOSTILE: &str = "<script>window.hostile=1</script>";

/// Node, the folder of its modules and the browser; or the reason why there is no browser test.
fn browser() -> Result<(PathBuf, PathBuf), String> {
    let modules = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/ci-node/node_modules");
    if !modules.join("playwright-core").is_dir() || !modules.join("axe-core").is_dir() {
        return Err(format!("playwright-core or axe-core is missing in {}; .ci/run installs them", modules.display()));
    }
    if Command::new("node").arg("--version").output().is_err() {
        return Err("node is missing".to_owned());
    }
    let names = ["/usr/bin/chromium", "/usr/bin/chromium-headless-shell", "/usr/bin/google-chrome"];
    let chromium = names.into_iter().map(PathBuf::from).find(|path| path.exists());
    Ok((modules, chromium.ok_or("chromium is missing")?))
}

/// A scene with a hostile name in `folder`.
fn hostile_scene(folder: &Path) -> PathBuf {
    let office = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/office.ron")).unwrap();
    let scene = folder.join("hostile.ron");
    std::fs::write(&scene, office.replacen("name: \"office\"", &format!("name: \"{HOSTILE}\""), 1)).unwrap();
    scene
}

#[test]
fn the_page_works_in_a_browser_and_a_hostile_scene_name_is_inert() {
    let (modules, chromium) = match browser() {
        Ok(found) => found,
        Err(reason) => return eprintln!("skipped: {reason}"),
    };
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let (code, _, errors) =
        run(here.path(), &format!("--quiet --scene {} --duration 8s --seed 3 --out out", scene.display()));
    assert!(code == 0 || code == 3, "{errors}");
    let report = here.path().join("out/report.html");
    assert!(std::fs::read_to_string(&report).unwrap().contains("&lt;script&gt;window.hostile"));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/report_page/browser.mjs");
    let output = Command::new("node").arg(script).arg(modules).arg(chromium).arg(&report).output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
