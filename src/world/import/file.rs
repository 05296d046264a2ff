//! Files of meshes and of their buffers.

use super::error::MeshError;
use std::io::Read;
use std::path::Path;
use zsim_base::files;

/// Reads a regular file of at most `max_bytes`; devices and pipes, which may have no end, are refused.
pub(super) fn read_file(path: &Path, max_bytes: u64) -> Result<Vec<u8>, MeshError> {
    let mut file = files::open(path)?;
    let length = file.metadata()?.len();
    if length > max_bytes {
        return Err(MeshError::TooLarge(length));
    }
    let mut bytes = Vec::new();
    // The file may grow while it is read.
    file.by_ref().take(max_bytes).read_to_end(&mut bytes)?;
    Ok(bytes)
}
