//! The MCAP container, read: records, the directory of a file, chunks, and messages in the order of their log time.
//!
//! Written for files that may be cut short, damaged, or made by anybody: nothing is allocated on the word of a length
//! field alone, every record is bounded by what is there, and what cannot be read is counted, not feared.

mod chunk;
mod directory;
mod messages;
mod record;
mod signposts;
mod source;
mod walk;

pub use chunk::Loaded;
pub use directory::{BlockKind, Channel, Directory, Ending};
pub use messages::{Messages, RawMessage};
pub use source::Source;
pub use walk::walk;
