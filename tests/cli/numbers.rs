//! Extreme numbers in scenes and specs: `zsim check` accepts or refuses each within limits of time and memory.

use rand::RngExt;
use rand::seq::SliceRandom;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use zsim::random::{Seed, Stream};
use zsim::spec::Kind;

const EXTREMES: [&str; 13] = [
    "0",
    "-1",
    "0.5",
    "1e-300",
    "1e9",
    "1e150",
    "1e308",
    "-1e308",
    "NaN",
    "inf",
    "18446744073709551615",
    "9223372036854775807",
    "-9223372036854775808",
];
/// Number of files that are checked; `ZSIM_MUTANTS` sets another. Half of them have one extreme number, the others several.
const MUTANTS: usize = 1600;
/// Files of one process. A failure is found by checking each alone.
const BATCH: usize = 40;
/// Limits of a process.
const MAX_TIME: Duration = Duration::from_secs(60);
const MAX_MEMORY_KIB: u32 = 4_000_000;

/// Where a number is in a spec: the last names before it, and how many numbers follow them before this one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    variant: String,
    name: String,
    position: usize,
}

/// The numbers of a text outside of comments and strings.
fn numbers(text: &str) -> Vec<(Range<usize>, Key)> {
    let bytes = text.as_bytes();
    let (mut found, mut at) = (Vec::new(), 0);
    let mut key = Key { variant: String::new(), name: String::new(), position: 0 };
    while at < bytes.len() {
        let run = |accepts: fn(u8) -> bool| at + bytes[at..].iter().take_while(|byte| accepts(**byte)).count();
        let end = match bytes[at] {
            b'"' => at + 2 + text[at + 1..].find('"').unwrap_or(bytes.len() - at - 2),
            b'/' if bytes.get(at + 1) == Some(&b'/') => run(|byte| byte != b'\n'),
            b'0'..=b'9' | b'-' => {
                let end = run(|byte| byte.is_ascii_alphanumeric() || b"-+._".contains(&byte));
                found.push((at..end, key.clone()));
                key.position += 1;
                end
            }
            byte if byte.is_ascii_alphabetic() || byte == b'_' => {
                let end = run(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
                match bytes.get(end) {
                    Some(b':') => key = Key { name: text[at..end].to_owned(), position: 0, ..key },
                    Some(b'(') => key = Key { variant: text[at..end].to_owned(), position: 0, ..key },
                    _ => {}
                }
                end
            }
            _ => at + 1,
        };
        at = end;
    }
    found
}

/// A scene with the items that no shipped scene has, or only together with others.
const SCENE: &str = r#"(
    name: "all", materials: { "a": (reflectance: 0.5), "b": (reflectance: 0.1, kind: Glass(transmission: 0.5)) },
    templates: { "t": [Solid(shape: Box(size_m: (1, 1, 1)), material: "a")] },
    items: [
        Solid(shape: HeightField(size_m: (9, 9), heights: Rolling(seed: 1, cells: (10, 10), amplitude_m: 1, wavelength_m: 3)), material: "a"),
        Solid(shape: HeightField(size_m: (4, 4), heights: Grid([[0, 1], [1, 0]])), material: "a"),
        Solid(shape: Stairs(steps: 4, width_m: 1, rise_m: 0.2, tread_m: 0.3, slab_m: 0.1), material: "a"),
        Solid(shape: Cylinder(radius_m: 1, height_m: 2, sides: 6), material: "b", at_m_deg: [(1, 2, 3, 4, 5, 6)]),
        Scatter((template: "t", seed: 1, count: 9, region_m: ((0, 0, 0), (9, 9, 9)), min_spacing_m: 0.5, keep_from_routes_m: 0.1, turn: Any)),
    ],
    movers: [(template: "t", repeats: true, waypoints: [(time_s: 0, at_m_deg: (0, 0, 0, 10)), (time_s: 4, at_m_deg: (3, 0, 0, 90))])],
    swaying: [(
        scatter: (template: "t", seed: 2, count: 9, region_m: ((0, 0, 0), (9, 9, 1)), min_spacing_m: 0, turn: Fixed),
        wind_deg: 9, lean_deg: 1, amplitude_deg: 2, frequency_hz: 1, gust_speed_m_per_s: 1,
    )],
    canopies: [(size_m: (1, 2, 3), extinction_per_m: 0.5, material: "a", at_m_deg: [(5, 5, 1)])],
    routes: { "r": (closed: true, points_m: [(0, 0, 0), (5, 0, 0), (5, 5, 0)]) },
)"#;

