//! Sensors compared with closed forms and with their specs.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod canopy;
mod imu;
mod lidar;
mod specs;
#[path = "../strapdown/mod.rs"]
mod strapdown;
