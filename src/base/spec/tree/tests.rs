//! Tests of trees: values, errors, JSON, and the comparison with the crate `ron`.

mod differential;
mod errors;
mod form;
mod json;
mod values;

use crate::spec::{Source, SpecError, parse};
use serde::de::DeserializeOwned;

/// Reads `text` with the tree.
fn read<T: DeserializeOwned>(text: &str) -> Result<T, SpecError> {
    parse(&Source::in_memory("test.ron", text))
}