/// A spec with extreme numbers.
struct Mutant {
    folder: &'static str,
    text: String,
    what: String,
}

impl Mutant {
    /// A text with these ranges, in order, replaced.
    fn new(folder: &'static str, name: &str, text: &str, changes: &[(Range<usize>, Key, &str)]) -> Self {
        let (mut changed, mut at) = (String::new(), 0);
        for (range, _, extreme) in changes {
            changed += &text[at..range.start];
            changed += extreme;
            at = range.end;
        }
        let what =
            |(_, key, extreme): &(_, Key, &str)| format!("{}({}[{}] = {extreme})", key.variant, key.name, key.position);
        let what = changes.iter().map(what).collect::<Vec<_>>().join(", ");
        Self { folder, text: changed + &text[at..], what: format!("{folder}/{name}: {what}") }
    }
}

/// The specs of a kind: names and texts.
fn texts(kind: Kind) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(kind.folder());
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "ron"));
    files.sort();
    let name = |path: &PathBuf| path.file_stem().unwrap().to_str().unwrap().to_owned();
    let mut texts: Vec<_> = files.iter().map(|path| (name(path), std::fs::read_to_string(path).unwrap())).collect();
    if kind == Kind::Scene {
        texts.push(("all".to_owned(), SCENE.to_owned()));
    }
    texts
}

/// One number of each key of each kind, replaced by each extreme.
fn singles() -> Vec<Mutant> {
    let mut all = Vec::new();
    for kind in Kind::ALL {
        let texts = texts(kind);
        let mut keys: BTreeMap<Key, (usize, Range<usize>)> = BTreeMap::new();
        for (at, (_, text)) in texts.iter().enumerate() {
            for (range, key) in numbers(text) {
                keys.entry(Key { position: key.position.min(3), ..key }).or_insert((at, range));
            }
        }
        for (key, (at, range)) in keys {
            let (name, text) = &texts[at];
            let mutant = |extreme| Mutant::new(kind.folder(), name, text, &[(range.clone(), key.clone(), extreme)]);
            all.extend(EXTREMES.map(mutant));
        }
    }
    all
}

/// Up to six neighbouring numbers of a spec, each replaced by an extreme with a probability of one half.
fn combined(count: usize, stream: &mut Stream) -> Vec<Mutant> {
    let all: Vec<_> = Kind::ALL.into_iter().map(|kind| (kind, texts(kind))).collect();
    let mutant = |_| {
        // Half of them are scenes, a quarter the scene above.
        let (kind, texts) = &all[if stream.random_bool(0.5) { 0 } else { stream.random_range(0..all.len()) }];
        let is_last = *kind == Kind::Scene && stream.random_bool(0.5);
        let (name, text) = &texts[if is_last { texts.len() - 1 } else { stream.random_range(0..texts.len()) }];
        let numbers = numbers(text);
        let first = stream.random_range(0..numbers.len().max(1));
        // One extreme for all in half of the cases: a pair of extents, or an extent and a wavelength.
        let common = stream.random_bool(0.5).then(|| EXTREMES[stream.random_range(0..EXTREMES.len())]);
        let mut changes = Vec::new();
        for (range, key) in numbers.into_iter().skip(first).take(6) {
            let extreme = common.unwrap_or_else(|| EXTREMES[stream.random_range(0..EXTREMES.len())]);
            if changes.is_empty() || stream.random_bool(0.5) {
                changes.push((range, key, extreme));
            }
        }
        Mutant::new(kind.folder(), name, text, &changes)
    };
    (0..count).map(mutant).collect()
}

