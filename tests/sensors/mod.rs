//! Sensors compared with closed forms and with their specs.

mod canopy;
mod imu;
mod imu_output;
mod lidar;
mod specs;
