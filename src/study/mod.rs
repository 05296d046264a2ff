//! Whole experiments, out of the rooms below.
//!
//! [`journey()`] is the one that everything else varies: simulate and record, estimate from the recording, judge,
//! report. [`estimate_recording`] is its second half, for anybody's recording.
//!
//! The paper's experiments are run again by [`reproduction`].
//!
//! A head by itself is characterised by its [`gains`], by what its [`spring`] bears and how it moves, and by the
//! [`coverage`] of its lidar. A [`sweep`] varies any of it, and tells what matters.

mod artefacts;
mod atomic_file;
mod base;
mod bound;
mod cadence;
mod calibration;
mod closed_loop;
mod cloud;
mod cloud_files;
pub mod coverage;
mod disk;
mod error;
mod estimate;
mod events;
pub mod gains;
mod integrity;
mod journey;
mod judge;
mod kalibr;
pub mod latency;
mod manifest;
mod map;
mod memory;
mod open_loop;
mod read_ahead;
mod record;
mod register;
pub mod reproduction;
mod result_files;
pub mod spring;
pub mod sweep;
mod true_clock;
mod truth_cursor;
mod watch;

pub use base::{base_by_imu, base_by_law};
pub use bound::{RecordingBound, information_bound};
pub use calibration::CalibrationSpec;
pub use cloud_files::{CloudFormat, CloudOptions};
pub use disk::free_bytes;
pub use error::StudyError;
pub use estimate::{EstimateOptions, Outcome, estimate_recording};
pub use journey::journey;
pub use manifest::Manifest;
pub use map::{MapOptions, Merged, merge_map_files};
pub use record::record;
pub use result_files::{estimate_files, journey_files};
pub use watch::{OnProgress, Stage, StudyEvent, Watch};
