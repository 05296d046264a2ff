//! Hashes that identify runs by everything that determines their results.

use super::tree::Tree;
use crate::StudyError;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;
use zsim_base::files::FileError;

/// First 128 bits of a SHA-256: collisions are negligible for any feasible number of runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ContentHash([u8; 16]);

impl ContentHash {
    /// Hash of a sequence of byte strings; lengths are hashed too, so that boundaries matter.
    pub fn of<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Self {
        let mut hash = Sha256::new();
        for part in parts {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        Self::half(hash)
    }

    /// Hash of bytes, without their length.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self::half(Sha256::new_with_prefix(bytes))
    }

    /// Hash of a stream of bytes, which is not kept in memory.
    pub fn of_stream(stream: &mut impl Read) -> std::io::Result<Self> {
        let mut hash = Sha256::new();
        std::io::copy(stream, &mut hash)?;
        Ok(Self::half(hash))
    }

    fn half(hash: Sha256) -> Self {
        let mut half = [0; 16];
        half.copy_from_slice(&hash.finalize()[..16]);
        Self(half)
    }

    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Parses the 32 hexadecimal digits that `Display` writes.
    pub fn parse(text: &str) -> Option<Self> {
        u128::from_str_radix(text, 16).ok().filter(|_| text.len() == 32).map(|number| Self(number.to_be_bytes()))
    }
}

impl std::fmt::Display for ContentHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:032x}", u128::from_be_bytes(self.0))
    }
}

/// Hash of an input of a run, and of the files that it refers to.
#[derive(Debug, Clone, Copy)]
pub(super) struct InputHash {
    /// Of the input and of its files.
    pub full: ContentHash,
    /// Of the content of its files.
    pub files: ContentHash,
}

/// Key of the settings without a name.
const UNNAMED: &str = "run";

/// Keys of the settings without a name that do not affect the recording.
const SETTINGS_AFTER_RECORDING: [&str; 3] = ["timing", "reference", "ignore_manifest"];

/// Whether the input of this key does not affect the recording.
pub(super) fn is_after_recording(key: &str) -> bool {
    key == "estimator" || SETTINGS_AFTER_RECORDING.contains(&key)
}

/// Hashes of the inputs of a run by key, in the order of its tree; settings without a name come first.
pub(super) type InputHashes = Vec<(String, InputHash)>;

/// Hashes the inputs of a run; `known` is a tree with its hashes, which are used for equal inputs.
pub(super) fn input_hashes(tree: &Tree, known: Option<(&Tree, &InputHashes)>) -> Result<InputHashes, StudyError> {
    let of = |key: &str| {
        let is_known = known.filter(|(known, _)| known.0.get(key) == tree.0.get(key));
        let hash =
            is_known.and_then(|(_, hashes)| hashes.iter().find(|(other, _)| other == key).map(|(_, hash)| *hash));
        Ok((key.to_owned(), hash.map_or_else(|| named_hash(key, &tree.0[key]), Ok)?))
    };
    let mut settings = tree.unnamed();
    settings.retain(|key, _| !is_after_recording(key));
    let unnamed = (UNNAMED.to_owned(), input_hash(UNNAMED, &Value::Object(settings), None)?);
    let later = SETTINGS_AFTER_RECORDING.into_iter().filter_map(|key| Some((key, tree.0.get(key)?)));
    let later = later.map(|(key, input)| Ok((key.to_owned(), input_hash(key, input, None)?)));
    std::iter::once(Ok(unnamed)).chain(later).chain(tree.named_keys().map(of)).collect()
}

fn named_hash(key: &str, named: &Value) -> Result<InputHash, StudyError> {
    input_hash(key, &named["spec"], named["folder"].as_str().map(Path::new))
}

fn input_hash(key: &str, input: &Value, folder: Option<&Path>) -> Result<InputHash, StudyError> {
    let mut files = Vec::new();
    if let Some(folder) = folder {
        let mut names = BTreeSet::new();
        strings(input, &mut names);
        for name in names {
            files.extend(file_hash(&folder.join(&name))?.map(|content| (name, content)));
        }
    }
    let text = input.to_string();
    let files = files.iter().flat_map(|(name, content)| [name.as_bytes(), content.bytes()]);
    Ok(InputHash {
        full: ContentHash::of([key.as_bytes(), text.as_bytes()].into_iter().chain(files.clone())),
        files: ContentHash::of(files),
    })
}

/// Collects the strings in a tree: they may be names of files.
fn strings(tree: &Value, into: &mut BTreeSet<String>) {
    match tree {
        Value::String(word) => drop(into.insert(word.clone())),
        Value::Array(list) => list.iter().for_each(|value| strings(value, into)),
        Value::Object(object) => object.values().for_each(|value| strings(value, into)),
        _ => {}
    }
}

/// Hash of a file's content, such as a mesh or a replayed trajectory; `None` if `path` is not a file.
fn file_hash(path: &Path) -> Result<Option<ContentHash>, StudyError> {
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = std::fs::read(path).map_err(FileError::at(path))?;
    Ok(Some(ContentHash::of([bytes.as_slice()])))
}

#[cfg(test)]
mod tests {
    use super::super::tree::load_named;
    use super::*;

    #[test]
    fn the_hash_is_the_first_half_of_sha256() {
        // One empty part is hashed as its length: eight zero bytes.
        let mut hash = Sha256::new();
        hash.update([0_u8; 8]);
        assert_eq!(ContentHash::of([b"".as_slice()]).bytes(), &hash.finalize()[..16]);
        let (a, b) = (ContentHash::of([b"ab".as_slice(), b"c"]), ContentHash::of([b"a".as_slice(), b"bc"]));
        assert_ne!(a, b);
        assert_eq!(ContentHash::parse(&a.to_string()), Some(a));
        assert_eq!(ContentHash::parse("12"), None);
    }

    #[test]
    fn a_change_of_a_referenced_file_changes_the_hash() {
        let here = tempfile::tempdir().unwrap();
        let trajectory = here.path().join("walk.tum");
        let motion = r#"Replay((poses: Tum("walk.tum"), from_route: false, still_s: 1.0, ease_s: 1.0))"#;
        std::fs::write(here.path().join("m.ron"), motion).unwrap();
        let identity = |text: &str| {
            std::fs::write(&trajectory, text).unwrap();
            let named = load_named("motion", &here.path().join("m.ron").display().to_string()).unwrap();
            named_hash("motion", &named).unwrap()
        };
        let [first, second] = ["a", "b"].map(identity);
        assert!(first.full != second.full && first.files != second.files);
    }
}
