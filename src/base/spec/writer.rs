//! Writing RON and JSON.

use ron::{Error, Options, extensions::Extensions};
use serde::Serialize;

// Types are erased, so that each writer is compiled once, not once for each field of a spec: that was a tenth of the code
// of the program.

/// Writes `value` as RON with the layout `pretty`.
///
/// # Errors
/// If RON cannot represent the value.
pub(super) fn to_text<T: Serialize>(value: &T, pretty: ron::ser::PrettyConfig) -> Result<String, Error> {
    let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    options.to_string_pretty(value as &dyn erased_serde::Serialize, pretty)
}

/// Converts `value` to JSON.
///
/// # Errors
/// If a key of a map is neither text nor a number.
pub fn to_json<T: Serialize>(value: &T) -> Result<serde_json::Value, serde_json::Error> {
    serde_json::to_value(value as &dyn erased_serde::Serialize)
}
