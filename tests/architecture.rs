//! Who may name whom. Reads `src/`, and fails on a room that the table does not know, on a room that names one it may
//! not, and on a crate named outside the room that keeps it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The ground floor, from the bottom up: each may name those before it.
const GROUND: [&str; 9] =
    ["time", "random", "geometry", "signal", "spec", "elasticity", "surfel_map", "measurement", "truth"];

/// Every room above the ground floor, with the rooms it may name beside the ground floor.
const ABOVE: [(&str, &[&str]); 11] = [
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

/// All of the ground floor that estimation may name: never truth, never where data come from.
const ESTIMATION: [&str; 7] = ["time", "geometry", "measurement", "spec", "signal", "elasticity", "surfel_map"];

/// Crates that one room keeps to itself (or a few, at the door), and what each is kept for.
const KEPT: [(&str, &[&str]); 17] = [
    ("parry3d", &["world"]),
    ("rapier3d_f64", &["dynamics"]),
    ("mcap", &["recording"]),
    ("las", &["recording"]),
    ("cdr_encoding", &["recording"]),
    ("plotters", &["report"]),
    ("clap", &["cli", "main"]),
    ("anyhow", &["cli", "main"]),
    ("indicatif", &["cli"]),
    ("include_dir", &["spec"]),
    ("cmaes", &["study"]),
    ("faer", &["estimation"]),
    ("parquet", &["study"]),
    ("rustix", &["study"]),
    ("sha2", &["study"]),
    ("signal_hook", &["cli"]),
    ("sobol", &["study"]),
];

/// Words that no file of the library says: the clock on the wall, and the order of a hash.
const NOWHERE_IN_THE_LIBRARY: [&str; 3] = ["SystemTime::now", "HashMap", "HashSet"];

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

/// The room a file stands in: the first name below `src/`.
fn room_of(path: &Path) -> String {
    let below = path.strip_prefix(src()).unwrap();
    let first = below.components().next().unwrap().as_os_str().to_str().unwrap();
    first.trim_end_matches(".rs").to_owned()
}

fn rooms_a_room_may_name(room: &str) -> Option<Vec<&'static str>> {
    if room == "estimation" {
        return Some(ESTIMATION.to_vec());
    }
    if let Some(floor) = GROUND.iter().position(|r| *r == room) {
        return Some(GROUND[..floor].to_vec());
    }
    let (_, more) = ABOVE.iter().find(|(name, _)| *name == room)?;
    Some(GROUND.iter().chain(more.iter()).copied().collect())
}

/// Code without its comments, so that prose may speak of anything.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The rooms that `text` names, as `crate::room`, `zsim::room`, or within `use crate::{...}`.
fn rooms_named(text: &str) -> Vec<String> {
    let code = code(text);
    let mut named = Vec::new();
    for root in ["crate::", "zsim::"] {
        for (at, _) in code.match_indices(root) {
            let rest = &code[at + root.len()..];
            match rest.strip_prefix('{') {
                Some(group) => named.extend(names_at_top_of(group)),
                None => named.push(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()),
            }
        }
    }
    named.retain(|name: &String| name.starts_with(|c: char| c.is_lowercase()));
    named
}

/// The first names of the entries of a use group, whose text begins after its brace.
fn names_at_top_of(group: &str) -> Vec<String> {
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

/// What is wrong with the house, a sentence a fault.
fn faults(files: &BTreeMap<PathBuf, String>) -> Vec<String> {
    let mut faults = Vec::new();
    for (path, text) in files {
        let room = room_of(path);
        if room == "lib" || room == "main" {
            continue;
        }
        let Some(allowed) = rooms_a_room_may_name(&room) else {
            faults.push(format!("{}: the table knows no room `{room}`", path.display()));
            continue;
        };
        for named in rooms_named(text) {
            if named != room && !allowed.contains(&named.as_str()) {
                faults.push(format!("{}: {room} may not name {named}", path.display()));
            }
        }
    }
    faults
}

#[test]
fn every_room_names_only_those_it_may() {
    let faults = faults(&sources());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_check_sees_a_forbidden_name_in_each_form() {
    let fault_of = |room: &str, text: &str| {
        let file = src().join(room).join("x.rs");
        faults(&BTreeMap::from([(file, text.to_owned())])).len()
    };
    assert_eq!(fault_of("estimation", "use crate::truth::TruthSample;"), 1);
    assert_eq!(fault_of("estimation", "use crate::{time::Stamp, simulation};"), 1);
    assert_eq!(fault_of("estimation", "fn f() { crate::recording::read(); }"), 1);
    assert_eq!(fault_of("estimation", "use crate::{geometry::{Pose, Vector}, time::Stamp}; // crate::truth"), 0);
    assert_eq!(fault_of("geometry", "use crate::measurement::ImuSample;"), 1);
    assert_eq!(fault_of("nowhere", ""), 1);
}

#[test]
fn each_kept_crate_stays_in_its_room() {
    for (path, text) in sources() {
        let (room, code) = (room_of(&path), code(&text));
        for (kept, rooms) in KEPT {
            let named = code.contains(&format!("{kept}::")) || code.contains(&format!("use {kept}"));
            assert!(!named || rooms.contains(&room.as_str()), "{}: {kept} is kept by {rooms:?}", path.display());
        }
    }
}

#[test]
fn estimation_opens_no_file() {
    for (path, text) in sources().iter().filter(|(path, _)| room_of(path) == "estimation") {
        let code = code(text);
        assert!(!code.contains("std::fs") && !code.contains("std::io"), "{}: names files", path.display());
    }
}

#[test]
fn the_library_reads_no_clock_and_hashes_no_order() {
    for (path, text) in sources().iter().filter(|(path, _)| !["cli", "main"].contains(&room_of(path).as_str())) {
        let code = code(text);
        for word in NOWHERE_IN_THE_LIBRARY {
            assert!(!code.contains(word), "{}: says {word}", path.display());
        }
    }
}
