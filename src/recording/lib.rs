//! Reads and writes recordings, trajectories, point clouds and surfel maps.
//!
//! [`Writer`] receives the measurements and the ground truth of a simulated run and writes an MCAP file in the ROS 2
//! profile, which ROS, Foxglove and rerun read. [`Reader`] reads such a file, or one of another program: MCAP, ROS 1
//! bags and rosbag2 databases, split or single. Measurements ([`Reader::measurements`]) and ground truth
//! ([`Reader::truth`]) have separate interfaces, so that an estimator can receive the first without the second;
//! [`Reader::poses`] reads the poses of any one topic.
//!
//! | topic | type | frame | content |
//! |---|---|---|---|
//! | `/scan` | `sensor_msgs/LaserScan` | `laser` | a sweep of a planar lidar |
//! | `/points` | `sensor_msgs/PointCloud2` | `laser` | x, y, z, intensity as floats, t as u32 nanoseconds after the stamp |
//! | `/imu/data_raw` | `sensor_msgs/Imu` | `imu_link` | angular velocity, specific force, noise variances |
//! | `/tf_static` | `tf2_msgs/TFMessage` | `head` | poses of `laser` and `imu_link` in `head` |
//! | `/ground_truth/odom` | `nav_msgs/Odometry` | `truth/map` | pose and twist of `truth/head`, at 100 Hz |
//! | `/ground_truth/pose`, `base` | `geometry_msgs/PoseStamped` | `truth/map` | poses of head and base, at 1 kHz |
//! | `/ground_truth/clock` | `sensor_msgs/TimeReference` | `laser`, `imu_link` | true time, and the time on the clock of `source` |
//!
//! Stamps are from the sensors' own clocks (poses: the lidar's). The log time of a message is its arrival in true time.
//!
//! [`TumWriter`] and [`read_tum`] handle trajectories ([`TrajectoryFile`] also in the formats of EuRoC and KITTI), [`PlyWriter`],
//! [`PlyReader`] and [`LasWriter`] point clouds, [`write_surfel_map`] and [`read_surfel_map`] surfel maps. [`ResultWriter`]
//! writes an estimate as a recording for viewers, [`write_rosbag2_metadata`] the metadata of a folder of rosbag2.
//!
//! On a running robot [`Incoming`] decodes messages as they arrive, [`ReceivedWriter`] records them, and
//! [`EstimateMessages`] encodes the estimate.

mod base_imu;
mod clock_step;
mod cloud;
mod container;
mod duplicates;
mod ending;
mod error;
mod estimate_messages;
mod extrinsics;
mod folder;
mod frames;
mod incoming;
mod info;
mod las;
mod loss;
mod map;
mod mcap_writer;
mod measurements;
mod message;
mod pairing;
mod playback;
mod ply;
mod poses;
mod quantile;
mod reader;
mod received;
mod result;
mod rosbag2;
mod schema;
mod selection;
mod stamp_screen;
mod stamp_sorter;
mod text_lines;
mod topics;
mod trajectory_file;
mod truth;
mod tum;
mod wire;
mod writer;
mod yaml;

pub use base_imu::BaseImuRecord;
pub use clock_step::ClockStep;
pub use cloud::CloudPoint;
pub use ending::other_format;
pub use error::RecordingError;
pub use estimate_messages::{Diagnostic, DiagnosticLevel, EstimateMessages, EstimateTopic};
pub use extrinsics::FoundCalibration;
pub use incoming::Incoming;
pub use info::{ClockStatistics, RecordingInfo, TopicInfo};
pub use las::LasWriter;
pub use loss::{Loss, OtherFrame};
pub use map::{parse_surfel_map, read_surfel_map, write_surfel_map};
pub use measurements::Measurements;
pub use playback::RecordedMessage;
pub use ply::{PlyReader, PlyWriter};
pub use reader::Reader;
pub use received::ReceivedWriter;
pub use result::ResultWriter;
pub use rosbag2::write_rosbag2_metadata;
pub use selection::{Selection, TopicPreference, UnusedTopic};
pub use trajectory_file::{PoseTimes, TrajectoryFile};
pub use truth::{Truth, TruthReader};
pub use tum::{TumWriter, parse_tum, read_tum, write_tum};
pub use writer::{BaseImuDescription, RunDescription, Writer};
pub use yaml::{YamlError, parse_yaml};
