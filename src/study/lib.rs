//! Studies of many runs.
//!
//! A [`sweep`] varies parameters of a run and reports their effects; [`latency`] measures the effect of timing errors;
//! [`design`] searches for a spring; [`reproduction`] repeats the experiments of the paper.

mod bootstrap;
mod cma_es;
pub mod design;
mod error;
pub mod latency;
pub mod reproduction;
pub mod spec_types;
pub mod sweep;

pub use bootstrap::ConfidenceInterval;
pub use error::StudyError;
