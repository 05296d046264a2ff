//! Point clouds as LAS 1.4 for surveying.
//!
//! Point format 6 (ASPRS LAS specification 1.4 R15), with the error in extra bytes.

use crate::{CloudPoint, RecordingError};
use las::point::Format;
use las::{Builder, Point, Transform, Vector, Vlr};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::{Arc, OnceLock};
use zsim_base::time::Stamp;

/// Resolution of the coordinates, m.
const RESOLUTION_M: f64 = 1e-4;
/// Maximum coordinate at this resolution, m: below 2^31 times the resolution.
const MAX_COORDINATE_M: f64 = 214_000.0;
/// User id of records defined by the LAS specification.
const USER_ID: &str = "LASF_Spec";
/// Record id of a text description.
const TEXT_RECORD: u16 = 3;
/// Record id of the extra bytes' description.
const EXTRA_BYTES_RECORD: u16 = 4;
/// Description of the columns; LAS has no other time than GPS time.
const DESCRIPTION: &str = "metres in the map; gps_time is seconds on the lidar's clock; intensity in the sensor's unit, rounded; \
                     error (extra bytes) is the standard deviation of the point's place, metres";

/// Writes points sequentially.
///
/// x, y, z to 0.1 mm, intensity rounded to an integer from 0 to 65535, the lidar's time in seconds as GPS time, and
/// `error` in metres as an extra dimension.
pub struct LasWriter<W: Write + Seek + Send + Sync + 'static> {
    writer: las::Writer<DeferredErrors<BufWriter<W>>>,
    failure: Arc<OnceLock<io::Error>>,
}

impl<W: Write + Seek + Send + Sync + 'static> LasWriter<W> {
    /// Starts to write at the start of `out`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(out: W) -> Result<Self, RecordingError> {
        let failure = Arc::new(OnceLock::new());
        let out = DeferredErrors { out: BufWriter::with_capacity(1 << 16, out), failure: failure.clone() };
        let writer = header().and_then(|header| las::Writer::new(out, header)).map_err(write_error)?;
        let started = Self { writer, failure };
        started.check()?;
        Ok(started)
    }

    /// Writes a point.
    ///
    /// # Errors
    /// When it cannot be written, or a coordinate exceeds the range of the format.
    pub fn point(&mut self, point: &CloudPoint) -> Result<(), RecordingError> {
        let p = point.point_in_map.cast::<f64>();
        if let Some(outside) = p.iter().find(|x| x.is_nan() || x.abs() > MAX_COORDINATE_M) {
            return Err(RecordingError::Unwritable {
                what: "a coordinate of a point",
                value: format!("{outside} m"),
                limit: "the LAS output is limited to 214 km; write PLY instead",
            });
        }
        let row = Point {
            x: p.x,
            y: p.y,
            z: p.z,
            // The conversion saturates; NaN becomes 0.
            intensity: point.intensity.round() as u16,
            return_number: 1,
            number_of_returns: 1,
            gps_time: Some(point.stamp.seconds_since(Stamp::from_nanos(0))),
            extra_bytes: point.error_m.to_le_bytes().to_vec(),
            ..Point::default()
        };
        self.writer.write_point(row).map_err(write_error)?;
        self.check()
    }

    /// Flushes the points and completes the header.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.writer.close().map_err(write_error)?;
        self.check()
    }

    fn check(&self) -> Result<(), RecordingError> {
        let failed = |error: &io::Error| RecordingError::Write(io::Error::new(error.kind(), error.to_string()));
        self.failure.get().map_or(Ok(()), |error| Err(failed(error)))
    }
}

fn header() -> las::Result<las::Header> {
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format { extra_bytes: 4, ..Format::new(6)? };
    let axis = || Transform { scale: RESOLUTION_M, offset: 0.0 };
    builder.transforms = Vector { x: axis(), y: axis(), z: axis() };
    builder.generating_software = concat!("zsim ", env!("CARGO_PKG_VERSION")).to_owned();
    builder.system_identifier = "OTHER".to_owned();
    let record = |record_id: u16, description: &str, data: Vec<u8>| Vlr {
        user_id: USER_ID.to_owned(),
        record_id,
        description: description.to_owned(),
        data,
    };
    builder.vlrs = vec![
        record(TEXT_RECORD, "what the columns are", [DESCRIPTION.as_bytes(), &[0]].concat()),
        record(EXTRA_BYTES_RECORD, "error", extra_bytes()),
    ];
    builder.into_header()
}

