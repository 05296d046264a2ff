use crate::recording::{CloudPoint, RecordingError};
use crate::time::Stamp;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// Bytes of a point as it is written.
const POINT_BYTES: usize = 4 * 4 + 8 + 4;

/// The header up to the number of points, which is written when it is known.
const BEFORE_COUNT: &str = "ply\nformat binary_little_endian 1.0\ncomment metres, seconds; error: standard deviation of the place, metres\nelement vertex ";

/// Digits that are kept free for the number of points.
const COUNT_DIGITS: usize = 20;

/// The header after the number of points.
const AFTER_COUNT: &str = "\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\nproperty double time\nproperty float error\nend_header\n";

/// Writes points as they come; their number is put into the header at the end.
pub struct PlyWriter<W: Write + Seek> {
    out: BufWriter<W>,
    count: u64,
}

impl PlyWriter<File> {
    /// Begins a new file at `path`; one that is there is replaced.
    ///
    /// # Errors
    /// When it cannot be made or written.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let file = File::create(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(file)
    }
}

impl<W: Write + Seek> PlyWriter<W> {
    /// Begins to write at the start of `out`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(out: W) -> Result<Self, RecordingError> {
        let mut out = BufWriter::with_capacity(1 << 16, out);
        write!(out, "{BEFORE_COUNT}{:<COUNT_DIGITS$}{AFTER_COUNT}", 0).map_err(RecordingError::Write)?;
        Ok(Self { out, count: 0 })
    }

    /// Writes a point.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn point(&mut self, point: &CloudPoint) -> Result<(), RecordingError> {
        let p = &point.point_in_map;
        let mut bytes = [0; POINT_BYTES];
        for (word, value) in bytes.chunks_exact_mut(4).zip([p.x, p.y, p.z, point.intensity]) {
            word.copy_from_slice(&value.to_le_bytes());
        }
        let time_s = point.stamp.seconds_since(Stamp::from_nanos(0));
        bytes[16..24].copy_from_slice(&time_s.to_le_bytes());
        bytes[24..].copy_from_slice(&point.error_m.to_le_bytes());
        self.count += 1;
        self.out.write_all(&bytes).map_err(RecordingError::Write)
    }

    /// Writes what is left, and the number of points.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.out.seek(SeekFrom::Start(BEFORE_COUNT.len() as u64)).map_err(RecordingError::Write)?;
        write!(self.out, "{:<COUNT_DIGITS$}", self.count).map_err(RecordingError::Write)?;
        self.out.flush().map_err(RecordingError::Write)
    }
}
