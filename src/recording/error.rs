use std::path::PathBuf;
use zsim_base::geometry::TrajectoryError;

/// Error of reading or writing a recording, a trajectory, a point cloud or a surfel map.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened or created.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A read failed after the file was opened.
    #[error("reading stopped: {0}")]
    Read(std::io::Error),
    /// A write failed after the file was created.
    #[error("writing stopped: {0}; the part written before is readable")]
    Write(std::io::Error),
    /// The file is not a recording in a supported format.
    #[error("{name}: {found}, not an MCAP file, a ROS 1 bag or a rosbag2 database; {remedy}")]
    NotRecording {
        /// Name of the file.
        name: String,
        /// Detected type of the file.
        found: String,
        /// How to convert it into a recording.
        remedy: String,
    },
    /// The recording exceeds a limit that protects memory and time.
    #[error(
        "{name}: {quantity} exceeds {limit}; if the file is not damaged, copy the topics of lidar and IMU with `mcap filter`, \
         `rosbag filter` or `ros2 bag convert`"
    )]
    Limit {
        /// Name of the file.
        name: String,
        /// Quantity with its article.
        quantity: String,
        /// The limit with its unit.
        limit: String,
    },
    /// The folder does not contain exactly one recording.
    #[error("{}: the folder {problem}", path.display())]
    Folder {
        /// Path of the folder.
        path: PathBuf,
        /// Description of the problem.
        problem: String,
    },
    /// An SQLite database that rosbag2 did not write, or that is damaged.
    #[error("{name}: not a readable rosbag2 database: {problem}")]
    Database {
        /// Name of the file.
        name: String,
        /// Description of the problem.
        problem: String,
    },
    /// A value exceeds what the message format can represent.
    #[error("{what} is {value}, but {limit}")]
    Unwritable {
        /// Name of the value.
        what: &'static str,
        /// The value.
        value: String,
        /// Limit of the format.
        limit: &'static str,
    },
    /// The recording has no messages of a required sensor.
    #[error("{name}: no {sensor} in the recording ({needs}); it has {has}")]
    NoSensor {
        /// Name of the file.
        name: String,
        /// Sensor: "lidar" or "IMU".
        sensor: &'static str,
        /// Message types that are supported.
        needs: &'static str,
        /// Topics of the recording.
        has: String,
    },
    /// The recording has topics of the sensor, but none is usable.
    #[error("{name}: no {sensor} topic can be used: {reasons}")]
    Unusable {
        /// Name of the file.
        name: String,
        /// Sensor: "lidar" or "IMU".
        sensor: &'static str,
        /// The topics, each with the reason.
        reasons: String,
    },
    /// The IMU's messages lack data that an estimate needs.
    #[error("{name}: IMU topic {topic} {problem}")]
    Imu {
        /// Name of the file.
        name: String,
        /// Name of the topic.
        topic: String,
        /// Description of the problem.
        problem: String,
    },
    /// A requested topic is missing or has another type.
    #[error("{name}: topic {topic} {problem}; it has {has}")]
    Topic {
        /// Name of the file.
        name: String,
        /// Name of the topic.
        topic: String,
        /// Description of the problem.
        problem: String,
        /// Topics of the recording.
        has: String,
    },
    /// The recording is incomplete, but all of it is needed.
    #[error(
        "{name}: the recording is cut short or damaged, so poses may be missing; repair it first (`mcap recover`, `rosbag reindex`, or \
         `sqlite3 {name} .recover`)"
    )]
    NotWhole {
        /// Name of the file.
        name: String,
    },
    /// The transforms do not connect the sensors.
    #[error("{name}: {problem}")]
    Frames {
        /// Name of the file.
        name: String,
        /// Description of the problem.
        problem: String,
    },
    /// A line or an element of a text or cloud file is invalid.
    #[error("{name}:{line}: {problem}")]
    Line {
        /// Name of the file.
        name: String,
        /// Line number, from 1.
        line: usize,
        /// Description of the problem.
        problem: String,
    },
    /// Poses that do not form a trajectory.
    #[error("{name}: {source}")]
    Trajectory {
        /// Name of the file or topic.
        name: String,
        /// Cause.
        source: TrajectoryError,
    },
}

impl From<mcap::McapError> for RecordingError {
    fn from(error: mcap::McapError) -> Self {
        Self::Write(match error {
            mcap::McapError::Io(error) => error,
            other => std::io::Error::other(other),
        })
    }
}
