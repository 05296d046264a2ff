//! Clouds as PLY: written as binary little-endian, read in each of the format's three forms.
//!
//! PLY is a text header that names elements and their properties, then the elements, one after the other (Turk 1994).

mod header;

use crate::recording::{CloudPoint, RecordingError};
use crate::time::{Span, Stamp};
use header::{Form, Property};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Bytes of a point as it is written.
const POINT_BYTES: usize = 4 * 4 + 8 + 4;

/// The header up to the number of points, which is written when it is known.
const BEFORE_COUNT: &str = "ply\nformat binary_little_endian 1.0\ncomment metres, seconds; error: metres from the true surface\nelement vertex ";

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

/// Reads the points of a cloud, one after the other.
pub struct PlyReader<R: Read> {
    name: String,
    input: BufReader<R>,
    form: Form,
    columns: Columns,
    properties: Vec<Property>,
    left: u64,
    line: usize,
    row: Vec<f64>,
}

/// Where in a row the numbers of a point are.
struct Columns {
    position: [usize; 3],
    intensity: Option<usize>,
    time: Option<usize>,
    error: Option<usize>,
}

impl PlyReader<File> {
    /// Opens the cloud at `path`.
    ///
    /// # Errors
    /// When it cannot be opened, or its header is not that of a cloud.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = File::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(&path.display().to_string(), file)
    }
}

impl<R: Read> PlyReader<R> {
    /// Opens the cloud in `input`, which messages call `name`. Its points are the element `vertex`, with properties x, y,
    /// z, and as they are there intensity, time and error; others are passed over.
    ///
    /// # Errors
    /// When the header is not that of a cloud.
    pub fn new(name: &str, input: R) -> Result<Self, RecordingError> {
        let mut input = BufReader::with_capacity(1 << 16, input);
        let header = header::read(&mut input).map_err(|(line, problem)| RecordingError::Line {
            name: name.to_owned(),
            line,
            problem,
        })?;
        let find = |names: &[&str]| {
            names.iter().find_map(|name| header.properties.iter().position(|p| p.name.eq_ignore_ascii_case(name)))
        };
        let (Some(x), Some(y), Some(z)) = (find(&["x"]), find(&["y"]), find(&["z"])) else {
            let problem = "the points have no properties x, y and z".to_owned();
            return Err(RecordingError::Line { name: name.to_owned(), line: header.lines, problem });
        };
        let columns = Columns {
            position: [x, y, z],
            intensity: find(&["intensity", "scalar_intensity", "reflectance"]),
            time: find(&["time", "gps_time", "timestamp", "scalar_gpstime"]),
            error: find(&["error"]),
        };
        Ok(Self {
            name: name.to_owned(),
            input,
            form: header.form,
            columns,
            properties: header.properties,
            left: header.count,
            line: header.lines,
            row: Vec::new(),
        })
    }

    /// Points still to come, as the header has it.
    pub fn left(&self) -> u64 {
        self.left
    }

    fn next_point(&mut self) -> Result<CloudPoint, String> {
        match self.form {
            Form::Ascii => self.read_line()?,
            Form::LittleEndian => self.read_binary(false)?,
            Form::BigEndian => self.read_binary(true)?,
        }
        let number = |column: Option<usize>| column.and_then(|column| self.row.get(column).copied());
        let [x, y, z] = self.columns.position.map(|column| number(Some(column)).unwrap_or(f64::NAN) as f32);
        let point_in_map = nalgebra::Vector3::new(x, y, z);
        if !point_in_map.iter().all(|c| c.is_finite()) {
            return Err("the point is not finite".to_owned());
        }
        Ok(CloudPoint {
            point_in_map,
            intensity: number(self.columns.intensity).unwrap_or(0.0) as f32,
            stamp: Stamp::from_nanos(0) + Span::from_seconds(number(self.columns.time).unwrap_or(0.0)),
            error_m: number(self.columns.error).unwrap_or(f64::NAN) as f32,
        })
    }

    fn read_binary(&mut self, big_endian: bool) -> Result<(), String> {
        self.row.clear();
        for property in &self.properties {
            let mut word = [0; 8];
            let bytes = &mut word[..property.scalar.size()];
            self.input.read_exact(bytes).map_err(|_| format!("the file ends {} points early", self.left))?;
            if big_endian {
                bytes.reverse();
            }
            self.row.push(property.scalar.number(word));
        }
        Ok(())
    }

