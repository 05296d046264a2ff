//! Invalid usage of a command.

use std::error::Error;

/// Invalid usage: arguments that are inconsistent or out of range.
#[derive(Debug)]
pub(super) struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for Usage {}