/// Extra bytes record (tables 24 and 25 of the specification): one float, `error`.
fn extra_bytes() -> Vec<u8> {
    const FLOAT: u8 = 9;
    let mut record = vec![0; 192];
    record[2] = FLOAT;
    record[4..9].copy_from_slice(b"error");
    let description = b"std. dev. of the place, m";
    record[160..160 + description.len()].copy_from_slice(description);
    record
}

fn write_error(error: las::Error) -> RecordingError {
    RecordingError::Write(match error {
        las::Error::Io(error) => error,
        other => io::Error::other(other),
    })
}

/// Stores the first I/O error and reports success.
///
/// A `las` writer that is dropped unfinished writes its header, and panics if that fails.
struct DeferredErrors<W> {
    out: W,
    failure: Arc<OnceLock<io::Error>>,
}

impl<W> DeferredErrors<W> {
    fn defer_error<T>(&mut self, done: impl FnOnce(&mut W) -> io::Result<T>, otherwise: T) -> io::Result<T> {
        if self.failure.get().is_some() {
            return Ok(otherwise);
        }
        Ok(done(&mut self.out).unwrap_or_else(|error| {
            let _ = self.failure.set(error);
            otherwise
        }))
    }
}

impl<W: Write> Write for DeferredErrors<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.defer_error(|out| out.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.defer_error(Write::flush, ())
    }
}

impl<W: Seek> Seek for DeferredErrors<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.defer_error(|out| out.seek(to), 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn point(k: i64) -> CloudPoint {
        CloudPoint {
            point_in_map: nalgebra::Vector3::new(k as f32, -0.5 * k as f32, 0.25),
            intensity: 7.4 * k as f32,
            stamp: Stamp::from_nanos(k * 500_000_000),
            error_m: 0.01 * k as f32,
        }
    }

    /// Shared memory buffer of limited size.
    #[derive(Clone)]
    struct Limited(Arc<std::sync::Mutex<Cursor<Vec<u8>>>>, usize);

    impl Write for Limited {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let mut file = self.0.lock().unwrap();
            if file.position() as usize + bytes.len() > self.1 {
                return Err(io::Error::new(io::ErrorKind::StorageFull, "no space left"));
            }
            file.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Limited {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.0.lock().unwrap().seek(to)
        }
    }

    fn file(limit: usize) -> Limited {
        Limited(Arc::default(), limit)
    }

    #[test]
    fn a_written_cloud_is_read_to_a_tenth_of_a_millimetre_with_time_intensity_and_error() {
        let out = file(usize::MAX);
        let mut writer = LasWriter::new(out.clone()).unwrap();
        (0..1000).for_each(|k| writer.point(&point(k)).unwrap());
        writer.finish().unwrap();
        let bytes = out.0.lock().unwrap().get_ref().clone();
        let mut reader = las::Reader::new(Cursor::new(bytes)).unwrap();
        assert_eq!(reader.header().number_of_points(), 1000);
        assert_eq!(reader.header().bounds().max.x, 999.0);
        for (k, read) in reader.read_all().unwrap().points().enumerate() {
            let (read, expected) = (read.unwrap(), point(k as i64));
            let p = expected.point_in_map.cast::<f64>();
            assert!((read.x - p.x).abs().max((read.y - p.y).abs()).max((read.z - p.z).abs()) < 5.1e-5);
            assert_eq!(read.gps_time, Some(0.5 * k as f64));
            assert_eq!(read.intensity, expected.intensity.round() as u16);
            assert_eq!(read.extra_bytes, expected.error_m.to_le_bytes());
        }
    }

    #[test]
    fn a_full_disk_is_an_error_and_not_a_panic() {
        for limit in [0, 100, 5000, 70_000] {
            let write = || -> Result<(), RecordingError> {
                let mut writer = LasWriter::new(file(limit))?;
                for k in 0..5000 {
                    writer.point(&point(k))?;
                }
                writer.finish()
            };
            assert!(matches!(write(), Err(RecordingError::Write(_))), "{limit} bytes");
        }
    }

    #[test]
    fn a_point_outside_the_range_of_the_format_is_rejected() {
        let mut writer = LasWriter::new(file(usize::MAX)).unwrap();
        let outside = CloudPoint { point_in_map: nalgebra::Vector3::new(0.0, 3e5, 0.0), ..point(1) };
        let message = writer.point(&outside).unwrap_err().to_string();
        assert!(message.contains("300000 m") && message.contains("PLY"), "{message}");
    }
}
