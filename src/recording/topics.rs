//! Topics and frames of recordings that zsim writes.

use crate::schema::MessageType;
use zsim_base::printable::printable_name;

/// Frame of the lidar.
pub const LASER: &str = "laser";
/// Frame of the IMU.
pub const IMU: &str = "imu_link";
/// Frame of the head, the rigid body that carries both.
pub const HEAD: &str = "head";
/// Frame of the base, which carries the head on a spring.
pub const BASE: &str = "base";
/// Frame of the IMU on the base.
pub const BASE_IMU: &str = "base_imu";
/// World frame of an estimate.
pub const MAP: &str = "map";
/// World frame of ground truth.
pub const TRUTH_MAP: &str = "truth/map";
/// Frame of the head in ground truth.
pub const TRUTH_HEAD: &str = "truth/head";

/// Prefix of the ground truth topics.
pub const TRUTH_PREFIX: &str = "/ground_truth/";

/// Maximum length of a name in a message, characters.
const MAX_NAME: usize = 80;

/// Printable form of a name for messages; a longer one is cut.
pub fn shortened(name: &str) -> String {
    let mut start: String = name.chars().take(MAX_NAME).collect();
    if start.len() < name.len() {
        start.push('\u{2026}');
    }
    printable_name(&start)
}

/// Topic that zsim writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Topic {
    /// `/scan`.
    Scan,
    /// `/points`.
    Points,
    /// `/imu/data_raw`.
    Imu,
    /// `/base/imu`.
    BaseImu,
    /// `/tf_static`.
    TfStatic,
    /// `/tf`.
    Tf,
    /// `/ground_truth/odom`.
    TruthOdometry,
    /// `/ground_truth/pose`.
    TruthPose,
    /// `/ground_truth/base`.
    TruthBase,
    /// `/ground_truth/clock`.
    TruthClock,
    /// `/path`.
    Path,
    /// `/cloud`.
    Cloud,
    /// `/pose`.
    Pose,
}

impl Topic {
    /// Number of topics.
    pub const COUNT: usize = 13;

    /// The topic of this name.
    pub fn named(name: &str) -> Option<Self> {
        let all: [Self; Self::COUNT] = [
            Self::Scan,
            Self::Points,
            Self::Imu,
            Self::BaseImu,
            Self::TfStatic,
            Self::Tf,
            Self::TruthOdometry,
            Self::TruthPose,
            Self::TruthBase,
            Self::TruthClock,
            Self::Path,
            Self::Cloud,
            Self::Pose,
        ];
        all.into_iter().find(|topic| topic.name() == name)
    }

    /// Topic name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scan => "/scan",
            Self::Points => "/points",
            Self::Imu => "/imu/data_raw",
            Self::BaseImu => "/base/imu",
            Self::TfStatic => "/tf_static",
            Self::Tf => "/tf",
            Self::TruthOdometry => "/ground_truth/odom",
            Self::TruthPose => "/ground_truth/pose",
            Self::TruthBase => "/ground_truth/base",
            Self::TruthClock => "/ground_truth/clock",
            Self::Path => "/path",
            Self::Cloud => "/cloud",
            Self::Pose => "/pose",
        }
    }

    /// Message type.
    pub fn message_type(self) -> MessageType {
        match self {
            Self::Scan => MessageType::LaserScan,
            Self::Points | Self::Cloud => MessageType::PointCloud2,
            Self::Imu | Self::BaseImu => MessageType::Imu,
            Self::TfStatic | Self::Tf => MessageType::Transforms,
            Self::TruthOdometry => MessageType::Odometry,
            Self::TruthPose | Self::TruthBase => MessageType::PoseStamped,
            Self::TruthClock => MessageType::TimeReference,
            Self::Path => MessageType::Path,
            Self::Pose => MessageType::PoseWithCovariance,
        }
    }

    /// Quality of service in the format that rosbag2 stores with a channel.
    ///
    /// Reliable; transient local for messages that remain valid (static transforms, a complete path).
    pub fn qos(self) -> String {
        let (depth, durability) = match self {
            Self::TfStatic | Self::Path => (1, TRANSIENT_LOCAL),
            _ => (10, VOLATILE),
        };
        let forever = "\n    sec: 9223372036\n    nsec: 854775807";
        format!(
            "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline:{forever}\n  \
             lifespan:{forever}\n  liveliness: 1\n  liveliness_lease_duration:{forever}\n  \
             avoid_ros_namespace_conventions: false"
        )
    }
}

/// `RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL`.
const TRANSIENT_LOCAL: u8 = 1;
/// `RMW_QOS_POLICY_DURABILITY_VOLATILE`.
const VOLATILE: u8 = 2;
