//! Shipped specs, calibrations and meshes with random edits: each gives a value or an error with words, and nothing panics.

use proptest::prelude::*;
use proptest::sample::Index;
use std::path::Path;
use zsim::run::CalibrationSpec;
use zsim::spec::{Kind, Source, find, names, parse};
use zsim::study::spec_types;
use zsim::world::World;

/// Texts that are inserted: extreme numbers, other types, and characters with a meaning.
const INSERTED: [&str; 24] = [
    "",
    "-",
    "0",
    "1",
    "-1",
    "1e9",
    "1e-300",
    "1e308",
    "NaN",
    "inf",
    "-inf",
    "99999999999999999999",
    "(",
    ")",
    "[",
    "]",
    "\"",
    ",",
    ": ",
    "()",
    "[()]",
    "Some(1)",
    "\u{202e}",
    "/*",
];

/// An edit: the bytes from one place on, of this number, are replaced by one of the texts.
type Edit = (Index, usize, usize);

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    prop::collection::vec((any::<Index>(), 0_usize..12, 0..INSERTED.len()), 1..4)
}

fn edited(bytes: &[u8], edits: &[Edit]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for (at, count, text) in edits {
        let from = at.index(bytes.len() + 1);
        let to = (from + count).min(bytes.len());
        bytes.splice(from..to, INSERTED[*text].bytes());
    }
    bytes
}

fn edited_text(text: &str, edits: &[Edit]) -> String {
    String::from_utf8_lossy(&edited(text.as_bytes(), edits)).into_owned()
}

/// A file among the seeds of the fuzzer.
fn seed(file: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(file)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(15_000) })]

    #[test]
    fn an_edited_spec_is_a_spec_or_an_error(kind in 0..Kind::ALL.len(), which in any::<Index>(), edits in edits()) {
        let kind = Kind::ALL[kind];
        let shipped = names(kind);
        let source = find(kind, &shipped[which.index(shipped.len())]).unwrap();
        let source = Source { text: edited_text(&source.text, &edits), ..source };
        // The models of the others take up to a second each.
        let judged = match kind {
            Kind::Scene | Kind::Motion | Kind::Study | Kind::Faults => spec_types::parse(kind, &source),
            _ => spec_types::check(kind, &source).map(drop),
        };
        if let Err(error) = judged {
            prop_assert!(error.message().len() > 5, "{error}");
        }
    }

    #[test]
    fn an_edited_calibration_is_a_calibration_or_an_error(which in 0_usize..2, edits in edits()) {
        let text = String::from_utf8(seed(["calibration/allan", "calibration/camchain"][which])).unwrap();
        if let Err(error) = CalibrationSpec::from_kalibr(&edited_text(&text, &edits), "edited.yaml") {
            prop_assert!(error.to_string().contains("edited.yaml"), "{error}");
        }
    }

    #[test]
    fn an_edited_mesh_is_a_scene_or_an_error(which in 0_usize..4, edits in edits()) {
        let format = ["gltf", "obj", "ply", "stl"][which];
        let folder = tempfile::tempdir().unwrap();
        // The first byte of a seed selects the format.
        std::fs::write(folder.path().join(format!("m.{format}")), edited(&seed(&format!("mesh/{format}"))[1..], &edits)).unwrap();
        let text = format!(
            "(name: \"s\", materials: {{\"a\": (reflectance: 0.5)}}, items: [Solid(shape: Mesh(file: \"m.{format}\"), material: \"a\")])"
        );
        let source = Source { folder: Some(folder.path().to_owned()), ..Source::in_memory("s.ron", text) };
        if let Err(error) = World::build(&parse(&source).unwrap(), &source) {
            prop_assert!(error.to_string().contains("s.ron"), "{error}");
        }
    }
}
