//! Specs: reading and writing RON files.
//!
//! A spec is a struct that derives `Deserialize` with `#[serde(deny_unknown_fields)]`. Each key contains the unit, and
//! each number is checked (see [`checked`]). [`parse`] converts text to the struct: the text becomes a [`Tree`], and the
//! struct is read from the tree. Any error (syntax, unknown key, number out of range) is a [`SpecError`] with file, line
//! and column. Relations between fields are checked when the model is built from the spec.

pub mod checked;
mod error;
mod guess;
mod library;
mod missing;
mod named;
mod position;
mod source;
mod tree;
mod writer;

pub use crate::unit::split_unit;
pub use error::SpecError;
pub use guess::{KindByKeys, kind_by_keys};
pub use library::{Kind, MAX_SPEC_BYTES, built_in, find, find_from, name_from, names, text_file};
pub use named::{Named, NamedSpec};
pub use position::Position;
pub use source::Source;
pub use tree::{Subtree, Tree};
pub use writer::to_json;

use missing::Missing;
use schemars::schema_for;
use serde::de::DeserializeOwned;
use tree::needs;

/// Parses the text of a spec.
///
/// # Errors
/// A [`SpecError`] with line and column for invalid syntax, unknown or missing keys, and numbers out of range.
pub fn parse<T: DeserializeOwned>(source: &Source) -> Result<T, SpecError> {
    parse_over(source, None)
}

/// Parses the text of a spec; keys that it does not have are those of `defaults`, in nested structs too.
///
/// # Errors
/// As [`parse`].
pub fn parse_over<T: DeserializeOwned>(source: &Source, defaults: Option<&Tree>) -> Result<T, SpecError> {
    let own = Tree::read(source)?;
    let keys = own.keys();
    let tree = defaults.into_iter().fold(own, Tree::completed_from);
    tree.to().map_err(|error: SpecError| {
        // The error of a nested key says nothing about the kind.
        let is_outermost = error.unknown_key().is_some_and(|key| keys.iter().any(|outermost| outermost == key));
        match is_outermost.then(|| kind_by_keys(&keys)).flatten() {
            Some(KindByKeys { kind, has_all: true }) => {
                error.with_help(format!("its keys are those of a spec of kind {}", kind.noun()))
            }
            _ => error,
        }
    })
}

/// Parses the text of a spec as [`parse`] does; an error about a missing key names all that are missing.
///
/// # Errors
/// As [`parse`].
pub fn parse_named<T: NamedSpec>(source: &Source) -> Result<T, SpecError> {
    parse(source).map_err(|error: SpecError| match error.missing() {
        Some(missing) => {
            let schema = schema_for!(T);
            let message = needs(&missing.owner, &missing.keys(schema.as_value()));
            let help = format!("`zsim spec reference {}` lists the keys", T::KIND.key());
            error.with_message(message).with_help(help)
        }
        None => error,
    })
}

/// Finds and parses the spec called `name`: a path, or a name in the library.
///
/// # Errors
/// If there is no such spec, or it is invalid.
pub fn load<T: NamedSpec>(name: &str) -> Result<T, SpecError> {
    T::parse(&find(T::KIND, name)?)
}

/// Writes a spec as RON that [`parse`] reads back to the same numbers.
///
/// # Errors
/// If RON cannot represent the value.
pub fn to_text<T: serde::Serialize>(value: &T) -> Result<String, SpecError> {
    let pretty = ron::ser::PrettyConfig::new().struct_names(false).depth_limit(12);
    writer::to_text(value, pretty).map_err(|error| SpecError::plain("a spec", error.to_string()))
}
