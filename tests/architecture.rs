//! Checks what the compiler does not: the table of rooms, crates that are restricted to some rooms, circles of files, and
//! names that no room may use.
//!
//! A room is a crate, a folder of `src/`. Its manifest lists the rooms that it may use, and the compiler refuses others.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod drawing;
mod imports;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Modules of the room `base`, in order: each may use the modules before it.
const BASE: [&str; 13] = [
    "time",
    "random",
    "files",
    "parallel",
    "printable",
    "unit",
    "similar",
    "geometry",
    "signal",
    "spec",
    "ply",
    "surfel_map",
    "measurement",
];

/// The rooms, in order, each with the rooms that it may use.
const ROOMS: [(&str, &[&str]); 16] = [
    // The folders `scenes` and `specs` are crates with files only.
    ("base", &["scenes", "specs"]),
    ("truth", &["base"]),
    ("elasticity", &["base"]),
    ("recording", &["base", "truth"]),
    ("world", &["base"]),
    ("motion", &["base", "recording"]),
    ("dynamics", &["base", "elasticity", "motion"]),
    ("sensors", &["base", "world"]),
    ("simulation", &["base", "truth", "world", "motion", "dynamics", "sensors"]),
    // Neither ground truth, nor the simulator, nor recordings.
    ("estimation", &["base"]),
    ("evaluation", &["base", "estimation"]),
    ("report", &["base", "elasticity", "world", "dynamics", "simulation", "estimation", "evaluation"]),
    ("head", &["base", "elasticity", "world", "motion", "dynamics", "sensors", "report"]),
    ("run", ALL_BEFORE),
    ("study", ALL_BEFORE),
    ("cli", BELOW_CLI),
];

/// All rooms that stand before a room in [`ROOMS`].
const ALL_BEFORE: &[&str] = &["*"];

const BELOW_CLI: &[&str] = &[
    "base",
    "elasticity",
    "recording",
    "world",
    "motion",
    "dynamics",
    "sensors",
    "simulation",
    "estimation",
    "evaluation",
    "report",
    "head",
    "run",
    "study",
];

/// Crates that are restricted to some rooms, and these rooms.
const RESTRICTED_CRATES: [(&str, &[&str]); 20] = [
    ("anyhow", &["cli"]),
    ("base64", &["report", "world"]),
    ("cdr", &["recording"]),
    ("clap", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("csv", &["study"]),
    ("earcut", &["world"]),
    ("httparse", &["cli"]),
    ("include_dir", &["base"]),
    ("indicatif", &["cli"]),
    ("las", &["recording"]),
    ("mcap", &["recording", "cli"]),
    ("parry3d", &["world"]),
    ("plotters", &["report"]),
    ("png", &["report"]),
    ("rapier3d-f64", &["dynamics"]),
    ("rustix", &["run", "study"]),
    ("sha2", &["study"]),
    ("signal-hook", &["cli"]),
    ("sobol", &["study"]),
];

/// Crates of the Python package: the library, and what converts its values.
const PYTHON_CRATES: [&str; 7] = ["zsim", "numpy", "pyo3", "serde", "serde_json", "tempfile", "std"];

/// Crates and own modules of the program that connects to DDS: it passes messages and knows nothing of zsim.
const ROS2_CRATES: [&str; 8] = ["bytes", "futures", "rustdds", "std", "frame", "names", "node", "raw"];

/// Maximum length of a file of the Python package, lines; it converts values and computes nothing.
const MAX_PYTHON_FILE: usize = 250;

/// Names that the library must not use: the wall clock, collections with random iteration order, and sockets.
const FORBIDDEN_IN_LIBRARY: [&str; 4] = ["SystemTime::now", "HashMap", "HashSet", "std::net"];

fn sources() -> BTreeMap<PathBuf, String> {
    fn walk(folder: &Path, into: &mut BTreeMap<PathBuf, String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, into);
            } else if path.extension().is_some_and(|e| e == "rs") {
                into.insert(path.clone(), std::fs::read_to_string(&path).unwrap());
            }
        }
    }
    let mut files = BTreeMap::new();
    walk(&src(), &mut files);
    files
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The room of a file: the first name below `src/`.
fn room_of(path: &Path) -> String {
    let below = path.strip_prefix(src()).unwrap();
    let first = below.components().next().unwrap().as_os_str().to_str().unwrap();
    first.trim_end_matches(".rs").to_owned()
}

