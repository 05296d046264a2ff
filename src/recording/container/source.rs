//! Random access to the bytes of a file.

use crate::RecordingError;
use std::io::{Read, Seek, SeekFrom};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Input of a recording: a file, or bytes in memory.
pub trait Input: Read + Seek + Send {}
impl<T: Read + Seek + Send> Input for T {}

/// Bytes of a recording, shared by several readers: each read specifies an offset.
pub struct Source {
    input: Mutex<Box<dyn Input>>,
    length: u64,
}

impl Source {
    /// Uses all of `input`.
    ///
    /// # Errors
    /// When the length cannot be determined.
    pub fn new(mut input: impl Input + 'static) -> Result<Self, RecordingError> {
        let length = input.seek(SeekFrom::End(0)).map_err(RecordingError::Read)?;
        Ok(Self { input: Mutex::new(Box::new(input)), length })
    }

    /// Length, bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Locks the input for sequential reading. A reader that panicked leaves no inconsistent state.
    pub fn lock(&self) -> MutexGuard<'_, Box<dyn Input>> {
        self.input.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces the content of `into` by `length` bytes from `offset`.
    ///
    /// # Errors
    /// When the bytes cannot be read.
    pub fn read_at(&self, offset: u64, length: usize, into: &mut Vec<u8>) -> Result<(), RecordingError> {
        into.resize(length, 0);
        let mut input = self.lock();
        input.seek(SeekFrom::Start(offset)).map_err(RecordingError::Read)?;
        input.read_exact(into).map_err(RecordingError::Read)
    }
}
