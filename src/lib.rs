//! Design moving range sensors by computation: a lidar and an IMU on a spring, simulated with exact truth, and the
//! continuous-time SLAM that makes a trajectory and a map of what they see.
//!
//! # The journey of a sample
//!
//! A [scene](world) becomes surfaces. A [motion] carries the base; the [head on its spring](dynamics) swings along. The
//! [sensors] look from it: a beam at its own time, the IMU over its own interval, each stamped by its own clock. The
//! [simulation] gives their measurements, and the truth, to a [recording]. The [estimator](estimation) is given the
//! measurements alone, and answers with a trajectory, which the [evaluation] holds against the truth.
//!
//! ```
//! use zsim::estimation::{self, Estimator};
//! use zsim::evaluation::{Errors, Pairs};
//! use zsim::recording::{Preference, Reader, RunDescription, Writer};
//! use zsim::simulation::{Scenario, Simulation};
//!
//! // A walk through a furnished hall, by names that the library knows.
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
//! // Estimate, from the measurements alone.
//! let reader = Reader::open(&path)?;
//! let selection = reader.select(&Preference::default())?;
//! let found = reader.calibration(&selection, &simulation.calibration(), None)?;
//! let mut estimator = Estimator::new(&estimation::load("default")?, &found.calibration)?;
//! for measurement in reader.measurements(&selection) {
//!     estimator.push(measurement?)?;
//! }
//! let estimate = estimator.finish()?;
//!
//! // Evaluate, against the truth.
//! let pairs = Pairs::associate(&estimate.trajectory, &reader.truth_trajectory()?)?;
//! let errors = Errors::after(&pairs, &pairs.world_from_map()?);
//! assert!(errors.position_rmse_m() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The rooms
//!
//! The ground floor: [time], [random], [geometry], [signal], [spec], [elasticity], [surfel_map], [measurement],
//! [truth]. The door: [recording]. The wing that makes data: [world], [motion], [dynamics], [sensors], [simulation].
//! The wing that makes sense of them: [estimation], [evaluation]. On top: [report] and `study`. The two wings never
//! name each other; a test (`tests/architecture.rs`) keeps them apart.

pub mod dynamics;
pub mod elasticity;
pub mod estimation;
pub mod evaluation;
pub mod geometry;
pub mod measurement;
pub mod motion;
pub mod random;
pub mod recording;
pub mod report;
pub mod sensors;
pub mod signal;
pub mod simulation;
pub mod spec;
pub mod study;
pub mod surfel_map;
pub mod time;
pub mod truth;
pub mod world;
