//! The pages of a run and of an estimate that are not complete in a headless browser.

use crate::command::run;
use crate::hostile_scene::hostile_scene;
use crate::skip::run_or_skip;
use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The server of a run ends soon after the run, so two of these tests at the same time would be too slow for it.
static TURN: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

#[test]
fn the_page_of_a_run_works_in_a_browser_while_the_run_goes_on() {
    let _turn = turn();
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let arguments = format!("--quiet --scene {} --duration 60s --seed 3 --out out --live", scene.display());
    use_in_a_browser(here.path(), &arguments);
}

#[test]
fn the_page_of_an_estimate_works_in_a_browser_while_it_goes_on() {
    let _turn = turn();
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let recording = "<script>window.hostile=1;.mcap";
    let arguments = format!("simulate --scene {} --duration 60s --seed 3 --out {recording}", scene.display());
    let (code, _, errors) = run(here.path(), &arguments);
    assert_eq!(code, 0, "{errors}");
    use_in_a_browser(here.path(), &format!("--quiet estimate {recording} --out out --live"));
}

/// Runs zsim in `folder` and uses its page in a headless browser until the run ends; fails if something on the page does not work.
fn use_in_a_browser(folder: &Path, arguments: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (script, modules) = (root.join("tests/report/live.mjs"), root.join("target/ci-node/node_modules"));
    let mut node = Command::new("node");
    node.current_dir(folder)
        .arg(script)
        .arg(modules)
        .arg(env!("CARGO_BIN_EXE_zsim"))
        .args(arguments.split_whitespace());
    let Some(output) = run_or_skip("browser", &mut node) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
