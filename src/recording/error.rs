use crate::geometry::TrajectoryError;
use std::path::PathBuf;

/// What is wrong with a recording, a trajectory file or a cloud file.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened or made.
    #[error("{}: {source}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Reading went wrong midway.
    #[error("reading stopped: {0}")]
    Read(std::io::Error),
    /// Writing went wrong midway.
    #[error("writing stopped: {0}; what was written before can be read")]
    Write(std::io::Error),
    /// The file is not a recording that is read here.
    #[error("{name}: {found}, not an MCAP file, a ROS 1 bag or a rosbag2 database; {remedy}")]
    NotRecording {
        /// Which file.
        name: String,
        /// What it seems to be.
        found: String,
        /// How to make a recording of it.
        remedy: String,
    },
    /// A folder that is not one recording.
    #[error("{}: the folder {problem}", path.display())]
    Folder {
        /// Which folder.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// An SQLite database that rosbag2 did not write, or that is damaged.
    #[error(
        "{name}: not a readable rosbag2 database: {problem}; `sqlite3 {name} .recover` makes a new one of what is left"
    )]
    Database {
        /// Which file.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// A value that a message cannot hold.
    #[error("{what} is {value}, but {limit}")]
    Unwritable {
        /// Which value.
        what: &'static str,
        /// What it is.
        value: String,
        /// What the message can hold.
        limit: &'static str,
    },
    /// The recording has no messages of a sensor that is needed.
    #[error("{name}: no {sensor} in the recording ({needs}); it has {has}")]
    NoSensor {
        /// Which file.
        name: String,
        /// Which sensor: "lidar" or "IMU".
        sensor: &'static str,
        /// Which message types would do.
        needs: &'static str,
        /// The topics that are there.
        has: String,
    },
    /// The recording has topics of a sensor, and none of them can be used.
    #[error("{name}: no {sensor} topic can be used: {reasons}")]
    Unusable {
        /// Which file.
        name: String,
        /// Which sensor: "lidar" or "IMU".
        sensor: &'static str,
        /// The topics, each with the reason.
        reasons: String,
    },
    /// The IMU's messages lack what an estimate needs.
    #[error("{name}: IMU topic {topic} {problem}")]
    Imu {
        /// Which file.
        name: String,
        /// Which topic.
        topic: String,
        /// What is wrong.
        problem: String,
    },
    /// A topic that was asked for is not there, or carries another type.
    #[error("{name}: topic {topic} {problem}; it has {has}")]
    Topic {
        /// Which file.
        name: String,
        /// Which topic.
        topic: String,
        /// What is the matter with it.
        problem: String,
        /// The topics that are there.
        has: String,
    },
    /// A recording of which all is needed, and not all can be read.
    #[error(
        "{name}: the recording is cut short or damaged, so that poses may be missing; `mcap recover` makes a whole one of what is \
         left"
    )]
    NotWhole {
        /// Which file.
        name: String,
    },
    /// The tree of `/tf_static` does not lead where it must.
    #[error("{name}: /tf_static {problem}")]
    Frames {
        /// Which file.
        name: String,
        /// What is the matter.
        problem: String,
    },
    /// A line or a part of a text or cloud file that does not say what it must.
    #[error("{name}:{line}: {problem}")]
    Line {
        /// Which file.
        name: String,
        /// Which line, from 1.
        line: usize,
        /// What is wrong there.
        problem: String,
    },
    /// Poses that are not a trajectory.
    #[error("{name}: {source}")]
    Trajectory {
        /// Which file or topic.
        name: String,
        /// Why.
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
