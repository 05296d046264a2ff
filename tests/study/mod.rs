//! Studies: coverage, gains, latency, spring design, sweeps, and the paper's experiments.

mod bounds;
mod claims;
mod coverage;
mod gains;
mod kubernetes;
mod latency;
mod reference_system;
mod reproduction;
mod slam_bound;
mod slurm;
mod spring_design;
mod spring_export;
mod sweep;
