//! The page of a run that is not complete in a headless browser.

use crate::live_run::{LiveRun, hostile_scene};
use crate::skip::run_or_skip;
use std::path::Path;
use std::process::Command;

#[test]
fn the_page_of_a_run_works_in_a_browser_while_the_run_goes_on() {
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let arguments = format!("--quiet --scene {} --duration 120s --seed 3 --out out --live", scene.display());
    let live = LiveRun::start(here.path(), &arguments);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (script, modules) = (root.join("tests/report/live.mjs"), root.join("target/ci-node/node_modules"));
    let address = format!("http://{}/", live.address);
    let mut node = Command::new("node");
    let output = run_or_skip("browser", node.arg(script).arg(modules).arg(address));
    let code = live.exit_code();
    assert!(code == 0 || code == 3, "{code}");
    let Some(output) = output else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
