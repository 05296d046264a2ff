//! Simulation and SLAM for moving 2-D laser scanners, to design them by computation.
//!
//! zsim simulates a lidar and an IMU on a spring with exact ground truth, and estimates trajectory and map from their
//! measurements by continuous-time SLAM.
//!
//! # Data flow
//!
//! A [scene](world) is converted to surfaces. A [motion] moves the base, and the [dynamics] of the spring move the
//! head. The [sensors] measure: each beam at its own time, each IMU sample over its own interval, each sensor with the
//! stamps of its own clock. The [simulation] writes measurements and ground truth to a [recording]. The
//! [estimator](estimation) reads the measurements only and computes a trajectory, which the [evaluation] compares with
//! the ground truth.
//!
//! ```
//! use zsim::estimation::{self, Estimator};
//! use zsim::evaluation::{Errors, Pairs};
//! use zsim::recording::{TopicPreference, Reader, RunDescription, Writer};
//! use zsim::simulation::{Scenario, Simulation};
//!
//! // A walk through a furnished hall, with specs from the library.
//! let scenario = Scenario { duration_s: 8.0, ..Scenario::in_scene("mocap_room") };
//! let simulation = Simulation::prepare(&scenario)?;
//!
//! // Simulate, and record as a ROS 2 system would.
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("recording.mcap");
//! let run = RunDescription {
//!     calibration: simulation.calibration(),
//!     imu_rate_hz: 100.0,
//!     base_imu: None,
//!     manifest: zsim::spec::to_text(&scenario)?,
//!     truth_tf: false,
//! };
//! let mut writer = Writer::create(&path, run)?;
//! simulation.run(&mut writer, &mut |_fraction| ())?;
//! writer.finish()?;
//!
//! // Estimate from the measurements only.
//! let reader = Reader::open(&path)?;
//! let selection = reader.select(&TopicPreference::default())?;
//! let found = reader.calibration(&selection, &simulation.calibration(), None)?;
//! let mut estimator = Estimator::new(&estimation::load("default")?, &found.calibration)?;
//! for measurement in reader.measurements(&selection) {
//!     estimator.push(measurement?)?;
//! }
//! let estimate = estimator.finish()?;
//!
//! // Compare with the ground truth.
//! let pairs = Pairs::associate(&estimate.trajectory, &reader.truth_trajectory()?)?;
//! let errors = Errors::after(&pairs, &pairs.world_from_map()?);
//! assert!(errors.position_rmse_m() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! Each module is a crate of its own, `zsim-estimation` for [estimation]; this crate names them together.
//!
//! - Basics, from `zsim-base`: [time], [random], [geometry], [signal], [spec], [surfel_map], [measurement]. Also [truth]
//!   and [elasticity].
//! - Input and output: [recording].
//! - Simulation: [world], [motion], [dynamics], [sensors], [simulation].
//! - Estimation: [estimation], [evaluation].
//! - Applications: [report], [run], [head] and [study], with the feature `studies` (on by default).
//!
//! Simulation and estimation do not depend on each other: the manifest of a crate lists those that it may use.

pub use zsim_base::{geometry, measurement, random, signal, spec, surfel_map, time};
pub use zsim_dynamics as dynamics;
pub use zsim_elasticity as elasticity;
pub use zsim_estimation as estimation;
pub use zsim_evaluation as evaluation;
#[cfg(feature = "studies")]
pub use zsim_head as head;
pub use zsim_motion as motion;
pub use zsim_recording as recording;
#[cfg(feature = "studies")]
pub use zsim_report as report;
#[cfg(feature = "studies")]
pub use zsim_run as run;
pub use zsim_sensors as sensors;
pub use zsim_simulation as simulation;
#[cfg(feature = "studies")]
pub use zsim_study as study;
pub use zsim_truth as truth;
pub use zsim_world as world;
