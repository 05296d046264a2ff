//! The bytes of a glTF file's buffers: its binary chunk, a data URI, or a file in its folder.

use super::document::Buffer;
use super::error::malformed;
use crate::import::error::{MAX_BYTES, MeshError};
use crate::import::file::read_file;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::borrow::Cow;
use std::path::{Component, Path};

/// Base64 of RFC 4648, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Loads all buffers; together they have at most [`MAX_BYTES`], not counting the binary chunk, which is not copied.
pub(super) fn load<'a>(
    buffers: &[Buffer],
    blob: Option<&'a [u8]>,
    folder: Option<&Path>,
) -> Result<Vec<Cow<'a, [u8]>>, MeshError> {
    let mut left = MAX_BYTES;
    let mut loaded = Vec::new();
    for buffer in buffers {
        let data = match &buffer.uri {
            None => Cow::Borrowed(blob.ok_or_else(|| malformed("its binary chunk is missing"))?),
            Some(uri) => Cow::Owned(read_uri(uri, folder, left)?),
        };
        if data.len() < buffer.byte_length {
            let declared = format!("{} bytes in a buffer", buffer.byte_length);
            return Err(MeshError::CountMismatch { declared, found: format!("{} bytes", data.len()) });
        }
        left = left.saturating_sub(if buffer.uri.is_some() { data.len() as u64 } else { 0 });
        loaded.push(data);
    }
    Ok(loaded)
}

fn read_uri(uri: &str, folder: Option<&Path>, max_bytes: u64) -> Result<Vec<u8>, MeshError> {
    let too_large = || malformed(format!("its buffers have more than {MAX_BYTES} bytes"));
    if let Some(data) = uri.strip_prefix("data:") {
        let text = data.split_once(";base64,").map(|(_, text)| text);
        if text.is_some_and(|text| text.len() as u64 / 4 * 3 > max_bytes) {
            return Err(too_large());
        }
        return text
            .and_then(|text| BASE64.decode(text).ok())
            .ok_or_else(|| malformed("a buffer's data URI is not base64"));
    }
    let relative = uri.replace("%20", " ");
    let relative = Path::new(&relative);
    let stays = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let Some(folder) = folder.filter(|_| stays) else {
        return Err(malformed(format!("the buffer `{uri}` is not a file in the mesh's folder")));
    };
    let path = folder.join(relative);
    read_file(&path, max_bytes).map_err(|error| match error {
        MeshError::TooLarge(_) => too_large(),
        error => malformed(format!("the buffer `{}` {error}", path.display())),
    })
}
