//! Files of meshes and of their buffers.

use super::error::MeshError;
use std::path::Path;

/// Reads a regular file of at most `max_bytes`; devices and pipes, which may have no end, are refused.
pub(super) fn read_file(path: &Path, max_bytes: u64) -> Result<Vec<u8>, MeshError> {
    let meta = std::fs::metadata(path)?;
    if !meta.is_file() {
        return Err(MeshError::Io(std::io::Error::other("it is not a file")));
    }
    if meta.len() > max_bytes {
        return Err(MeshError::TooLarge(meta.len()));
    }
    Ok(std::fs::read(path)?)
}
