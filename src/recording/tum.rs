//! Trajectories in the text format of the TUM RGB-D benchmark: `t x y z qx qy qz qw` per line, in s and m.

pub(crate) mod number;

use crate::RecordingError;
use crate::text_lines::for_each_line;
use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::Path;
use zsim_base::files;
use zsim_base::geometry::{Pose, Rotation, Trajectory, Vector};
use zsim_base::measurement::SinkError;
use zsim_base::time::Stamp;
use zsim_truth::{ClockTruth, TruthSample, TruthSink};

/// Maximum deviation of a quaternion's norm from 1: files with few decimals come close to it.
const NORM_TOLERANCE: f64 = 1e-2;

/// Writes poses sequentially: stamps to 1 ns, positions and quaternions to nine decimals.
pub struct TumWriter<W: Write> {
    out: W,
    line: Vec<u8>,
}

impl TumWriter<BufWriter<File>> {
    /// Creates the file at `path`, replacing an existing one.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let file = files::create(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Ok(Self::new(BufWriter::new(file)))
    }
}

impl<W: Write> TumWriter<W> {
    /// Starts to write to `out`.
    pub fn new(out: W) -> Self {
        Self { out, line: Vec::with_capacity(128) }
    }

    /// Writes a pose.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn pose(&mut self, stamp: Stamp, pose: &Pose) -> Result<(), RecordingError> {
        self.line.clear();
        number::write_stamp(&mut self.line, stamp);
        for value in pose.translation.vector.iter().chain(pose.rotation.coords.iter()) {
            self.line.push(b' ');
            number::write(&mut self.line, *value);
        }
        self.line.push(b'\n');
        self.out.write_all(&self.line).map_err(RecordingError::Write)
    }

    /// Flushes the output.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.out.flush().map_err(RecordingError::Write)
    }
}

impl<W: Write> TruthSink for TumWriter<W> {
    fn truth(&mut self, _: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        Ok(self.pose(sample.lidar_stamp, &sample.head.world_from_body)?)
    }

    fn clock(&mut self, _: Stamp, _: &ClockTruth) -> Result<(), SinkError> {
        Ok(())
    }
}

/// Writes a complete trajectory to a new file at `path`.
///
/// # Errors
/// When it cannot be written.
pub fn write_tum(path: &Path, trajectory: &Trajectory) -> Result<(), RecordingError> {
    let mut writer = TumWriter::create(path)?;
    for (stamp, pose) in trajectory.iter() {
        writer.pose(stamp, pose)?;
    }
    writer.finish()
}

/// Reads the trajectory in the file at `path`.
///
/// # Errors
/// When it cannot be read; with the line number if a line is not a pose or not later than the previous one.
pub fn read_tum(path: &Path) -> Result<Trajectory, RecordingError> {
    let file = files::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
    parse_tum(&path.display().to_string(), file)
}

/// Reads a trajectory from `text`, called `name` in messages.
///
/// Empty lines and lines that start with `#` are ignored.
///
/// # Errors
/// As [`read_tum`].
pub fn parse_tum(name: &str, text: impl Read) -> Result<Trajectory, RecordingError> {
    let mut trajectory = Trajectory::new();
    for_each_line(name, text, |line| {
        let Row { stamp, position, rotation } = parse_row(line)?;
        let words = line.split_whitespace().count();
        let rotation = rotation.ok_or_else(|| match words {
            WORDS_OF_POSITION => format!("a pose needs {POSE}, but the line has {words}"),
            _ => "the quaternion's norm is 0.0000, not 1".to_owned(),
        })?;
        trajectory.push(stamp, Pose::from_parts(position.into(), rotation)).map_err(|problem| problem.to_string())
    })?;
    Ok(trajectory)
}

/// The numbers of a pose, for messages.
const POSE: &str = "8 numbers, `t x y z qx qy qz qw`";
/// Number of words of a line without attitude.
const WORDS_OF_POSITION: usize = 4;

