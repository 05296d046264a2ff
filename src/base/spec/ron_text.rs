//! RON with the options of specs.

use ron::error::SpannedError;
use ron::{Error, Options, extensions::Extensions};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Options of RON for specs: `Some` can be omitted around values.
fn options() -> Options {
    Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// Parses `text`.
///
/// # Errors
/// For invalid syntax, unknown or missing keys, and values out of range.
pub(super) fn from_text<T: DeserializeOwned>(text: &str) -> Result<T, SpannedError> {
    options().from_str(text)
}

/// Writes `value` with the layout `pretty`.
///
/// The type is erased so that the writer is compiled once, not once for each field of a spec: that was a tenth of the
/// code of this crate.
///
/// # Errors
/// If RON cannot represent the value.
pub(super) fn to_text<T: Serialize>(value: &T, pretty: ron::ser::PrettyConfig) -> Result<String, Error> {
    options().to_string_pretty(value as &dyn erased_serde::Serialize, pretty)
}
