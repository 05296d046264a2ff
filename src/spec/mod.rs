//! Specs: RON in and out.
//!
//! A spec is a struct that derives `Deserialize` with `#[serde(deny_unknown_fields)]`, a unit in every key and a
//! checked number in every field (see [`checked`]). [`parse`] turns text into it; whatever is wrong, syntax, a key
//! nobody knows, a negative mass, is one [`SpecError`] with file, line and column. What concerns several fields is
//! checked when the room that owns the spec builds its model from it.

mod bounds;
pub mod checked;
mod error;
mod library;

pub use error::SpecError;
pub use library::{Kind, Source, find, names, text_file};

use serde::de::DeserializeOwned;

/// Greatest length of a spec's text, bytes. More is a wrong file, not a spec.
pub const MAX_SPEC_BYTES: u64 = 16 << 20;

/// RON as specs are written: `Some` may be left out around values.
fn options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}

/// Parses the text of a spec.
///
/// # Errors
/// A [`SpecError`] with line and column, for bad syntax, unknown or missing keys, and numbers out of their range.
pub fn parse<T: DeserializeOwned>(source: &Source) -> Result<T, SpecError> {
    options().from_str(&source.text).map_err(|error| {
        let bounds = match error.code {
            ron::Error::IntegerOutOfBounds => bounds::message::<T>(source, &error),
            _ => None,
        };
        SpecError::at(source, error.span.start, bounds.unwrap_or_else(|| error.code.to_string()))
    })
}

/// Finds and parses the spec of `kind` called `name`: a path, or a name in the library.
///
/// # Errors
/// When there is none, or it is wrong.
pub fn load<T: DeserializeOwned>(kind: Kind, name: &str) -> Result<T, SpecError> {
    parse(&find(kind, name)?)
}

/// Writes a spec as RON that [`parse`] reads back to the same numbers.
///
/// # Errors
/// When the value has a form that RON cannot write.
pub fn to_text<T: serde::Serialize>(value: &T) -> Result<String, SpecError> {
    let pretty = ron::ser::PrettyConfig::new().struct_names(false).depth_limit(12);
    options().to_string_pretty(value, pretty).map_err(|error| SpecError::plain("a spec", error.to_string()))
}
