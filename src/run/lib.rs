//! Runs: simulation, estimation, evaluation and reports combined.
//!
//! [`simulate_and_estimate`] is the full run: it simulates, records, estimates from the recording, evaluates against
//! the truth and writes the report. [`estimate_recording`] does the same from an existing recording.

mod artefacts;
mod base;
mod beams;
mod bound;
mod cadence;
mod calibration;
mod closed_loop;
mod cloud;
mod cloud_files;
mod comparison;
mod error;
mod estimate;
mod full_run;
mod inputs;
mod integrity;
mod kalibr;
mod loops;
mod manifest;
mod map;
mod map_options;
mod open_loop;
mod page;
mod progress;
mod record;
mod recorded_manifest;
mod reference_system;
mod register;
mod resources;
mod result_files;
mod results;
mod run_recording;
mod sampled_cloud;
mod sampled_truth;
mod sensor_models;
mod temporary_recording;
pub mod timing;
mod true_clock;
mod truth_cursor;

pub use base::base_by_imu;
pub use bound::{RecordingBound, information_bound};
pub use cadence::Cadence;
pub use calibration::recording_calibration;
pub use cloud_files::{CloudFormat, CloudOptions};
pub use error::RunError;
pub use estimate::{EstimateOptions, EstimateResult, estimate_recording};
pub use full_run::simulate_and_estimate;
pub use inputs::{INPUT_TYPES, ReferenceInputs, RunInputs, SpecType, load_input};
pub use integrity::large_error_m;
pub use manifest::Manifest;
pub use map::{MergedMap, merge_map_files};
pub use map_options::MapOptions;
pub use progress::{ProgressMonitor, RunEvent, Stage, StageData};
pub use record::{record, record_imus, record_with_truth_apart};
pub use resources::free_bytes;
pub use result_files::{METRICS, ViewerFiles, estimate_files, full_run_files};
pub use results::{ClockCurve, Needs, ReferenceResults, Results, Swing};
pub use sensor_models::{CalibrationSpec, ImuNoiseSpec, LidarNoiseSpec};
pub use temporary_recording::{Compared, MAX_RECORDINGS, TemporaryRecording, record_simulations};
