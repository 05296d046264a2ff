//! MCAP recordings in the ROS 2 profile.

mod cdr;
mod container;
mod error;
mod extrinsics;
mod loss;
mod measurements;
mod message;
mod reader;
mod schema;
mod selection;
mod spool;
mod topics;
mod truth;
mod writer;

pub use error::RecordingError;
pub use extrinsics::FoundCalibration;
pub use loss::Loss;
pub use measurements::Measurements;
pub use reader::Reader;
pub use selection::{Preference, Selection};
pub use truth::{Truth, Truths};
pub use writer::{RunDescription, Writer};
