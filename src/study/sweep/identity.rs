//! What a run is, as a number: equal when all that matters is equal.

use super::component::{Component, Kept, Slot};
use crate::study::StudyError;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::Path;

/// The first half of a SHA-256: no two of any number of runs that can be made share one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Identity([u8; 16]);

impl Identity {
    /// Of some parts, each told from the next.
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

    /// Reads what is displayed.
    pub fn parse(text: &str) -> Option<Self> {
        u128::from_str_radix(text, 16).ok().filter(|_| text.len() == 32).map(|number| Self(number.to_be_bytes()))
    }
}

impl std::fmt::Display for Identity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:032x}", u128::from_be_bytes(self.0))
    }
}

/// What a component is, and what it is apart from noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Identities {
    pub whole: Identity,
    /// Of what rays and physics depend on; equal for lidars that differ in their errors alone.
    pub without_noise: Identity,
}

impl Identities {
    pub fn of(slot: Slot, kept: &Kept) -> Result<Self, StudyError> {
        let mut tree = kept.component.value()?;
        let mut files = Vec::new();
        if let Some(folder) = &kept.folder {
            let mut names = BTreeSet::new();
            words(&tree, &mut names);
            for name in names {
                files.extend(content(&folder.join(&name))?.map(|content| (name, content)));
            }
        }
        let of = |tree: &Value| -> Result<Identity, StudyError> {
            let text = serde_json::to_string(tree)?;
            let head = [slot.key().as_bytes(), text.as_bytes()];
            let files = files.iter().flat_map(|(name, content)| [name.as_bytes(), content.bytes()]);
            Ok(Identity::of(head.into_iter().chain(files)))
        };
        let whole = of(&tree)?;
        let is_lidar = matches!(kept.component, Component::Lidar(_));
        let without_noise = match tree.as_object_mut().filter(|_| is_lidar) {
            Some(object) => {
                object.remove("errors");
                object.remove("noise");
                of(&tree)?
            }
            None => whole,
        };
        Ok(Self { whole, without_noise })
    }
}

/// The words in a tree, which may name files.
fn words(tree: &Value, into: &mut BTreeSet<String>) {
    match tree {
        Value::String(word) => drop(into.insert(word.clone())),
        Value::Array(list) => list.iter().for_each(|value| words(value, into)),
        Value::Object(object) => object.values().for_each(|value| words(value, into)),
        _ => {}
    }
}

/// What is in a file, if it is one: a mesh that a scene names, a trajectory that is played.
fn content(path: &Path) -> Result<Option<Identity>, StudyError> {
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = std::fs::read(path).map_err(StudyError::file(path))?;
    Ok(Some(Identity::of([bytes.as_slice()])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_that_of_sha256() {
        // FIPS 180-4's hash of eight zero bytes and nothing else is that of one empty part.
        let mut hash = Sha256::new();
        hash.update([0_u8; 8]);
        assert_eq!(Identity::of([b"".as_slice()]).bytes(), &hash.finalize()[..16]);
        let (a, b) = (Identity::of([b"ab".as_slice(), b"c"]), Identity::of([b"a".as_slice(), b"bc"]));
        assert_ne!(a, b);
        assert_eq!(Identity::parse(&a.to_string()), Some(a));
        assert_eq!(Identity::parse("12"), None);
    }

    #[test]
    fn noise_is_no_matter_of_rays_and_a_file_is_one_of_its_spec() {
        let lidar = Kept::load(Slot::Lidar, "utm30lx").unwrap();
        let mut noisy = lidar.clone();
        let Component::Lidar(spec) = &mut noisy.component else { panic!() };
        spec.errors.range.near_sigma_m *= 2.0;
        let [first, second] = [&lidar, &noisy].map(|kept| Identities::of(Slot::Lidar, kept).unwrap());
        assert_ne!(first.whole, second.whole);
        assert_eq!(first.without_noise, second.without_noise);
        let Component::Lidar(spec) = &mut noisy.component else { panic!() };
        spec.range_max_m = 20.0;
        assert_ne!(Identities::of(Slot::Lidar, &noisy).unwrap().without_noise, first.without_noise);

        let here = tempfile::tempdir().unwrap();
        let place = here.path().join("walk.tum");
        let motion = r#"Replay((poses: Tum("walk.tum"), from_route: false, still_s: 1.0, ease_s: 1.0))"#;
        std::fs::write(here.path().join("m.ron"), motion).unwrap();
        let identity = |text: &str| {
            std::fs::write(&place, text).unwrap();
            let kept = Kept::load(Slot::Motion, &here.path().join("m.ron").display().to_string()).unwrap();
            Identities::of(Slot::Motion, &kept).unwrap().whole
        };
        assert_ne!(identity("a"), identity("b"));
    }
}
