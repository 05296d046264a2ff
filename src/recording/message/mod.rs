//! Messages of a recording, one file per kind: encoding and decoding.

pub mod clock;
pub mod diagnostics;
pub mod imu;
pub mod livox;
pub mod multi_echo;
pub mod no_returns;
pub mod point_times;
pub mod points;
pub mod pose;
pub mod scan;
pub mod transforms;
