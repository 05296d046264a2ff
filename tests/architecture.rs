//! Checks the dependencies between the modules of `src/`.
//!
//! Fails on a module that the tables do not list, on a dependency that they do not allow, and on a crate that is used
//! outside the modules it is restricted to.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod imports;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Base modules, in order: each may use the modules before it.
const BASE: [&str; 9] =
    ["time", "random", "geometry", "signal", "spec", "elasticity", "surfel_map", "measurement", "truth"];

/// Every other module, with the modules that it may use in addition to the base modules.
const UPPER: [(&str, &[&str]); 11] = [
    ("recording", &[]),
    ("world", &[]),
    ("motion", &["recording"]),
    ("dynamics", &["motion"]),
    ("sensors", &["world"]),
    ("simulation", &["world", "motion", "dynamics", "sensors"]),
    ("estimation", &[]),
    ("evaluation", &["estimation"]),
    ("report", &["simulation", "estimation", "evaluation"]),
    ("study", BELOW_STUDY),
    ("cli", BELOW_CLI),
];

const BELOW_STUDY: &[&str] =
    &["recording", "world", "motion", "dynamics", "sensors", "simulation", "estimation", "evaluation", "report"];

const BELOW_CLI: &[&str] = &[
    "recording",
    "world",
    "motion",
    "dynamics",
    "sensors",
    "simulation",
    "estimation",
    "evaluation",
    "report",
    "study",
];

/// The only modules that estimation may use: neither ground truth nor data sources.
const ESTIMATION: [&str; 7] = ["time", "geometry", "measurement", "spec", "signal", "elasticity", "surfel_map"];

/// Crates that are restricted to some modules, and these modules.
const RESTRICTED_CRATES: [(&str, &[&str]); 23] = [
    ("base64", &["report"]),
    ("parry3d", &["world"]),
    ("rapier3d_f64", &["dynamics"]),
    ("mcap", &["recording"]),
    ("las", &["recording"]),
    ("cdr_encoding", &["recording"]),
    ("plotters", &["report"]),
    ("clap", &["cli", "main"]),
    ("clap_mangen", &["cli"]),
    ("anyhow", &["cli", "main"]),
    ("indicatif", &["cli"]),
    ("http_body_util", &["cli"]),
    ("hyper", &["cli"]),
    ("hyper_util", &["cli"]),
    ("tokio", &["cli"]),
    ("include_dir", &["spec"]),
    ("cmaes", &["study"]),
    ("faer", &["estimation", "evaluation"]),
    ("parquet", &["study"]),
    ("rustix", &["study"]),
    ("sha2", &["study"]),
    ("signal_hook", &["cli"]),
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

/// The module of a file: the first name below `src/`.
fn module_of(path: &Path) -> String {
    let below = path.strip_prefix(src()).unwrap();
    let first = below.components().next().unwrap().as_os_str().to_str().unwrap();
    first.trim_end_matches(".rs").to_owned()
}

fn allowed_modules(module: &str) -> Option<Vec<&'static str>> {
    if module == "estimation" {
        return Some(ESTIMATION.to_vec());
    }
    if let Some(position) = BASE.iter().position(|r| *r == module) {
        return Some(BASE[..position].to_vec());
    }
    let (_, more) = UPPER.iter().find(|(name, _)| *name == module)?;
    Some(BASE.iter().chain(more.iter()).copied().collect())
}

/// Code without comments, so that comments may use any name.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The modules that `text` uses, as `crate::module`, `zsim::module`, or within `use crate::{...}`.
fn modules_used(text: &str) -> Vec<String> {
    let code = code(text);
    let mut used = Vec::new();
    for root in ["crate::", "zsim::"] {
        for (at, _) in code.match_indices(root) {
            let rest = &code[at + root.len()..];
            match rest.strip_prefix('{') {
                Some(group) => used.extend(first_segments(group)),
                None => used.push(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()),
            }
        }
    }
    used.retain(|name: &String| name.starts_with(|c: char| c.is_lowercase()));
    used
}