/// A line of a trajectory.
pub(crate) struct Row {
    pub stamp: Stamp,
    pub position: Vector,
    /// `None` for a line without attitude, or with a quaternion of zeros.
    pub rotation: Option<Rotation>,
}

/// Parses `t x y z qx qy qz qw` or `t x y z`.
pub(crate) fn parse_row(line: &str) -> Result<Row, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [stamp, rest @ ..] = words.as_slice() else { return Err("the line is empty".to_owned()) };
    if ![3, 7].contains(&rest.len()) {
        return Err(format!("a pose needs {POSE}, but the line has {}", words.len()));
    }
    let stamp = number::parse_stamp(stamp).ok_or_else(|| format!("`{stamp}` is not a time in seconds"))?;
    let (position, quaternion) = rest.split_at(3);
    let position = numbers::<3>(position)?.into();
    let rotation = if quaternion.is_empty() { None } else { rotation(numbers::<4>(quaternion)?)? };
    Ok(Row { stamp, position, rotation })
}

/// Parses finite numbers, one for each word.
pub(crate) fn numbers<const N: usize>(words: &[&str]) -> Result<[f64; N], String> {
    let mut numbers = [0.0; N];
    for (number, word) in numbers.iter_mut().zip(words) {
        *number =
            word.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| format!("`{word}` is not a number"))?;
    }
    Ok(numbers)
}

/// The rotation of the quaternion `x, y, z, w`; `None` for zeros, which files without attitudes have.
pub(crate) fn rotation([x, y, z, w]: [f64; 4]) -> Result<Option<Rotation>, String> {
    let quaternion = nalgebra::Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    if norm == 0.0 {
        return Ok(None);
    }
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(format!("the quaternion's norm is {norm:.4}, not 1"));
    }
    Ok(Some(Rotation::from_quaternion(quaternion)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::from_roll_pitch_yaw;

    #[test]
    fn a_written_trajectory_is_read_to_the_ninth_decimal() {
        let pose = |k: f64| Pose::from_parts([k, -0.1 * k, 1e-7].into(), from_roll_pitch_yaw(0.1 * k, -0.2, 3.0));
        let poses = (0..5).map(|k| (Stamp::from_nanos(1_349_049_600_000_000_001 + k), pose(k as f64)));
        let written = Trajectory::from_poses(poses).unwrap();
        let mut text = Vec::new();
        let mut writer = TumWriter::new(&mut text);
        written.iter().for_each(|(stamp, pose)| writer.pose(stamp, pose).unwrap());
        writer.finish().unwrap();
        let read = parse_tum("memory", text.as_slice()).unwrap();
        assert_eq!(read.stamps(), written.stamps());
        for (a, b) in read.poses().iter().zip(written.poses()) {
            assert!((a.translation.vector - b.translation.vector).amax() <= 0.5e-9);
            assert!(a.rotation.angle_to(&b.rotation) < 4e-9);
        }
    }

    #[test]
    fn an_error_states_file_and_line() {
        let message = |text: &str| parse_tum("a.tum", text.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            message("# t x y z\n1.5 0 0 0 0 0 0\n"),
            "a.tum:2: a pose needs 8 numbers, `t x y z qx qy qz qw`, but the line has 7"
        );
        assert_eq!(message("1 0 0 nan 0 0 0 1\n"), "a.tum:1: `nan` is not a number");
        assert_eq!(message("x 0 0 0 0 0 0 1\n"), "a.tum:1: `x` is not a time in seconds");
        assert_eq!(message("1 0 0 0 0 0 0 2\n"), "a.tum:1: the quaternion's norm is 2.0000, not 1");
        assert!(message("2 0 0 0 0 0 0 1\n\n1 0 0 0 0 0 0 1\n").starts_with("a.tum:3: pose 1 has stamp 1000000000 ns"));
        assert!(message(&" ".repeat(5000)).starts_with("a.tum:1: this is not a line of text"));
    }
}