/// Code without comments, so that comments may use any name.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The crates that a manifest names in its tables of dependencies, those of tests included.
fn dependencies(manifest: &str) -> Vec<String> {
    let tables = manifest.split("\n[").filter(|table| table.lines().next().is_some_and(|h| h.contains("dependencies")));
    let entries = tables.flat_map(|table| table.lines().skip(1)).filter(|line| !line.starts_with('#'));
    let name = |line: &str| line.split(['.', ' ', '=']).next().unwrap_or_default().to_owned();
    entries.map(name).filter(|name| !name.is_empty()).collect()
}

/// The manifests of all rooms.
fn manifests() -> BTreeMap<String, String> {
    let folders = std::fs::read_dir(src()).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
    folders.map(|path| (room_of(&path), std::fs::read_to_string(path.join("Cargo.toml")).unwrap())).collect()
}

/// Violations of the tables by a room with this manifest, one message each.
fn violations(room: &str, manifest: &str) -> Vec<String> {
    let Some(place) = ROOMS.iter().position(|(name, _)| *name == room) else {
        return vec![format!("room `{room}` is missing in the table")];
    };
    let is_allowed = |used: &str| match ROOMS[place].1 {
        ALL_BEFORE => ROOMS[..place].iter().any(|(before, _)| *before == used),
        allowed => allowed.contains(&used),
    };
    let used = dependencies(manifest);
    let rooms = used.iter().filter_map(|name| name.strip_prefix("zsim-")).filter(|used| !is_allowed(used));
    let mut found: Vec<String> = rooms.map(|used| format!("{room} must not use {used}")).collect();
    for (name, rooms) in RESTRICTED_CRATES {
        if used.iter().any(|used| used == name) && !rooms.contains(&room) {
            found.push(format!("{name} is restricted to {rooms:?}, and {room} uses it"));
        }
    }
    found
}

#[test]
fn rooms_depend_only_on_allowed_rooms_and_crates() {
    let manifests = manifests();
    let found: Vec<String> = manifests.iter().flat_map(|(room, manifest)| violations(room, manifest)).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
    assert_eq!(manifests.len(), ROOMS.len(), "a room of the table is missing");
}

/// Update with `ZSIM_UPDATE=1 cargo test --release --test architecture the_drawing`.
#[test]
fn the_drawing_of_the_rooms_is_current() {
    let rooms_of = |manifest: &str| -> BTreeSet<String> {
        let names = dependencies(manifest).into_iter().filter_map(|name| name.strip_prefix("zsim-").map(str::to_owned));
        names.filter(|name| ROOMS.iter().any(|(room, _)| room == name)).collect()
    };
    let uses: drawing::Uses = manifests().iter().map(|(room, text)| (room.clone(), rooms_of(text))).collect();
    let drawn = drawing::svg(&uses);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures/rooms.svg");
    if std::env::var_os("ZSIM_UPDATE").is_some() {
        std::fs::write(&path, &drawn).unwrap();
    }
    let current = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(current == drawn, "{} is not of the manifests of today", path.display());
}

#[test]
fn the_check_finds_a_forbidden_room_also_among_the_dependencies_of_tests() {
    let count = |room: &str, manifest: &str| violations(room, manifest).len();
    assert_eq!(count("estimation", "[package]\n\n[dependencies]\nzsim-base.workspace = true\n"), 0);
    assert_eq!(count("estimation", "[package]\n\n[dependencies]\nzsim-truth.workspace = true\n"), 1);
    assert_eq!(count("estimation", "[package]\n\n[dev-dependencies]\nzsim-simulation = { workspace = true }\n"), 1);
    assert_eq!(count("sensors", "[package]\n\n[target.'cfg(unix)'.dependencies]\nparry3d.workspace = true\n"), 1);
    assert_eq!(count("nowhere", "[package]\n"), 1);
}

