//! Experiments: simulation, estimation, evaluation and reports combined.
//!
//! [`simulate_and_estimate`] is the full run: it simulates, records, estimates from the recording, evaluates against
//! the truth and writes the report. [`estimate_recording`] does the same from an existing recording.
//!
//! Studies of a head without an estimator: the [`gains`] of its modes, the stress and motion of its [`spring`] and the
//! [`coverage`] of its lidar. [`latency`] measures the effect of timing errors. A [`sweep`] varies parameters of these
//! runs and reports their effects; [`reproduction`] repeats the experiments of the paper.

mod artefacts;
mod atomic_file;
mod background;
mod base;
mod bound;
mod cadence;
mod calibration;
mod closed_loop;
mod cloud;
mod cloud_files;
mod cma_es;
mod comparison;
pub mod coverage;
mod decimation;
mod disk;
mod error;
mod estimate;
mod events;
mod full_run;
pub mod gains;
mod integrity;
mod kalibr;
pub mod latency;
mod live;
mod loops;
mod manifest;
mod map;
mod map_options;
mod memory;
mod observed_sink;
mod open_loop;
mod origin;
mod page;
mod progress;
mod read_ahead;
mod record;
mod recorded_manifest;
mod register;
pub mod reproduction;
mod result_files;
mod sampled_cloud;
mod sampled_truth;
pub mod scene;
mod sensor_models;
pub mod spring;
pub mod sweep;
mod threads;
mod true_clock;
mod truth_cursor;
mod viewer_files;

pub use atomic_file::{replace_bytes, replace_text};
pub use base::base_by_imu;
pub use bound::{RecordingBound, information_bound};
pub use cadence::Cadence;
pub use calibration::{CalibrationSpec, recording_calibration};
pub use cloud_files::{CloudFormat, CloudOptions};
pub use disk::free_bytes;
pub use error::StudyError;
pub use estimate::{EstimateOptions, EstimateResult, estimate_recording};
pub use full_run::simulate_and_estimate;
pub use live::live_page;
pub use manifest::Manifest;
pub use map::{MergedMap, merge_map_files};
pub use map_options::MapOptions;
pub use progress::{OnProgress, ProgressMonitor, Stage, StageData, StudyEvent};
pub use record::{record, record_imus};
pub use result_files::{estimate_files, full_run_files};
pub use sensor_models::{ImuNoiseSpec, LidarNoiseSpec};
pub use viewer_files::ViewerFiles;
