//! Sensors compared with closed forms and with their specs.

mod canopy;
mod imu;
mod lidar;
mod specs;
