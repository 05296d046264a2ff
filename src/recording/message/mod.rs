//! The messages of a recording, a file a kind: each to bytes and back.

pub mod clock;
pub mod imu;
pub mod livox;
pub mod misses;
pub mod multi_echo;
pub mod points;
pub mod pose;
pub mod scan;
pub mod transforms;