/// The modules of `base` that `text` uses, as `ROOT::module`.
fn base_modules_used(text: &str, root: &str) -> Vec<String> {
    let code = code(text);
    let names = code.match_indices(root).map(|(at, _)| {
        code[at + root.len()..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>()
    });
    names.filter(|name| BASE.contains(&name.as_str())).collect()
}

#[test]
fn modules_of_base_use_only_modules_before_them() {
    for (path, text) in sources().iter().filter(|(path, _)| room_of(path) == "base") {
        let below = path.strip_prefix(src().join("base")).unwrap();
        let module =
            below.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs").to_owned();
        if module == "lib" {
            continue;
        }
        let place = |name: &str| BASE.iter().position(|other| *other == name);
        let own = place(&module).unwrap_or_else(|| panic!("{}: `{module}` is missing in the table", path.display()));
        for used in base_modules_used(text, "crate::") {
            assert!(place(&used) <= Some(own), "{}: {module} must not use {used}", path.display());
        }
    }
}

#[test]
fn the_estimator_uses_no_random_stream_of_the_run() {
    for (path, text) in sources().iter().filter(|(path, _)| room_of(path) == "estimation") {
        let used = base_modules_used(text, "zsim_base::");
        assert!(!used.contains(&"random".to_owned()), "{}: uses the streams of the simulator", path.display());
    }
    assert_eq!(base_modules_used("use zsim_base::random::Stream; // zsim_base::time", "zsim_base::"), ["random"]);
}

#[test]
fn estimation_uses_no_files() {
    for (path, text) in sources().iter().filter(|(path, _)| room_of(path) == "estimation") {
        let code = code(text);
        assert!(!code.contains("std::fs") && !code.contains("std::io"), "{}: uses files", path.display());
    }
}

#[test]
fn the_library_uses_no_wall_clock_no_hash_order_and_no_sockets() {
    for (path, text) in sources().iter().filter(|(path, _)| !["cli", "main"].contains(&room_of(path).as_str())) {
        let code = code(text);
        for word in FORBIDDEN_IN_LIBRARY {
            assert!(!code.contains(word), "{}: uses {word}", path.display());
        }
    }
}

fn circles(files: &BTreeMap<String, String>) -> Vec<Vec<String>> {
    imports::Modules::of(files).circles()
}

/// The files of each room by their paths in it.
fn rooms() -> BTreeMap<String, BTreeMap<String, String>> {
    let mut rooms: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
    for (path, text) in sources() {
        let room = room_of(&path);
        let file = path.strip_prefix(src().join(&room)).unwrap_or(&path).to_str().unwrap().to_owned();
        rooms.entry(room).or_default().insert(file, text);
    }
    rooms
}

#[test]
fn modules_of_one_parent_do_not_import_each_other_in_a_circle() {
    let of_room = |(room, files): (String, BTreeMap<String, String>)| -> Vec<String> {
        let circles = imports::Modules::of(&files).circles_of_siblings();
        circles.iter().map(|circle| format!("{room}: {}", circle.join(", "))).collect()
    };
    let found: Vec<String> = rooms().into_iter().flat_map(of_room).collect();
    assert!(found.is_empty(), "folders or files that import each other:\n{}", found.join("\n"));
    let files = [
        ("lib.rs", "mod a;\nmod b;\n"),
        ("a/mod.rs", "mod one;\nmod two;\n"),
        ("a/one.rs", "use crate::b::B;\n"),
        ("a/two.rs", "pub struct Two;\n"),
        ("b.rs", "use crate::a::two::Two;\npub struct B(Two);\n"),
    ];
    let files = files.map(|(file, text)| (file.to_owned(), text.to_owned())).into_iter().collect();
    assert_eq!(circles(&files).len(), 0);
    assert_eq!(imports::Modules::of(&files).circles_of_siblings(), [["a", "b"]]);
}

#[test]
fn files_do_not_import_each_other_in_a_circle() {
    let of_room = |(room, files): (&String, &BTreeMap<String, String>)| -> Vec<String> {
        circles(files).iter().map(|circle| format!("{room}: {}", circle.join(", "))).collect()
    };
    let found: Vec<String> = rooms().iter().flat_map(of_room).collect();
    assert!(
        found.is_empty(),
        "files that import each other; move what they share to a file of its own:\n{}",
        found.join("\n")
    );
}

#[test]
fn the_check_finds_a_circle_through_a_reexport_and_through_a_parent() {
    let count = |files: [(&str, &str); 3]| {
        circles(&files.into_iter().map(|(file, text)| (file.to_owned(), text.to_owned())).collect()).len()
    };
    let parent = "mod b;\nmod c;\npub use b::B;\npub struct A;\n";
    let leaf = ("a/c.rs", "pub struct C;\n");
    let child = ("a/b.rs", "use super::A;\npub struct B(A);\n");
    assert_eq!(count([("a/mod.rs", parent), ("a/b.rs", "use super::c::C;\npub struct B(C);\n"), leaf]), 0);
    // A declaration and a re-export are no imports; a use of the re-exported name is one.
    assert_eq!(count([("a/mod.rs", parent), child, leaf]), 0);
    let user = "mod b;\nmod c;\npub use b::B;\npub struct A;\npub fn b() -> B {\n    B(A)\n}\n";
    assert_eq!(count([("a/mod.rs", user), child, leaf]), 1);
    let caller = "mod b;\nmod c;\npub struct A;\npub fn b() {\n    b::new();\n}\n";
    let called = ("a/b.rs", "use super::A;\npub fn new() -> A {\n    A\n}\n");
    assert_eq!(count([("a/mod.rs", caller), called, leaf]), 1);
    let back = ("a/c.rs", "use super::B;\npub struct C(B);\n");
    assert_eq!(count([("a/mod.rs", parent), ("a/b.rs", "use super::c::C;\npub struct B(C);\n"), back]), 1);
}

/// The crates that code uses: the first segment of each path in a `use` declaration that is not of the crate itself.
fn crates_used(text: &str) -> Vec<String> {
    let code = code(text);
    let paths = code.lines().filter_map(|line| line.trim().trim_start_matches("pub ").strip_prefix("use "));
    let first = paths.map(|path| path.split("::").next().unwrap_or_default().trim_end_matches(';').to_owned());
    first.filter(|name| !["crate", "super", "self"].contains(&name.as_str())).collect()
}

/// Uses of other crates, and arithmetic of its own, in a file of the Python package.
fn python_violations(text: &str) -> Vec<String> {
    let mut found: Vec<String> =
        crates_used(text).into_iter().filter(|name| !PYTHON_CRATES.contains(&name.as_str())).collect();
    let computes = [".sqrt()", ".sin()", ".cos()", ".norm()", ".inverse()", ".powi(", "nalgebra", "unsafe "];
    found.extend(computes.into_iter().filter(|word| code(text).contains(word)).map(str::to_owned));
    if text.lines().count() > MAX_PYTHON_FILE {
        found.push(format!("more than {MAX_PYTHON_FILE} lines"));
    }
    found
}

#[test]
fn the_python_package_only_converts_values_of_the_public_library() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/src");
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let violations = python_violations(&std::fs::read_to_string(&path).unwrap());
        assert!(violations.is_empty(), "{}: {}", path.display(), violations.join(", "));
        files += 1;
    }
    assert!(files > 5, "the folder has moved");
    for (path, text) in sources() {
        assert!(!code(&text).contains("pyo3"), "{}: the library must not use Python", path.display());
    }
}

