//! Arguments that arrive as JSON, from `zsim/_arguments.py`.

use crate::failure::Failure;
use serde::de::DeserializeOwned;

/// The arguments; an error starts with the name of the one that is invalid.
pub fn read<T: DeserializeOwned>(json: &str) -> Result<T, Failure> {
    serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_str(json)).map_err(|error| {
        // All are in one line: a column means nothing to the caller.
        let (name, text) = (error.path().to_string(), error.inner().to_string());
        let sentence = text.split(" at line ").next().unwrap_or_default();
        Failure::input(if name == "." { sentence.to_owned() } else { format!("{name}: {sentence}") })
    })
}