    fn read_line(&mut self) -> Result<(), String> {
        self.row.clear();
        let mut text = Vec::new();
        let read = (&mut self.input).take(header::LONGEST_LINE).read_until(b'\n', &mut text);
        if read.map_err(|error| error.to_string())? == 0 {
            return Err(format!("the file ends {} points early", self.left));
        }
        let text = std::str::from_utf8(&text).map_err(|_| "this is not text".to_owned())?;
        for word in text.split_whitespace() {
            self.row.push(word.parse().map_err(|_| format!("`{word}` is no number"))?);
        }
        if self.row.len() < self.properties.len() {
            return Err(format!("a point has {} numbers; here are {}", self.properties.len(), self.row.len()));
        }
        Ok(())
    }
}

impl<R: Read> Iterator for PlyReader<R> {
    type Item = Result<CloudPoint, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.left == 0 {
            return None;
        }
        self.line += 1;
        let point = self.next_point();
        self.left = if point.is_ok() { self.left - 1 } else { 0 };
        let (name, line) = (&self.name, self.line);
        Some(point.map_err(|problem| RecordingError::Line { name: name.clone(), line, problem }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn point(k: i64) -> CloudPoint {
        CloudPoint {
            point_in_map: nalgebra::Vector3::new(k as f32, -0.1 * k as f32, 1e-3),
            intensity: 7.0 * k as f32,
            stamp: Stamp::from_nanos(k * 500_000_000),
            error_m: 0.01,
        }
    }

    fn read(bytes: &[u8]) -> Result<Vec<CloudPoint>, String> {
        let points = PlyReader::new("a.ply", bytes).map_err(|error| error.to_string())?;
        points.collect::<Result<_, _>>().map_err(|error| error.to_string())
    }

    fn written(count: i64) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = PlyWriter::new(&mut bytes).unwrap();
        (0..count).for_each(|k| writer.point(&point(k)).unwrap());
        writer.finish().unwrap();
        bytes.into_inner()
    }

    #[test]
    fn a_cloud_comes_back_bit_for_bit() {
        assert_eq!(read(&written(1000)).unwrap(), (0..1000).map(point).collect::<Vec<_>>());
        assert_eq!(read(&written(0)).unwrap(), []);
    }

    #[test]
    fn another_reader_of_ply_finds_the_points() {
        let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
        let ply = parser.read_ply(&mut written(3).as_slice()).unwrap();
        let vertices = &ply.payload["vertex"];
        assert_eq!(vertices.len(), 3);
        assert_eq!(format!("{:?}", vertices[2]["x"]), "Float(2.0)");
        assert_eq!(format!("{:?}", vertices[2]["time"]), "Double(1.0)");
    }

    #[test]
    fn text_and_big_endian_clouds_are_read() {
        let header = |form: &str| {
            format!(
                "ply\nformat {form} 1.0\nobj_info by another\nelement vertex 2\nproperty double x\nproperty float y\n\
                 property uchar red\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            )
        };
        let text = header("ascii") + "1.5 2 255 3\n4 5 0 6\n3 0 1 1\n";
        let mut bytes = header("binary_big_endian").into_bytes();
        for (x, y, red, z) in [(1.5_f64, 2_f32, 255_u8, 3_f32), (4.0, 5.0, 0, 6.0)] {
            bytes.extend([&x.to_be_bytes()[..], &y.to_be_bytes(), &[red], &z.to_be_bytes()].concat());
        }
        for file in [text.as_bytes(), &bytes] {
            let points: Vec<_> = read(file).unwrap().into_iter().map(|point| point.point_in_map).collect();
            assert_eq!(points, [nalgebra::Vector3::new(1.5, 2.0, 3.0), nalgebra::Vector3::new(4.0, 5.0, 6.0)]);
        }
    }

    #[test]
    fn an_error_names_file_and_line() {
        let start = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n";
        let message = |text: String| read(text.as_bytes()).unwrap_err();
        assert_eq!(message("solid\n".into()), "a.ply:1: this is not a PLY file: it does not begin with `ply`");
        assert_eq!(message(format!("{start}end_header\n")), "a.ply:6: the points have no properties x, y and z");
        assert_eq!(message(start.to_owned()), "a.ply:6: the header does not end");
        let start = format!("{start}property float z\nend_header\n");
        assert_eq!(message(format!("{start}1 2 3\n")), "a.ply:9: the file ends 1 points early");
        assert_eq!(message(format!("{start}1 2\n")), "a.ply:8: a point has 3 numbers; here are 2");
        assert_eq!(message(format!("{start}1 2 nan\n")), "a.ply:8: the point is not finite");
        let short = &written(2)[..];
        assert!(read(&short[..short.len() - 1]).unwrap_err().ends_with("the file ends 1 points early"));
    }
}
