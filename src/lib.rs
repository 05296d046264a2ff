//! zsim: a lidar and an IMU on a spring, by computation.
#![warn(missing_docs)]

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
pub mod time;
pub mod truth;
pub mod world;
