use super::header::{self, PlyFormat, Property};
use crate::{CloudPoint, RecordingError};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use zsim_base::time::{Span, Stamp};

/// Reads the points of a cloud sequentially.
pub struct PlyReader<R: Read> {
    name: String,
    input: BufReader<R>,
    format: PlyFormat,
    columns: Columns,
    properties: Vec<Property>,
    remaining: u64,
    line: usize,
    row: Vec<f64>,
}

/// Indices of a point's properties in a row.
struct Columns {
    position: [usize; 3],
    intensity: Option<usize>,
    time: Option<usize>,
    error: Option<usize>,
}

impl PlyReader<File> {
    /// Opens the point cloud at `path`.
    ///
    /// # Errors
    /// When it cannot be opened, or the header is not that of a point cloud.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = File::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(&path.display().to_string(), file)
    }
}

impl<R: Read> PlyReader<R> {
    /// Opens the point cloud in `input`, called `name` in messages.
    ///
    /// Points are the element `vertex` with properties x, y, z and optionally intensity, time and error; others are
    /// ignored.
    ///
    /// # Errors
    /// When the header is not that of a point cloud.
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
            format: header.format,
            columns,
            properties: header.properties,
            remaining: header.count,
            line: header.lines,
            row: Vec::new(),
        })
    }

    /// Number of points not yet read, according to the header.
    pub fn remaining(&self) -> u64 {
        self.remaining
    }

    fn next_point(&mut self) -> Result<CloudPoint, String> {
        match self.format {
            PlyFormat::Ascii => self.read_line()?,
            PlyFormat::LittleEndian => self.read_binary(false)?,
            PlyFormat::BigEndian => self.read_binary(true)?,
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
            self.input.read_exact(bytes).map_err(|_| format!("the file ends {} points early", self.remaining))?;
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
        let read = (&mut self.input).take(header::MAX_LINE_BYTES).read_until(b'\n', &mut text);
        if read.map_err(|error| error.to_string())? == 0 {
            return Err(format!("the file ends {} points early", self.remaining));
        }
        let text = std::str::from_utf8(&text).map_err(|_| "this is not text".to_owned())?;
        for word in text.split_whitespace() {
            self.row.push(word.parse().map_err(|_| format!("`{word}` is not a number"))?);
        }
        if self.row.len() < self.properties.len() {
            return Err(format!(
                "a point needs {} numbers, but the line has {}",
                self.properties.len(),
                self.row.len()
            ));
        }
        Ok(())
    }
}

impl<R: Read> Iterator for PlyReader<R> {
    type Item = Result<CloudPoint, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.remaining == 0 {
            return None;
        }
        self.line += 1;
        let point = self.next_point();
        self.remaining = if point.is_ok() { self.remaining - 1 } else { 0 };
        let (name, line) = (&self.name, self.line);
        Some(point.map_err(|problem| RecordingError::Line { name: name.clone(), line, problem }))
    }
}
