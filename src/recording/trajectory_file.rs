//! Trajectories in the text formats of benchmarks, with or without attitudes.
//!
//! | format | line | who writes it |
//! |---|---|---|
//! | TUM | `t x y z qx qy qz qw`, seconds | `zsim`, evo, most SLAM systems |
//! | positions | `t x y z`, seconds | total stations, RTK receivers |
//! | EuRoC | `t, x, y, z, qw, qx, qy, qz, ...`, nanoseconds, or `t, x, y, z` | the EuRoC MAV dataset and those after it |
//! | KITTI | `r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z`, without a stamp | the KITTI odometry benchmark |

use crate::text_lines::for_each_line;
use crate::tum::{Row, number, parse_row};
use crate::{RecordingError, tum};
use nalgebra::{Matrix3, Rotation3};
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_base::geometry::{Pose, Rotation, Trajectory, Vector};
use zsim_base::time::{Span, Stamp};

/// Maximum deviation of the entries of `R^T R` from those of the identity: files with few decimals come close to it.
const ROTATION_TOLERANCE: f64 = 1e-2;

/// Stamps of poses that have none, those of the KITTI format.
#[derive(Debug, Clone, PartialEq)]
pub enum PoseTimes {
    /// A file with a time in seconds per line, one for each pose.
    File(PathBuf),
    /// Poses per second; the first pose has the time 0.
    Rate(f64),
}

/// A trajectory from a text file.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryFile {
    /// The trajectory; without attitudes all rotations are the identity.
    pub trajectory: Trajectory,
    /// Whether the file has attitudes: it does not if it has positions only, or nothing but zero or identity rotations.
    pub has_attitudes: bool,
}

impl TrajectoryFile {
    /// Reads the file at `path`, whose format is that of its first line; `times` are the stamps of a file without stamps.
    ///
    /// # Errors
    /// When it cannot be read, stamps are missing, or `times` is given for a file that has stamps; with the line number if a
    /// line is invalid.
    pub fn read(path: &Path, times: Option<&PoseTimes>) -> Result<Self, RecordingError> {
        let failed = |source| RecordingError::File { path: path.to_owned(), source };
        let mut rows = Rows { format: None, stamps: stamps(times)?.into_iter(), found: Vec::new() };
        for_each_line(&path.display().to_string(), files::open(path).map_err(failed)?, |line| rows.take(line, times))?;
        rows.finish(&path.display().to_string(), times)
    }
}

/// The format of a file with one pose per line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    /// Also positions only.
    Tum,
    Euroc,
    Kitti,
}

impl Format {
    fn of(line: &str) -> Self {
        match line.split_whitespace().count() {
            _ if line.contains(',') => Self::Euroc,
            12 => Self::Kitti,
            _ => Self::Tum,
        }
    }
}

/// Given stamps; `None` without end for those of a rate.
fn stamps(times: Option<&PoseTimes>) -> Result<Vec<Stamp>, RecordingError> {
    let Some(PoseTimes::File(path)) = times else { return Ok(Vec::new()) };
    let mut stamps = Vec::new();
    let file = files::open(path).map_err(|source| RecordingError::File { path: path.clone(), source })?;
    for_each_line(&path.display().to_string(), file, |line| {
        stamps.push(number::parse_stamp(line).ok_or_else(|| format!("`{line}` is not a time in seconds"))?);
        Ok(())
    })?;
    Ok(stamps)
}

/// The poses of a file so far.
struct Rows {
    /// That of the first line.
    format: Option<Format>,
    /// Stamps from a file that are not used yet.
    stamps: std::vec::IntoIter<Stamp>,
    found: Vec<Row>,
}

impl Rows {
    /// Adds a line.
    fn take(&mut self, line: &str, times: Option<&PoseTimes>) -> Result<(), String> {
        let format = *self.format.get_or_insert_with(|| Format::of(line));
        if format != Format::Kitti && times.is_some() {
            return Err("this file has its own stamps; times or a rate are for poses of 12 numbers (KITTI)".to_owned());
        }
        let row = match format {
            Format::Tum => parse_row(line)?,
            Format::Euroc => parse_euroc(line)?,
            Format::Kitti => Row { stamp: self.next_stamp(times)?, ..parse_kitti(line)? },
        };
        let has_rotation = |row: &Row| row.rotation.is_some();
        if self.found.first().is_some_and(|first| has_rotation(first) != has_rotation(&row)) {
            let (has, others) = if has_rotation(&row) { ("an", "none") } else { ("no", "one") };
            return Err(format!("this pose has {has} attitude, and the poses before it have {others}"));
        }
        let is_later = |before: &Row| row.stamp > before.stamp;
        if let Some(before) = self.found.last().filter(|before| !is_later(before)) {
            let (stamp, before) = (row.stamp.nanos(), before.stamp.nanos());
            return Err(format!("the stamp {stamp} ns is not later than the previous stamp {before} ns"));
        }
        self.found.push(row);
        Ok(())
    }

