//! Builds a scene of one mesh from arbitrary bytes. The first byte selects the format.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::PathBuf;
use zsim_base::spec::{Source, parse};
use zsim_world::World;

const FORMATS: [&str; 5] = ["obj", "stl", "ply", "gltf", "glb"];

fuzz_target!(|data: &[u8]| {
    let Some((format, bytes)) = data.split_first() else { return };
    let file = format!("m.{}", FORMATS[usize::from(*format) % FORMATS.len()]);
    // In memory on most systems, so that a run writes no disk.
    let folder = PathBuf::from(format!("/dev/shm/zsim-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(folder.join(&file), bytes))
        .expect("a folder for the mesh");
    let text = format!(
        "(name: \"s\", materials: {{\"a\": (reflectance: 0.5)}}, items: [Solid(shape: Mesh(file: \"{file}\"), material: \"a\")])"
    );
    let source = Source { folder: Some(folder), ..Source::in_memory("s.ron", text) };
    let _ = World::build(&parse(&source).expect("a valid scene"), &source);
});
