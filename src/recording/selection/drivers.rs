//! Messages that a driver has to convert before an estimate can use them.

use crate::container::Channel;
use std::collections::BTreeMap;

/// Package and type of messages with raw data of a sensor, and what converts them.
///
/// A type of `*` is any type of the package.
const DRIVERS: [(&str, &str, &str); 22] = [
    ("velodyne_msgs", "*", "velodyne_pointcloud (velodyne_transform_node)"),
    ("ouster_ros", "PacketMsg", "ouster_ros (os_cloud, replay.launch)"),
    ("ouster_sensor_msgs", "PacketMsg", "ouster_ros (os_cloud, replay.launch.xml)"),
    ("pandar_msgs", "*", "hesai_lidar or nebula"),
    ("hesai_lidar", "*", "hesai_lidar"),
    ("hesai_ros_driver", "*", "hesai_ros_driver (source_type 3)"),
    ("nebula_msgs", "*", "nebula_ros"),
    ("rslidar_msg", "*", "rslidar_sdk (msg_source 2)"),
    ("rslidar_msgs", "*", "rslidar_pointcloud"),
    ("robosense_msgs", "*", "nebula_ros"),
    ("lslidar_msgs", "*", "lslidar_driver"),
    ("livox_interfaces", "*", "livox_ros2_driver (xfer_format 0), or convert the type to livox_ros_driver2/CustomMsg"),
    ("livox_sdk_msgs", "*", "livox_ros_driver2"),
    ("sick_scan_msgs", "*", "sick_scan_xd"),
    ("seyond", "SeyondPacket", "seyond_ros_driver"),
    ("innovusion", "*", "seyond_ros_driver"),
    ("blickfeld_msgs", "*", "blickfeld_driver"),
    ("udp_msgs", "UdpPacket", "the driver of the lidar"),
    ("sensor_msgs", "PointCloud", "point_cloud_converter (to PointCloud2)"),
    ("px4_msgs", "SensorCombined", "px4_ros_com (to sensor_msgs/Imu)"),
    ("novatel_oem7_msgs", "RAWIMU", "novatel_oem7_driver (/gps/imu, /imu/data_raw)"),
    ("novatel_oem7_msgs", "CORRIMU", "novatel_oem7_driver (/gps/imu, /imu/data_raw)"),
];

/// States which drivers convert the raw data of a recording; empty if there are none.
pub fn hint(channels: &[Channel]) -> String {
    let mut found: BTreeMap<&str, (&str, &str)> = BTreeMap::new();
    for channel in channels {
        let Some((package, kind)) = channel.type_name.split_once('/') else { continue };
        let kind = kind.trim_start_matches("msg/");
        let converts = |(of, name, _): &&(&str, &str, &str)| *of == package && (*name == "*" || *name == kind);
        if let Some((_, _, driver)) = DRIVERS.iter().find(converts) {
            found.entry(driver).or_insert((&channel.topic, &channel.type_name));
        }
    }
    let sentence = |(driver, (topic, kind)): (&&str, &(&str, &str))| {
        format!(
            ". {topic} has raw data ({kind}): play the recording into {driver} and record the topics that it publishes"
        )
    };
    found.iter().map(sentence).collect()
}
