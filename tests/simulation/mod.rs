//! The simulation: pipeline, shipped specs, and sensor faults.

mod faults;
mod memory_sink;
mod pipeline;
mod shipped;
