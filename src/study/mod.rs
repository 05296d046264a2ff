//! Studies: what a design does, found by running it many times.

pub mod coverage;
mod error;
pub mod gains;
pub mod spring;

pub use error::StudyError;
