//! The simulation: pipeline, shipped specs, and sensor faults.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod faults;
mod memory_sink;
mod pipeline;
mod shipped;
#[path = "../strapdown/mod.rs"]
mod strapdown;
