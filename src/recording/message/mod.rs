//! The messages of a recording, a file a kind: each to bytes and back.

pub mod clock;
pub mod imu;
pub mod points;
pub mod pose;
pub mod scan;
pub mod transforms;
