//! Hashes that identify runs by everything that determines their results.

use super::component::{Component, NamedComponent, Slot};
use crate::study::StudyError;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::Path;

/// First 128 bits of a SHA-256: collisions are negligible for any feasible number of runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ContentHash([u8; 16]);

impl ContentHash {
    /// Hash of a sequence of byte strings; lengths are hashed too, so that boundaries matter.
    pub fn of<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Self {
        let mut hash = Sha256::new();
        for part in parts {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
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

/// Hashes of a component, with and without its sensor noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct ComponentHashes {
    /// Of the complete component.
    pub full: ContentHash,
    /// Of everything that affects rays and physics; equal for lidars that differ only in their error models.
    pub without_noise: ContentHash,
}

impl ComponentHashes {
    /// Hashes a component and the content of all files that it refers to.
    pub fn of(slot: Slot, named: &NamedComponent) -> Result<Self, StudyError> {
        let mut tree = named.component.value()?;
        let mut files = Vec::new();
        if let Some(folder) = &named.folder {
            let mut names = BTreeSet::new();
            strings(&tree, &mut names);
            for name in names {
                files.extend(file_hash(&folder.join(&name))?.map(|content| (name, content)));
            }
        }
        let of = |tree: &Value| -> Result<ContentHash, StudyError> {
            let text = serde_json::to_string(tree)?;
            let head = [slot.key().as_bytes(), text.as_bytes()];
            let files = files.iter().flat_map(|(name, content)| [name.as_bytes(), content.bytes()]);
            Ok(ContentHash::of(head.into_iter().chain(files)))
        };
        let full = of(&tree)?;
        let is_lidar = matches!(named.component, Component::Lidar(_));
        let without_noise = match tree.as_object_mut().filter(|_| is_lidar) {
            Some(object) => {
                object.remove("errors");
                object.remove("noise");
                of(&tree)?
            }
            None => full,
        };
        Ok(Self { full, without_noise })
    }
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
    let bytes = std::fs::read(path).map_err(StudyError::file(path))?;
    Ok(Some(ContentHash::of([bytes.as_slice()])))
}

#[cfg(test)]
mod tests {
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
    fn lidar_noise_does_not_affect_the_ray_hash_and_referenced_files_affect_the_full_hash() {
        let lidar = NamedComponent::load(Slot::Lidar, "utm30lx").unwrap();
        let mut noisy = lidar.clone();
        let Component::Lidar(spec) = &mut noisy.component else { panic!() };
        spec.errors.range.near_sigma_m *= 2.0;
        let [first, second] = [&lidar, &noisy].map(|named| ComponentHashes::of(Slot::Lidar, named).unwrap());
        assert_ne!(first.full, second.full);
        assert_eq!(first.without_noise, second.without_noise);
        let Component::Lidar(spec) = &mut noisy.component else { panic!() };
        spec.range_max_m = 20.0;
        assert_ne!(ComponentHashes::of(Slot::Lidar, &noisy).unwrap().without_noise, first.without_noise);

        let here = tempfile::tempdir().unwrap();
        let trajectory = here.path().join("walk.tum");
        let motion = r#"Replay((poses: Tum("walk.tum"), from_route: false, still_s: 1.0, ease_s: 1.0))"#;
        std::fs::write(here.path().join("m.ron"), motion).unwrap();
        let identity = |text: &str| {
            std::fs::write(&trajectory, text).unwrap();
            let named = NamedComponent::load(Slot::Motion, &here.path().join("m.ron").display().to_string()).unwrap();
            ComponentHashes::of(Slot::Motion, &named).unwrap().full
        };
        assert_ne!(identity("a"), identity("b"));
    }
}
