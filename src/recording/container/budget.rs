//! Limits what reading a recording may use, whatever sizes its files declare.

use crate::RecordingError;

/// Maximum memory of a recording's index: names of topics and types, blocks, manifest; bytes.
const MAX_INDEX_BYTES: u64 = 128 << 20;

/// Maximum number of topics, types and blocks of a recording.
const MAX_ITEMS: u64 = 4 << 20;

/// Maximum length of the name of a topic, a type or an encoding, bytes. Names in ROS have at most 255.
const MAX_NAME_BYTES: usize = 4096;

/// Bytes that any recording may decompress to: constant images of a simulator compress to almost nothing.
const MIN_DECOMPRESSED_BYTES: u64 = 4 << 30;

/// Maximum ratio of the decompressed size to the files' size, beyond [`MIN_DECOMPRESSED_BYTES`].
const MAX_RATIO: u64 = 256;

/// What indexing a recording, or one pass through its messages, may still use.
///
/// Each use is subtracted before the memory is allocated.
#[derive(Debug)]
pub struct Budget {
    /// Name of the current file, for messages.
    name: String,
    decompressed_bytes: u64,
    index_bytes: u64,
    items: u64,
}

impl Budget {
    /// Creates the budget of a recording of files with `length` bytes in total.
    pub fn new(name: &str, length: u64) -> Self {
        let mut budget = Self {
            name: String::new(),
            decompressed_bytes: MIN_DECOMPRESSED_BYTES,
            index_bytes: MAX_INDEX_BYTES,
            items: MAX_ITEMS,
        };
        budget.add_file(name, length);
        budget
    }

    /// Adds a file of `length` bytes, which is the next one to be read.
    pub fn add_file(&mut self, name: &str, length: u64) {
        name.clone_into(&mut self.name);
        self.decompressed_bytes = self.decompressed_bytes.saturating_add(length.saturating_mul(MAX_RATIO));
    }

    /// Name of the current file, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Takes `bytes` of decompressed data.
    ///
    /// # Errors
    /// When the recording decompresses to more than its files plausibly contain.
    pub fn decompress(&mut self, bytes: u64) -> Result<(), RecordingError> {
        let rest = self.decompressed_bytes.checked_sub(bytes);
        self.decompressed_bytes = rest.ok_or_else(|| {
            let limit = format!("4 GiB and {MAX_RATIO} times its size");
            self.exceeded("the decompressed size", limit)
        })?;
        Ok(())
    }

    /// Takes an item of the index with `bytes`.
    ///
    /// # Errors
    /// When the index has too many items or bytes.
    pub fn item(&mut self, bytes: usize) -> Result<(), RecordingError> {
        let items = self.items.checked_sub(1);
        self.items =
            items.ok_or_else(|| self.exceeded("the number of topics, types and chunks", format!("{MAX_ITEMS}")))?;
        let rest = self.index_bytes.checked_sub(bytes as u64);
        self.index_bytes = rest.ok_or_else(|| {
            self.exceeded("the size of names, chunk index and manifest", format!("{} MiB", MAX_INDEX_BYTES >> 20))
        })?;
        Ok(())
    }

    /// Copies the `name` of a topic, a type or an encoding.
    ///
    /// # Errors
    /// When it is too long, or the index has too many items or bytes.
    pub fn copy_name(&mut self, name: &str) -> Result<String, RecordingError> {
        if name.len() > MAX_NAME_BYTES {
            let quantity = format!("the name of a topic or type, of {} bytes,", name.len());
            return Err(self.exceeded(&quantity, format!("{MAX_NAME_BYTES} bytes")));
        }
        self.item(name.len() + size_of::<String>())?;
        Ok(name.to_owned())
    }

    fn exceeded(&self, quantity: &str, limit: String) -> RecordingError {
        RecordingError::Limit { name: self.name.clone(), quantity: quantity.to_owned(), limit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_quantity_has_a_limit() {
        let mut budget = Budget::new("a.mcap", 1000);
        assert!(budget.decompress(MIN_DECOMPRESSED_BYTES + 256_000).is_ok());
        let error = budget.decompress(1).unwrap_err().to_string();
        assert!(error.starts_with("a.mcap: the decompressed size exceeds 4 GiB and 256 times its size; "), "{error}");
        assert!(budget.item(MAX_INDEX_BYTES as usize).is_ok());
        let error = budget.item(1).unwrap_err().to_string();
        assert!(error.contains("the size of names, chunk index and manifest exceeds 128 MiB"), "{error}");
        let mut budget = Budget::new("a.mcap", 0);
        assert!((0..MAX_ITEMS).all(|_| budget.item(0).is_ok()));
        let error = budget.item(0).unwrap_err().to_string();
        assert!(error.contains("the number of topics, types and chunks exceeds 4194304"), "{error}");
    }

    #[test]
    fn the_limits_are_documented() {
        let page = include_str!("../../../docs/reference/limits.md");
        let ratio = format!("4 GiB and {MAX_RATIO} times its size");
        assert_eq!(MIN_DECOMPRESSED_BYTES, 4 << 30);
        for limit in
            [format!("{MAX_ITEMS}"), format!("{} MiB", MAX_INDEX_BYTES >> 20), format!("{MAX_NAME_BYTES} bytes"), ratio]
        {
            assert!(page.contains(&format!("| {limit} |")), "{limit}");
        }
    }

    #[test]
    fn a_long_name_is_not_copied() {
        let mut budget = Budget::new("a.mcap", 0);
        assert_eq!(budget.copy_name("/scan").unwrap(), "/scan");
        let error = budget.copy_name(&"n".repeat(5000)).unwrap_err().to_string();
        assert!(error.contains("the name of a topic or type, of 5000 bytes, exceeds 4096 bytes"), "{error}");
    }
}