/// The first path segment of each entry of a use group; `group` starts after the opening brace.
fn first_segments(group: &str) -> Vec<String> {
    let (mut depth, mut entries, mut entry) = (0, Vec::new(), String::new());
    for c in group.chars() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => entries.push(std::mem::take(&mut entry)),
            _ if depth == 0 => entry.push(c),
            _ => {}
        }
    }
    entries.push(entry);
    let first = |e: String| e.trim().split("::").next().unwrap_or_default().trim().to_owned();
    entries.into_iter().map(first).filter(|e| !e.is_empty()).collect()
}

/// Violations of the tables, one message each.
fn violations(files: &BTreeMap<PathBuf, String>) -> Vec<String> {
    let mut violations = Vec::new();
    for (path, text) in files {
        let module = module_of(path);
        if module == "lib" || module == "main" {
            continue;
        }
        let Some(allowed) = allowed_modules(&module) else {
            violations.push(format!("{}: module `{module}` is missing in the tables", path.display()));
            continue;
        };
        for used in modules_used(text) {
            if used != module && !allowed.contains(&used.as_str()) {
                violations.push(format!("{}: {module} must not use {used}", path.display()));
            }
        }
    }
    violations
}

#[test]
fn modules_use_only_allowed_modules() {
    let violations = violations(&sources());
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn the_check_finds_every_form_of_a_forbidden_use() {
    let violations_in = |module: &str, text: &str| {
        let file = src().join(module).join("x.rs");
        violations(&BTreeMap::from([(file, text.to_owned())])).len()
    };
    assert_eq!(violations_in("estimation", "use crate::truth::TruthSample;"), 1);
    assert_eq!(violations_in("estimation", "use crate::{time::Stamp, simulation};"), 1);
    assert_eq!(violations_in("estimation", "fn f() { crate::recording::read(); }"), 1);
    assert_eq!(violations_in("estimation", "use crate::{geometry::{Pose, Vector}, time::Stamp}; // crate::truth"), 0);
    assert_eq!(violations_in("geometry", "use crate::measurement::ImuSample;"), 1);
    assert_eq!(violations_in("nowhere", ""), 1);
}

#[test]
fn restricted_crates_are_used_only_in_their_modules() {
    for (path, text) in sources() {
        let (module, code) = (module_of(&path), code(&text));
        for (name, modules) in RESTRICTED_CRATES {
            let used = code.contains(&format!("{name}::")) || code.contains(&format!("use {name}"));
            assert!(
                !used || modules.contains(&module.as_str()),
                "{}: {name} is restricted to {modules:?}",
                path.display()
            );
        }
    }
}

#[test]
fn estimation_uses_no_files() {
    for (path, text) in sources().iter().filter(|(path, _)| module_of(path) == "estimation") {
        let code = code(text);
        assert!(!code.contains("std::fs") && !code.contains("std::io"), "{}: uses files", path.display());
    }
}

#[test]
fn the_library_uses_no_wall_clock_no_hash_order_and_no_sockets() {
    for (path, text) in sources().iter().filter(|(path, _)| !["cli", "main"].contains(&module_of(path).as_str())) {
        let code = code(text);
        for word in FORBIDDEN_IN_LIBRARY {
            assert!(!code.contains(word), "{}: uses {word}", path.display());
        }
    }
}

fn circles(files: &BTreeMap<String, String>) -> Vec<Vec<String>> {
    imports::Modules::of(files).circles()
}

#[test]
fn files_do_not_import_each_other_in_a_circle() {
    let relative = |path: PathBuf| path.strip_prefix(src()).unwrap().to_str().unwrap().to_owned();
    let found = circles(&sources().into_iter().map(|(path, text)| (relative(path), text)).collect());
    let found: Vec<String> = found.iter().map(|circle| circle.join(", ")).collect();
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
    assert_eq!(
        python_violations("use zsim::study::record;\nuse crate::arrays::matrix;\nuse std::path::Path;"),
        [""; 0]
    );
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
fn the_package_has_every_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut cargo = std::process::Command::new(env!("CARGO"));
    let list = cargo.current_dir(root).args(["package", "--list", "--allow-dirty", "--offline", "-p", "zsim"]);
    let output = list.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let packaged = String::from_utf8(output.stdout).unwrap();
    let packaged: Vec<&str> = packaged.lines().collect();
    for path in sources().keys() {
        let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
        assert!(packaged.contains(&name.as_str()), "{name} is not in the package");
    }
}
