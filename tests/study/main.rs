//! Studies: coverage, gains, latency, spring design, sweeps, and the paper's experiments.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../command/mod.rs"]
mod command;
mod coverage;
mod gains;
mod kubernetes;
mod latency;
mod reference_system;
mod reproduction;
#[path = "../skip/mod.rs"]
mod skip;
mod slam_bound;
mod slurm;
mod spring_design;
mod spring_export;
mod sweep;