#[test]
fn the_check_finds_computations_in_the_python_package() {
    assert_eq!(python_violations("use zsim::run::record;\nuse crate::arrays::matrix;\nuse std::path::Path;"), [""; 0]);
    assert_eq!(python_violations("use rapier3d_f64::prelude::RigidBody;"), ["rapier3d_f64"]);
    assert_eq!(python_violations("fn f(x: f64) -> f64 { x.sqrt() }"), [".sqrt()"]);
    assert_eq!(python_violations(&"\n".repeat(251)), ["more than 250 lines"]);
}

#[test]
fn the_program_for_ros_2_passes_messages_and_does_not_use_the_library() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("ros2/src");
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let others: Vec<_> =
            crates_used(&text).into_iter().filter(|name| !ROS2_CRATES.contains(&name.as_str())).collect();
        assert!(others.is_empty(), "{}: {}", path.display(), others.join(", "));
        assert!(text.lines().count() < 250, "{} is long for a program that passes messages", path.display());
        files += 1;
    }
    assert!(files > 2, "the folder has moved");
    let frames = src().join("cli/ros2/frame.rs");
    assert_eq!(crates_used(&std::fs::read_to_string(frames).unwrap()), ["std"], "both programs use this file");
    for (path, text) in sources() {
        assert!(!code(&text).contains("rustdds"), "{}: only zsim-ros2 uses DDS", path.display());
    }
}

#[test]
fn the_packages_have_every_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (folder, files) in sources().keys().fold(BTreeMap::<PathBuf, Vec<String>>::new(), |mut packages, path| {
        let room = src().join(room_of(path));
        let package = if room.is_dir() { room } else { root.to_owned() };
        let file = path.strip_prefix(&package).unwrap().to_str().unwrap().replace('\\', "/");
        packages.entry(package).or_default().push(file);
        packages
    }) {
        let mut cargo = std::process::Command::new(env!("CARGO"));
        let list = cargo.current_dir(&folder).args(["package", "--list", "--allow-dirty", "--offline"]);
        let output = list.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let packaged = String::from_utf8(output.stdout).unwrap();
        let packaged: Vec<&str> = packaged.lines().collect();
        let missing: Vec<&String> = files.iter().filter(|file| !packaged.contains(&file.as_str())).collect();
        assert!(missing.is_empty(), "{}: not in the package: {missing:?}", folder.display());
    }
}