    fn next_stamp(&mut self, times: Option<&PoseTimes>) -> Result<Stamp, String> {
        match times {
            Some(PoseTimes::Rate(rate_hz)) => {
                Ok(Stamp::from_nanos(0) + Span::from_seconds(self.found.len() as f64 / rate_hz))
            }
            Some(PoseTimes::File(path)) => {
                let count = self.found.len();
                self.stamps.next().ok_or_else(|| format!("{} has only {count} times", path.display()))
            }
            None => {
                Err("12 numbers are a pose in the KITTI format, which has no stamp: pass the times of the poses (one \
                         per line, s) with --truth-times, or their rate with --truth-rate"
                    .to_owned())
            }
        }
    }

    fn finish(self, name: &str, times: Option<&PoseTimes>) -> Result<TrajectoryFile, RecordingError> {
        if let (Some(PoseTimes::File(path)), left @ 1..) = (times, self.stamps.len()) {
            let (path, count) = (path.display().to_string(), self.found.len());
            let problem = format!("{} times are given, and {name} has only {count} poses", count + left);
            return Err(RecordingError::Line { name: path, line: count + 1, problem });
        }
        let identity = Rotation::identity();
        let has_attitudes = self.found.iter().any(|row| row.rotation.is_some_and(|rotation| rotation != identity));
        let pose = |row: Row| (row.stamp, Pose::from_parts(row.position.into(), row.rotation.unwrap_or(identity)));
        let trajectory = Trajectory::from_poses(self.found.into_iter().map(pose));
        let trajectory = trajectory.map_err(|source| RecordingError::Trajectory { name: name.to_owned(), source })?;
        Ok(TrajectoryFile { trajectory, has_attitudes })
    }
}

/// Parses `t, x, y, z, qw, qx, qy, qz, ...` or `t, x, y, z`, nanoseconds.
fn parse_euroc(line: &str) -> Result<Row, String> {
    let words: Vec<&str> = line.split(',').map(str::trim).collect();
    let (stamp, rest) = words.split_first().ok_or("the line is empty")?;
    let stamp = stamp.parse().map_err(|_| {
        format!(
            "`{stamp}` is not a time in whole nanoseconds, with which a line with commas begins (EuRoC: t, x, y, z, qw, qx, \
             qy, qz); separate numbers by spaces if the time is in seconds"
        )
    })?;
    let (position, quaternion) = match rest.len() {
        3 => (rest, None),
        7.. => (&rest[..3], Some(&rest[3..7])),
        _ => {
            let count = words.len();
            return Err(format!("a line needs `t, x, y, z` or `t, x, y, z, qw, qx, qy, qz`, but has {count} numbers"));
        }
    };
    let rotation = match quaternion.map(tum::numbers::<4>).transpose()? {
        Some([w, x, y, z]) => tum::rotation([x, y, z, w])?,
        None => None,
    };
    Ok(Row { stamp: Stamp::from_nanos(stamp), position: tum::numbers::<3>(position)?.into(), rotation })
}

/// Parses the first three rows of a pose as a matrix; the stamp is zero.
fn parse_kitti(line: &str) -> Result<Row, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.len() != 12 {
        return Err(format!("the first pose has 12 numbers (KITTI), but this line has {}", words.len()));
    }
    let n = tum::numbers::<12>(&words)?;
    let matrix = Matrix3::new(n[0], n[1], n[2], n[4], n[5], n[6], n[8], n[9], n[10]);
    let deviation = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    if deviation > ROTATION_TOLERANCE || matrix.determinant() < 0.0 {
        return Err("columns 1 to 3, 5 to 7 and 9 to 11 are not a rotation matrix (KITTI)".to_owned());
    }
    let rotation = match matrix == Matrix3::identity() {
        true => Rotation::identity(),
        false => {
            Rotation::from_rotation_matrix(&Rotation3::from_matrix_eps(&matrix, 1e-12, 100, Rotation3::identity()))
        }
    };
    let position = Vector::new(n[3], n[7], n[11]);
    Ok(Row { stamp: Stamp::from_nanos(0), position, rotation: Some(rotation) })
}
