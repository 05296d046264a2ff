//! Binary arrays as text in base64 (RFC 4648).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Little-endian single-precision numbers in base64.
pub(super) fn base64_f32(values: impl Iterator<Item = f64>) -> String {
    base64_bytes(&values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>())
}

/// Bytes in base64.
pub(super) fn base64_bytes(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}
