//! The estimator: accuracy on closed-form walks, full runs with faults, maps, and the base trajectory.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod accuracy;
mod averaging;
mod base;
#[path = "../command/mod.rs"]
mod command;
mod corridors;
mod faults;
mod fixture;
mod formulation;
mod lidar_gaps;
mod maps;
#[path = "../recordings/mod.rs"]
mod recordings;
mod registration;
mod stops;
