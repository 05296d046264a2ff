//! Bytes that are read from anywhere.

use crate::recording::RecordingError;
use std::io::{Read, Seek, SeekFrom};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What a recording is read from: a file, or bytes in memory.
pub trait Input: Read + Seek + Send {}
impl<T: Read + Seek + Send> Input for T {}

/// A recording's bytes. Several readers share it: each read says where.
pub struct Source {
    input: Mutex<Box<dyn Input>>,
    length: u64,
}

impl Source {
    /// All of `input`.
    ///
    /// # Errors
    /// When its length cannot be found.
    pub fn new(mut input: impl Input + 'static) -> Result<Self, RecordingError> {
        let length = input.seek(SeekFrom::End(0)).map_err(RecordingError::Read)?;
        Ok(Self { input: Mutex::new(Box::new(input)), length })
    }

    /// Bytes in it.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// The input itself, for reading on from where it stands. A reader that panicked left nothing half done behind.
    pub fn lock(&self) -> MutexGuard<'_, Box<dyn Input>> {
        self.input.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads `length` bytes from `offset` into `into`, which is emptied before.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read_at(&self, offset: u64, length: usize, into: &mut Vec<u8>) -> Result<(), RecordingError> {
        into.resize(length, 0);
        let mut input = self.lock();
        input.seek(SeekFrom::Start(offset)).map_err(RecordingError::Read)?;
        input.read_exact(into).map_err(RecordingError::Read)
    }
}
