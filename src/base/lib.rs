//! The ground floor of zsim: what every other room may use.
//!
//! Stamps ([time]), [random] streams, [geometry], [signal] analysis, [spec] files, [ply] files, [measurement]s and the
//! persistent [surfel_map]; [files] of results, [printable] text and [similar] names. No simulator, no estimator, no recordings.

pub mod files;
pub mod geometry;
pub mod measurement;
pub mod parallel;
pub mod ply;
pub mod printable;
pub mod random;
pub mod signal;
pub mod similar;
pub mod spec;
pub mod surfel_map;
pub mod time;
mod unit;
