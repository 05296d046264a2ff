//! The containers of recordings, read: MCAP, ROS 1 bags and the databases of rosbag2; each as a directory of blocks,
//! and messages in the order of their log time.
//!
//! Written for files that may be cut short, damaged, or made by anybody: nothing is allocated on the word of a length
//! field alone, every record is bounded by what is there, and what cannot be read is counted, not feared.

mod bag;
mod chunk;
mod directory;
mod format;
mod messages;
mod part;
mod record;
mod rows;
mod signposts;
mod source;
mod walk;

pub use directory::{Block, Channel, Directory, Ending};
pub use messages::{Messages, RawMessage};
pub use part::{ChannelId, Part};
