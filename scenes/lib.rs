//! Scenes shipped with zsim.

use include_dir::{Dir, include_dir};

/// This folder, as built into the binary.
pub static SCENES: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR");
