//! The kind of a spec, guessed from its keys.

use super::library::folder_in_binary;
use super::{Kind, Source, Tree};
use include_dir::Dir;
use std::collections::BTreeSet;

/// Returns the kind of spec that has the most of the outermost `keys` of a text, the first of several.
///
/// The keys of a kind are those of its built-in specs.
pub fn kind_by_keys(keys: &[String]) -> Option<KindByKeys> {
    let known = |kind: Kind| {
        let texts = folder_in_binary(kind).into_iter().flat_map(Dir::files).filter_map(|file| file.contents_utf8());
        let of_each = texts.filter_map(|text| Tree::read(&Source::in_memory("", text)).ok());
        let known: BTreeSet<String> = of_each.flat_map(|tree| tree.keys()).collect();
        keys.iter().filter(|key| known.contains(*key)).count()
    };
    let matching = Kind::ALL.into_iter().map(|kind| (kind, known(kind)));
    // The first of equal ones: `max_by_key` returns the last.
    let (kind, count) = matching.rev().max_by_key(|(_, count)| *count)?;
    (count > 0).then_some(KindByKeys { kind, has_all: count == keys.len() })
}

/// A kind of spec, guessed from keys.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindByKeys {
    /// The kind that has the most of the keys.
    pub kind: Kind,
    /// Whether it has all of them.
    pub has_all: bool,
}
