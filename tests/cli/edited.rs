//! Shipped specs and small calibrations, meshes, recordings and trajectories with random edits: each gives a value or an error with
//! words, and nothing panics. `fuzz/` edits the same by coverage.

use proptest::prelude::*;
use proptest::sample::Index;
use std::io::Cursor;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;
use zsim::recording::{PlyReader, Reader, RecordingError, TopicPreference, parse_surfel_map, parse_tum};
use zsim::run::CalibrationSpec;
use zsim::spec::{Kind, Source, find, names, parse};
use zsim::study::spec_types;
use zsim::time::Span;
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

/// Edits of a binary file: the bytes from a place on are replaced by others.
fn byte_edits() -> impl Strategy<Value = Vec<(Index, usize, Vec<u8>)>> {
    let bytes = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..9),
        any::<u64>().prop_map(|number| number.to_le_bytes().to_vec()),
        (0_u32..40).prop_map(|bits| (1_u64 << bits).to_le_bytes().to_vec()),
    ];
    prop::collection::vec((any::<Index>(), 0_usize..10, bytes), 1..4)
}

fn edited_bytes(bytes: &[u8], edits: &[(Index, usize, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for (at, count, by) in edits {
        let from = at.index(bytes.len() + 1);
        let to = (from + count).min(bytes.len());
        bytes.splice(from..to, by.iter().copied());
    }
    bytes
}

/// Recordings of each container among the seeds of the fuzzer.
const RECORDINGS: [&str; 10] = [
    "recording/chunk",
    "recording/footer-of-greatest-length",
    "recording/lz4",
    "recording/nocrc",
    "recording/plain",
    "recording/zstd",
    "bag/bz2",
    "bag/plain",
    "bag/unindexed",
    "database/small",
];

/// Reads all contents of a recording: info, truth, and the measurements for each lidar topic.
fn read_all(file: Vec<u8>) -> Result<(), RecordingError> {
    let reader = Reader::new("edited", Cursor::new(file))?;
    let _ = reader.info(Span::from_seconds(0.1));
    reader.truth().for_each(drop);
    for lidar_topic in [None, Some("/points"), Some("/echoes"), Some("/livox")] {
        let lidar_topic = lidar_topic.map(str::to_owned);
        let Ok(selection) = reader.select(&TopicPreference { lidar_topic, imu_topic: None }) else { continue };
        reader.measurements(&selection).for_each(drop);
    }
    Ok(())
}

/// The folder of the edited mesh, in memory where that is possible: to replace a file on a disk takes 3 ms.
static MESHES: LazyLock<TempDir> =
    LazyLock::new(|| tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap());

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
        let folder = MESHES.path();
        // The first byte of a seed selects the format.
        std::fs::write(folder.join(format!("m.{format}")), edited(&seed(&format!("mesh/{format}"))[1..], &edits)).unwrap();
        let text = format!(
            "(name: \"s\", materials: {{\"a\": (reflectance: 0.5)}}, items: [Solid(shape: Mesh(file: \"m.{format}\"), material: \"a\")])"
        );
        let source = Source { folder: Some(folder.to_owned()), ..Source::in_memory("s.ron", text) };
        if let Err(error) = World::build(&parse(&source).unwrap(), &source) {
            prop_assert!(error.to_string().contains("s.ron"), "{error}");
        }
    }

    #[test]
    fn an_edited_recording_is_read_or_an_error(which in 0..RECORDINGS.len(), edits in byte_edits()) {
        if let Err(error) = read_all(edited_bytes(&seed(RECORDINGS[which]), &edits)) {
            prop_assert!(error.to_string().contains("edited"), "{error}");
        }
    }

    #[test]
    fn an_edited_trajectory_cloud_or_map_is_read_or_an_error(which in 0_usize..3, edits in byte_edits()) {
        let bytes = edited_bytes(&seed(["trajectory/tum", "trajectory/ply_ascii", "trajectory/ply_binary"][which]), &edits);
        if let Err(error) = parse_tum("edited", &bytes[..]) {
            prop_assert!(error.to_string().contains("edited"), "{error}");
        }
        let _ = parse_surfel_map("edited", &bytes[..]);
        if let Ok(cloud) = PlyReader::new("edited", &bytes[..]) {
            cloud.for_each(drop);
        }
    }
}