/// Checks files; `None` if all are accepted or refused, otherwise what happened.
fn failure(folder: &Path, files: &[String], max_time: Duration) -> Option<String> {
    let script = format!("ulimit -v {MAX_MEMORY_KIB}; exec \"$0\" check \"$@\"");
    let stderr = tempfile::tempfile().unwrap();
    let mut child = Command::new("sh")
        .args(["-c", &script, env!("CARGO_BIN_EXE_zsim")])
        .args(files)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr.try_clone().unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if start.elapsed() > max_time {
            child.kill().unwrap();
            child.wait().unwrap();
            return Some(format!("more than {max_time:?}"));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let mut text = String::new();
    std::io::Seek::rewind(&mut &stderr).unwrap();
    std::io::Read::read_to_string(&mut &stderr, &mut text).unwrap();
    if matches!(code, Some(0 | 2)) && !text.contains("panicked") {
        return None;
    }
    let panic = text.lines().find(|line| line.contains("panicked") || line.contains("memory allocation"));
    Some(format!("exit code {code:?}: {}", panic.unwrap_or_else(|| text.lines().last().unwrap_or_default())))
}

#[cfg(unix)]
#[test]
fn extreme_numbers_are_accepted_or_refused_in_bounded_time_and_memory() {
    let here = tempfile::tempdir().unwrap();
    for kind in Kind::ALL {
        let folder = here.path().join(kind.folder());
        std::fs::create_dir_all(&folder).unwrap();
        // Files to which specs refer are in the same folder.
        for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(kind.folder())).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
            }
        }
    }
    let count = std::env::var("ZSIM_MUTANTS").ok().and_then(|count| count.parse().ok()).unwrap_or(MUTANTS);
    let mut stream = Seed(1).stream("tests/numbers");
    let mut chosen = singles();
    let all = chosen.len();
    chosen.shuffle(&mut stream);
    chosen.truncate(count / 2);
    let single = chosen.len();
    chosen.extend(combined(count - single, &mut stream));
    let files: Vec<String> =
        (0..).zip(&chosen).map(|(k, mutant): (usize, _)| format!("{}/mutant-{k}.ron", mutant.folder)).collect();
    files.iter().zip(&chosen).for_each(|(file, mutant)| std::fs::write(here.path().join(file), &mutant.text).unwrap());
    let mut failures = Vec::new();
    for (files, mutants) in files.chunks(BATCH).zip(chosen.chunks(BATCH)) {
        if let Some(words) = failure(here.path(), files, MAX_TIME) {
            let before = failures.len();
            for (file, mutant) in files.iter().zip(mutants) {
                let alone = failure(here.path(), std::slice::from_ref(file), MAX_TIME / 6);
                failures.extend(alone.map(|words| format!("{}: {words}", mutant.what)));
            }
            if failures.len() == before {
                failures.push(format!("{} files together: {words}", files.len()));
            }
        }
    }
    println!("{} mutants checked: {single} of {all} keys and numbers, {} combinations", chosen.len(), count - single);
    assert!(all > 5000, "the specs have moved");
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn numbers_are_found_with_their_keys() {
    let text = "(a: 1, // 2\n b: Box(size_m: (1.5, -2e3)), c: \"3\", steps: Some(4))";
    let found: Vec<(&str, String)> = numbers(text)
        .into_iter()
        .map(|(range, key)| (&text[range], format!("{}.{}.{}", key.variant, key.name, key.position)))
        .collect();
    let expected = [("1", ".a.0"), ("1.5", "Box.size_m.0"), ("-2e3", "Box.size_m.1"), ("4", "Some.steps.0")];
    assert_eq!(found, expected.map(|(number, key)| (number, key.to_owned())));
}
