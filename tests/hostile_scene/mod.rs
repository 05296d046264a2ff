//! A scene whose name would run as a script in a page.

use std::path::{Path, PathBuf};

/// Runs as a script if the page does not escape it.
pub const HOSTILE: &str = "<script>window.hostile=1</script>";

/// A scene with a hostile name in `folder`.
pub fn hostile_scene(folder: &Path) -> PathBuf {
    let office = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/office.ron")).unwrap();
    let scene = folder.join("hostile.ron");
    std::fs::write(&scene, office.replacen("name: \"office\"", &format!("name: \"{HOSTILE}\""), 1)).unwrap();
    scene
}
