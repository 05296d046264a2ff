use crate::{CloudPoint, RecordingError};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use zsim_base::files;
use zsim_base::ply::{self, Element, Failure, PlyFormat, Row};
use zsim_base::time::{Span, Stamp};

/// Reads the points of a cloud sequentially.
pub struct PlyReader<R: Read> {
    name: String,
    file: ply::PlyReader<R>,
    points: Element,
    columns: Columns,
    remaining: u64,
    row: Row,
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
        let file = files::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
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
        let wrong = |(line, problem)| RecordingError::Line { name: name.to_owned(), line, problem };
        let file = ply::PlyReader::new(input).map_err(wrong)?;
        let points = super::points(file.header()).map_err(wrong)?.clone();
        let find = |names: &[&str]| points.property(names);
        let (Some(x), Some(y), Some(z)) = (find(&["x"]), find(&["y"]), find(&["z"])) else {
            return Err(wrong((file.header().lines, "the points have no properties x, y and z".to_owned())));
        };
        let columns = Columns {
            position: [x, y, z],
            intensity: find(&["intensity", "scalar_intensity", "reflectance"]),
            time: find(&["time", "gps_time", "timestamp", "scalar_gpstime"]),
            error: find(&["error"]),
        };
        let remaining = points.count;
        Ok(Self { name: name.to_owned(), file, points, columns, remaining, row: Row::default() })
    }

    /// Number of points not yet read, according to the header.
    pub fn remaining(&self) -> u64 {
        self.remaining
    }

    fn next_point(&mut self) -> Result<CloudPoint, String> {
        self.file.read(&self.points, &mut self.row).map_err(|failure| match failure {
            Failure::End => format!("the file ends {} points early", self.remaining),
            Failure::Problem(problem) => problem,
        })?;
        let number = |column: Option<usize>, missing: f64| column.map_or(missing, |column| self.row.number(column));
        let [x, y, z] = self.columns.position.map(|column| self.row.number(column) as f32);
        let point_in_map = nalgebra::Vector3::new(x, y, z);
        if !point_in_map.iter().all(|c| c.is_finite()) {
            return Err("the point is not finite".to_owned());
        }
        Ok(CloudPoint {
            point_in_map,
            intensity: number(self.columns.intensity, 0.0) as f32,
            stamp: Stamp::from_nanos(0) + Span::from_seconds(number(self.columns.time, 0.0)),
            error_m: number(self.columns.error, f64::NAN) as f32,
        })
    }

    /// Line of the point that was read last, for messages; in a binary file each point counts as one.
    fn line(&self) -> usize {
        let header = self.file.header();
        match header.format {
            PlyFormat::Ascii => self.file.line(),
            _ => header.lines + usize::try_from(self.points.count - self.remaining).unwrap_or(usize::MAX),
        }
    }
}

impl<R: Read> Iterator for PlyReader<R> {
    type Item = Result<CloudPoint, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.remaining == 0 {
            return None;
        }
        let point = self.next_point();
        self.remaining = if point.is_ok() { self.remaining - 1 } else { 0 };
        let (name, line) = (&self.name, self.line());
        Some(point.map_err(|problem| RecordingError::Line { name: name.clone(), line, problem }))
    }
}
