//! Experiments: simulation, estimation, evaluation and reports combined.
//!
//! [`journey()`] is the full run: it simulates, records, estimates from the recording, evaluates against the truth and
//! writes the report. [`estimate_recording`] does the same from an existing recording.
//!
//! Studies of a head without an estimator: the [`gains`] of its modes, the stress and motion of its [`spring`] and the
//! [`coverage`] of its lidar. [`latency`] measures the effect of timing errors. A [`sweep`] varies parameters of these
//! runs and reports their effects; [`reproduction`] repeats the experiments of the paper.

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
mod page;
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
pub use map::{MapOptions, MergedMap, merge_map_files};
pub use record::record;
pub use result_files::{estimate_files, journey_files};
pub use watch::{OnProgress, Stage, StudyEvent, Watch};
