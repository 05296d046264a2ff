//! Studies: what a design does, found by running it many times.

mod error;
pub mod gains;

pub use error::StudyError;
