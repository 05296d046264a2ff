//! Reads the containers of recordings: MCAP, ROS 1 bags and rosbag2 databases.
//!
//! Each file is indexed as a list of blocks; messages are read in order of log time.
//!
//! Files may be truncated, damaged or malicious: memory is never allocated on the basis of an unchecked length field, every
//! record is checked against the available bytes, and unreadable data are counted and skipped. A [`budget::Budget`] limits
//! what a recording may decompress to and keep in memory.

mod bag;
mod bag_indexer;
mod budget;
mod database;
mod database_file;
mod encoding;
mod entry;
mod file_index;
mod format;
mod loaded_block;
mod mcap_indexer;
mod mcap_summary;
mod messages;
mod record;
mod recording_file;
mod source;

pub use budget::Budget;
pub use file_index::{Block, Channel, ChannelId, Ending, FileIndex};
pub use messages::{Messages, RawMessage};
pub use recording_file::RecordingFile;
