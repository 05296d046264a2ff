use crate::{CloudPoint, RecordingError};
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use zsim_base::files;
use zsim_base::time::Stamp;

/// Size of a written point, bytes.
const POINT_BYTES: usize = 4 * 4 + 8 + 4;

/// Header before the number of points, which is filled in at the end.
const HEADER_BEFORE_COUNT: &str = "ply\nformat binary_little_endian 1.0\ncomment metres, seconds; error: standard deviation of the place, metres\nelement vertex ";

/// Digits reserved for the number of points.
const COUNT_DIGITS: usize = 20;

/// Header after the number of points.
const HEADER_AFTER_COUNT: &str = "\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\nproperty double time\nproperty float error\nend_header\n";

/// Writes points sequentially; their number is filled into the header at the end.
pub struct PlyWriter<W: Write + Seek> {
    out: BufWriter<W>,
    count: u64,
}

impl PlyWriter<File> {
    /// Creates the file at `path`, replacing an existing one.
    ///
    /// # Errors
    /// When it cannot be created or written.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let file = files::create(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(file)
    }
}

impl<W: Write + Seek> PlyWriter<W> {
    /// Starts to write at the start of `out`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(out: W) -> Result<Self, RecordingError> {
        let mut out = BufWriter::with_capacity(1 << 16, out);
        write!(out, "{HEADER_BEFORE_COUNT}{:<COUNT_DIGITS$}{HEADER_AFTER_COUNT}", 0).map_err(RecordingError::Write)?;
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

    /// Flushes the points and writes their number.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.out.seek(SeekFrom::Start(HEADER_BEFORE_COUNT.len() as u64)).map_err(RecordingError::Write)?;
        write!(self.out, "{:<COUNT_DIGITS$}", self.count).map_err(RecordingError::Write)?;
        self.out.flush().map_err(RecordingError::Write)
    }
}
