//! Which sensors are selected, why the others are not, and raw data that a driver has to convert.

use crate::recording::foreign::{
    FLOAT32, Foreign, IMU, Imu, LaserScan, POINTS, PointCloud2, PointField, SCAN, TF, UINT32, cloud, header, imu, scan,
    select, transform,
};
use zsim::recording::{Reader, Selection, TopicPreference};

const MS: i64 = 1_000_000;

fn reason<'s>(selection: &'s Selection, topic: &str) -> &'s str {
    let unused = selection.unused.iter().find(|unused| unused.topic == topic);
    unused.map_or_else(|| panic!("{topic}: {:?}", selection.unused), |unused| &unused.reason)
}

/// Small clouds with the fields of a radar.
fn radar(ns: i64) -> PointCloud2 {
    let mut cloud = cloud(ns, ("rcs", FLOAT32), &vec![0.5_f32.to_le_bytes().to_vec(); 5]);
    let field = PointField { name: "Doppler".into(), offset: 12, datatype: FLOAT32, count: 1 };
    cloud.fields.push(field);
    cloud.header = header(ns, "radar");
    cloud
}

fn times() -> Vec<Vec<u8>> {
    (0..50_u32).map(|k| (k * 1_000_000).to_le_bytes().to_vec()).collect()
}

#[test]
fn every_other_topic_has_a_reason() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    let tree = vec![transform("head", "imu", 0.0), transform("head", "os_lidar", 0.1), transform("head", "depth", 0.0)];
    foreign.message("/tf_static", TF, 0, &tree);
    for k in 0..40_i64 {
        let ns = k * 25 * MS;
        let zeros = Imu { angular_velocity: [0.0; 3], linear_acceleration: [0.0; 3], ..imu(ns, "chip") };
        let rates = Imu { linear_acceleration: [0.0; 3], ..imu(ns, "gyro") };
        foreign.message("/a/imu", IMU, ns, &zeros).message("/b/imu", IMU, ns, &rates);
        foreign.message("/imu/data", IMU, ns, &imu(ns, "imu")).message("/imu/data_raw", IMU, ns, &imu(ns, "imu"));
        foreign.message("/other/imu", IMU, ns, &imu(ns, "autopilot"));
        foreign.message("/points", POINTS, ns, &cloud(ns, ("t", UINT32), &times()));
        foreign.message("/a_radar", POINTS, ns, &radar(ns));
        let mut depth = cloud(ns, ("rgb", FLOAT32), &times());
        depth.header = header(ns, "depth");
        foreign.message("/a_depth", POINTS, ns, &depth);
        foreign.message("/a_scan", SCAN, ns, &LaserScan { header: header(ns, "shelf"), ..scan(ns, 0.001, 0.1) });
        let nothing = LaserScan { header: header(ns, "imu"), ranges: vec![f32::INFINITY; 10], ..scan(ns, 0.001, 0.1) };
        foreign.message("/a_blind", SCAN, ns, &nothing);
    }
    let reader = foreign.reader();
    let selection = select(&reader);
    assert_eq!((selection.lidar_topic.as_str(), selection.imu_topic.as_str()), ("/points", "/imu/data_raw"));
    for (topic, part) in [
        ("/a/imu", "zeros for acceleration and angular velocity"),
        ("/b/imu", "zeros for acceleration"),
        ("/imu/data", "the same IMU (frame imu); raw data are preferred"),
        ("/other/imu", "another IMU (frame autopilot)"),
        ("/a_radar", "those of a radar"),
        ("/a_depth", "its beams have no times"),
        ("/a_scan", "/tf_static does not connect its frame shelf"),
        ("/a_blind", "its messages have no returns"),
    ] {
        assert!(reason(&selection, topic).contains(part), "{topic}: {}", reason(&selection, topic));
    }
    assert_eq!(selection.unused.len(), 8, "{:?}", selection.unused);
    // A requested radar is used.
    let wanted = TopicPreference { lidar_topic: Some("/a_radar".into()), imu_topic: None };
    assert_eq!(reader.select(&wanted).unwrap().lidar_frame, "radar");
}

fn refused(reader: &Reader) -> String {
    reader.select(&TopicPreference::default()).unwrap_err().to_string()
}

#[test]
fn raw_data_are_refused_with_the_driver_that_converts_them() {
    for (kind, driver) in [
        ("velodyne_msgs/msg/VelodyneScan", "velodyne_pointcloud"),
        ("velodyne_msgs/VelodyneScan", "velodyne_pointcloud"),
        ("ouster_sensor_msgs/msg/PacketMsg", "ouster_ros"),
        ("ouster_ros/PacketMsg", "ouster_ros"),
        ("hesai_ros_driver/msg/UdpFrame", "hesai_ros_driver"),
        ("pandar_msgs/msg/PandarScan", "nebula"),
        ("rslidar_msg/msg/RslidarPacket", "rslidar_sdk"),
        ("sensor_msgs/msg/PointCloud", "point_cloud_converter"),
    ] {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, 0, &imu(0, "imu"));
        foreign.serialised("/driver/packets", kind, 0, &[0, 1, 0, 0, 1, 2, 3]);
        let error = refused(&foreign.reader());
        let expected = format!("/driver/packets has raw data ({kind}): play the recording into ");
        let parts = ["no lidar in the recording", &expected, driver];
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).serialised("/image", "sensor_msgs/msg/Image", 0, &[0, 1, 0, 0]);
    assert!(!refused(&foreign.reader()).contains("raw data"));
}
