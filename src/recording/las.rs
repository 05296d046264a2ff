//! Clouds as LAS 1.4, for surveyors: point format 6 (ASPRS LAS specification 1.4 R15), and the error in extra bytes.

use crate::recording::{CloudPoint, RecordingError};
use crate::time::Stamp;
use las::point::Format;
use las::{Builder, Point, Transform, Vector, Vlr};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::{Arc, OnceLock};

/// Coordinates are whole multiples of this, m.
const SCALE_M: f64 = 1e-4;
/// Greatest coordinate that fits then, m.
const FARTHEST_M: f64 = 214_000.0;
/// Who defines the records that say what is in the file.
const SPECIFIED_BY: &str = "LASF_Spec";
/// Record of a text about the file.
const TEXT_RECORD: u16 = 3;
/// Record of what extra bytes are.
const EXTRA_BYTES_RECORD: u16 = 4;
/// What the columns are; LAS knows no other clock than that of GPS.
const ABOUT: &str = "metres in the map; gps_time is seconds on the lidar's clock; intensity in the sensor's unit, rounded; \
                     error (extra bytes) is the standard deviation of the point's place, metres";

/// Writes points as they come: x, y, z to a tenth of a millimetre, intensity rounded to a whole number from 0 to 65535,
/// the lidar's time in seconds as GPS time, and `error` in metres as an extra dimension.
pub struct LasWriter<W: Write + Seek + Send + Sync + 'static> {
    writer: las::Writer<Patient<BufWriter<W>>>,
    failure: Arc<OnceLock<io::Error>>,
}

impl<W: Write + Seek + Send + Sync + 'static> LasWriter<W> {
    /// Begins to write at the start of `out`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(out: W) -> Result<Self, RecordingError> {
        let failure = Arc::new(OnceLock::new());
        let out = Patient { out: BufWriter::with_capacity(1 << 16, out), failure: failure.clone() };
        let writer = header().and_then(|header| las::Writer::new(out, header)).map_err(unwritten)?;
        let begun = Self { writer, failure };
        begun.check()?;
        Ok(begun)
    }

    /// Writes a point.
    ///
    /// # Errors
    /// When it cannot be written, or is farther from the origin than the format goes.
    pub fn point(&mut self, point: &CloudPoint) -> Result<(), RecordingError> {
        let p = point.point_in_map.cast::<f64>();
        if let Some(far) = p.iter().find(|x| x.is_nan() || x.abs() > FARTHEST_M) {
            return Err(RecordingError::Unwritable {
                what: "a coordinate of a point",
                value: format!("{far} m"),
                limit: "LAS files of ours hold up to 214 km; write PLY instead",
            });
        }
        let row = Point {
            x: p.x,
            y: p.y,
            z: p.z,
            // What is outside is put at the end, what is no number at 0.
            intensity: point.intensity.round() as u16,
            return_number: 1,
            number_of_returns: 1,
            gps_time: Some(point.stamp.seconds_since(Stamp::from_nanos(0))),
            extra_bytes: point.error_m.to_le_bytes().to_vec(),
            ..Point::default()
        };
        self.writer.write_point(row).map_err(unwritten)?;
        self.check()
    }

    /// Writes what is left, and into the header what is known at the end.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.writer.close().map_err(unwritten)?;
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
    let axis = || Transform { scale: SCALE_M, offset: 0.0 };
    builder.transforms = Vector { x: axis(), y: axis(), z: axis() };
    builder.generating_software = concat!("zsim ", env!("CARGO_PKG_VERSION")).to_owned();
    builder.system_identifier = "OTHER".to_owned();
    let record = |record_id: u16, description: &str, data: Vec<u8>| Vlr {
        user_id: SPECIFIED_BY.to_owned(),
        record_id,
        description: description.to_owned(),
        data,
    };
    builder.vlrs = vec![
        record(TEXT_RECORD, "what the columns are", [ABOUT.as_bytes(), &[0]].concat()),
        record(EXTRA_BYTES_RECORD, "error", extra_bytes()),
    ];
    builder.into_header()
}

/// What the extra bytes of a point are (table 24 and 25 of the specification): one float, `error`.
fn extra_bytes() -> Vec<u8> {
    const FLOAT: u8 = 9;
    let mut record = vec![0; 192];
    record[2] = FLOAT;
    record[4..9].copy_from_slice(b"error");
    let description = b"std. dev. of the place, m";
    record[160..160 + description.len()].copy_from_slice(description);
    record
}

fn unwritten(error: las::Error) -> RecordingError {
    RecordingError::Write(match error {
        las::Error::Io(error) => error,
        other => io::Error::other(other),
    })
}

/// Keeps a failure for whoever asks, and says that all is well: a writer of the `las` crate that is dropped unfinished
/// writes its header, and panics where it cannot.
struct Patient<W> {
    out: W,
    failure: Arc<OnceLock<io::Error>>,
}

impl<W> Patient<W> {
    fn keep<T>(&mut self, done: impl FnOnce(&mut W) -> io::Result<T>, otherwise: T) -> io::Result<T> {
        if self.failure.get().is_some() {
            return Ok(otherwise);
        }
        Ok(done(&mut self.out).unwrap_or_else(|error| {
            let _ = self.failure.set(error);
            otherwise
        }))
    }
}

impl<W: Write> Write for Patient<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.keep(|out| out.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.keep(Write::flush, ())
    }
}

impl<W: Seek> Seek for Patient<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.keep(|out| out.seek(to), 0)
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

    /// Bytes in memory that outlive their writer, up to a limit.
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
    fn a_cloud_comes_back_to_a_tenth_of_a_millimetre_with_time_intensity_and_error() {
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
    fn a_full_disk_is_an_error_and_no_panic() {
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
    fn a_point_farther_than_the_format_goes_is_refused() {
        let mut writer = LasWriter::new(file(usize::MAX)).unwrap();
        let far = CloudPoint { point_in_map: nalgebra::Vector3::new(0.0, 3e5, 0.0), ..point(1) };
        let said = writer.point(&far).unwrap_err().to_string();
        assert!(said.contains("300000 m") && said.contains("PLY"), "{said}");
    }
}
