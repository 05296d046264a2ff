//! Specs shipped with zsim: heads, springs, sensors, motions, faults, studies.

use include_dir::{Dir, include_dir};

/// This folder, as built into the binary.
pub static SPECS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR");
