//! Endings of the names of recordings.

use std::path::Path;

/// The format that the ending of a name denotes, unless it is MCAP, the only format that is written.
pub fn other_format(path: &Path) -> Option<&'static str> {
    let ending = path.extension()?;
    let formats = [("bag", "a ROS 1 bag"), ("db3", "a database of rosbag2")];
    formats.into_iter().find(|(known, _)| ending.eq_ignore_ascii_case(known)).map(|(_, format)| format)
}
