//! Arguments that arrive as JSON, from `zsim/_arguments.py`.

use crate::failure::Failure;
use serde::Deserializer;
use serde::de::DeserializeOwned;

/// The arguments; an error starts with the name of the one that is invalid.
pub fn read<T: DeserializeOwned>(json: &str) -> Result<T, Failure> {
    from(&mut serde_json::Deserializer::from_str(json))
}

/// As [`read`], of any source.
pub fn from<'de, T: DeserializeOwned, D: Deserializer<'de>>(source: D) -> Result<T, Failure> {
    serde_path_to_error::deserialize(source).map_err(|error| {
        // All are in one line: a column means nothing to the caller.
        let (name, text) = (error.path().to_string(), error.inner().to_string());
        let sentence = text.split(" at line ").next().unwrap_or_default();
        Failure::input(if name == "." { sentence.to_owned() } else { format!("{name}: {sentence}") })
    })
}
