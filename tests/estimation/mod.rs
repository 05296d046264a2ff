//! The estimator: accuracy on closed-form walks, full runs with faults, maps, and the base trajectory.

mod accuracy;
mod averaging;
mod base;
mod corridors;
mod faults;
mod fixture;
mod lidar_gaps;
mod maps;
mod registration;
mod stops;
