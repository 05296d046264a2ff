//! Errors of glTF files.

use crate::import::error::MeshError;

/// An error in the content of a glTF file.
pub(super) fn malformed(problem: impl Into<String>) -> MeshError {
    MeshError::Malformed { format: "glTF", problem: problem.into() }
}
