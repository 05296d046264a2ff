//! Message types of recordings, as `ros2msg` definitions.
//!
//! Names, types and order of the fields are those of the ROS 2 interface packages (`common_interfaces`, `geometry2`,
//! `rcl_interfaces`), since they determine compatibility. Comments and constants are omitted, except those of
//! `PointField`.

/// Definition of each type, by short name `package/Type`.
const DEFINITIONS: [(&str, &str); 21] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
    ("geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"),
    ("geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"),
    ("geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"),
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n",
    ),
    ("nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"),
    ("sensor_msgs/TimeReference", "std_msgs/Header header\nbuiltin_interfaces/Time time_ref\nstring source\n"),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
    ),
    (
        "sensor_msgs/LaserScan",
        "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n",
    ),
    (
        "sensor_msgs/PointField",
        "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    ),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    ),
];

/// Types with a header that zsim does not write.
const OTHER_TYPES_WITH_HEADER: [&str; 12] = [
    "sensor_msgs/CompressedImage",
    "sensor_msgs/CameraInfo",
    "sensor_msgs/FluidPressure",
    "sensor_msgs/Image",
    "sensor_msgs/JointState",
    "sensor_msgs/MagneticField",
    "sensor_msgs/MultiEchoLaserScan",
    "sensor_msgs/NavSatFix",
    "sensor_msgs/Range",
    "sensor_msgs/Temperature",
    "livox_ros_driver/CustomMsg",
    "livox_ros_driver2/CustomMsg",
];

/// Message type of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MessageType {
    /// `sensor_msgs/msg/LaserScan`.
    LaserScan,
    /// `sensor_msgs/msg/PointCloud2`.
    PointCloud2,
    /// `sensor_msgs/msg/MultiEchoLaserScan`; read only.
    MultiEchoLaserScan,
    /// `livox_ros_driver/msg/CustomMsg`; read only.
    Livox,
    /// `livox_ros_driver2/msg/CustomMsg`; read only.
    Livox2,
    /// `sensor_msgs/msg/Imu`.
    Imu,
    /// `sensor_msgs/msg/TimeReference`.
    TimeReference,
    /// `tf2_msgs/msg/TFMessage`.
    Transforms,
    /// `nav_msgs/msg/Odometry`.
    Odometry,
    /// `nav_msgs/msg/Path`.
    Path,
    /// `geometry_msgs/msg/PoseStamped`.
    PoseStamped,
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`.
    PoseWithCovariance,
}

impl MessageType {
    /// Full name, `package/msg/Type`.
    pub fn name(self) -> &'static str {
        match self {
            Self::LaserScan => "sensor_msgs/msg/LaserScan",
            Self::PointCloud2 => "sensor_msgs/msg/PointCloud2",
            Self::MultiEchoLaserScan => "sensor_msgs/msg/MultiEchoLaserScan",
            Self::Livox => "livox_ros_driver/msg/CustomMsg",
            Self::Livox2 => "livox_ros_driver2/msg/CustomMsg",
            Self::Imu => "sensor_msgs/msg/Imu",
            Self::TimeReference => "sensor_msgs/msg/TimeReference",
            Self::Transforms => "tf2_msgs/msg/TFMessage",
            Self::Odometry => "nav_msgs/msg/Odometry",
            Self::Path => "nav_msgs/msg/Path",
            Self::PoseStamped => "geometry_msgs/msg/PoseStamped",
            Self::PoseWithCovariance => "geometry_msgs/msg/PoseWithCovarianceStamped",
        }
    }

    /// The type of this name; `None` if zsim has no definition of it.
    pub fn named(name: &str) -> Option<Self> {
        let all = [
            Self::LaserScan,
            Self::PointCloud2,
            Self::Imu,
            Self::TimeReference,
            Self::Transforms,
            Self::Odometry,
            Self::Path,
            Self::PoseStamped,
            Self::PoseWithCovariance,
        ];
        all.into_iter().find(|kind| kind.is_named(name))
    }

    /// Whether `name` denotes this type; some writers omit `msg`.
    pub fn is_named(self, name: &str) -> bool {
        let full = self.name();
        name == full
            || full.split_once("/msg/").is_some_and(|(package, kind)| name.split_once('/') == Some((package, kind)))
    }

    /// Whether messages of the type `name` start with a header.
    pub fn has_header(name: &str) -> bool {
        let short = name.replace("/msg/", "/");
        fields_of(&short).starts_with("std_msgs/Header") || OTHER_TYPES_WITH_HEADER.contains(&short.as_str())
    }

    /// Definition with its dependencies in `ros2msg` format: each after a line of `=` and the type name.
    pub fn definition(self) -> String {
        let root = self.name().replace("/msg/", "/");
        let mut names = vec![root.as_str()];
        let mut text = String::new();
        let mut next = 0;
        while let Some(name) = names.get(next).copied() {
            if next > 0 {
                text.push_str(&format!("{}\nMSG: {name}\n", "=".repeat(80)));
            }
            let fields = fields_of(name);
            text.push_str(fields);
            for dependency in fields.lines().filter_map(type_of_field) {
                if !names.contains(&dependency) {
                    names.push(dependency);
                }
            }
            next += 1;
        }
        text
    }
}

fn fields_of(name: &str) -> &'static str {
    DEFINITIONS.iter().find(|(known, _)| *known == name).map_or("", |(_, fields)| fields)
}

/// Message type of a field; `None` if it is a primitive type.
fn type_of_field(line: &'static str) -> Option<&'static str> {
    let kind = line.split_whitespace().next()?;
    let kind = kind.split('[').next()?;
    kind.contains('/').then_some(kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_used_in_a_definition_is_defined() {
        for (name, fields) in DEFINITIONS {
            for dependency in fields.lines().filter_map(type_of_field) {
                assert!(!fields_of(dependency).is_empty(), "{name} uses {dependency}");
            }
        }
    }

    #[test]
    fn a_definition_contains_each_dependency_once() {
        let text = MessageType::Odometry.definition();
        for name in ["std_msgs/Header", "builtin_interfaces/Time", "geometry_msgs/Vector3", "geometry_msgs/Point"] {
            assert_eq!(text.matches(&format!("MSG: {name}\n")).count(), 1, "{name}");
        }
        assert!(text.starts_with("std_msgs/Header header\nstring child_frame_id\n"));
    }
}
