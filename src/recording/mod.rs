//! The door: recordings, trajectories and clouds, written and read.
//!
//! [`Writer`] takes what a simulated run says, measurements and truth, and makes an MCAP file in the ROS 2 profile,
//! which ROS, Foxglove and rerun read. [`Reader`] reads such a file, or one by another program: MCAP, ROS 1 bags and
//! the databases of rosbag2, split or whole. Measurements ([`Reader::measurements`]) and truth ([`Reader::truth`]) come
//! by different ways, so that an estimator can be given the one without the other; [`Reader::poses`] gives those of any
//! one topic.
//!
//! | topic | type | frame | what |
//! |---|---|---|---|
//! | `/scan` | `sensor_msgs/LaserScan` | `laser` | a sweep of a planar lidar |
//! | `/points` | `sensor_msgs/PointCloud2` | `laser` | x, y, z, intensity as floats, t as u32 nanoseconds after the stamp |
//! | `/imu/data_raw` | `sensor_msgs/Imu` | `imu_link` | angular velocity and specific force, with the variances of their noise |
//! | `/tf_static` | `tf2_msgs/TFMessage` | `head` | where `laser` and `imu_link` are in `head` |
//! | `/ground_truth/odom` | `nav_msgs/Odometry` | `truth/map` | pose and twist of `truth/head`, 100 a second |
//! | `/ground_truth/pose`, `base` | `geometry_msgs/PoseStamped` | `truth/map` | head and base, 1000 a second |
//! | `/ground_truth/clock` | `sensor_msgs/TimeReference` | `laser`, `imu_link` | true time, and what the clock of `source` says |
//!
//! Stamps are the sensors' own (those of poses the lidar's); a message's log time is its arrival, in true time.
//!
//! [`TumWriter`], [`read_tum`] keep trajectories, [`PlyWriter`], [`PlyReader`] and [`LasWriter`] clouds,
//! [`write_surfel_map`] and [`read_surfel_map`] maps, and [`write_result`] an estimate as a recording for viewers.

mod base_imu;
mod cloud;
mod container;
mod error;
mod extrinsics;
mod folder;
mod info;
mod las;
mod loss;
mod map;
mod measurements;
mod message;
mod order;
mod pairing;
mod ply;
mod poses;
mod reader;
mod repeats;
mod result;
mod schema;
mod selection;
mod spool;
mod topics;
mod truth;
mod tum;
mod wire;
mod writer;

pub use base_imu::BaseImuRecord;
pub use cloud::CloudPoint;
pub use error::RecordingError;
pub use extrinsics::FoundCalibration;
pub use info::{ClockStatistics, RecordingInfo, TopicInfo};
pub use las::LasWriter;
pub use loss::Loss;
pub use map::{parse_surfel_map, read_surfel_map, write_surfel_map};
pub use measurements::Measurements;
pub use ply::{PlyReader, PlyWriter};
pub use reader::Reader;
pub use result::write_result;
pub use selection::{Preference, Selection};
pub use truth::{Truth, Truths};
pub use tum::{TumWriter, parse_tum, read_tum, write_tum};
pub use writer::{BaseImuDescription, RunDescription, Writer};
