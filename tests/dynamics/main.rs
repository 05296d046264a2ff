//! The simulated head against its linear model, closed forms, and laws.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod actuated;
mod decay;
mod elements;
mod energy;
mod heads;
mod imu;
mod invariance;
mod linkage;
mod rest;
mod shipped;
mod under;
mod wire;
mod wrong;
