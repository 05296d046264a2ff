//! Parses arbitrary bytes as a message of each type, in ROS 2 or ROS 1 serialisation.
//!
//! The message follows an IMU sample and a scan in a valid file.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::io::Cursor;
use zsim_fuzz::read_all;

const TOPICS: [(&str, &str); 8] = [
    ("/scan", "sensor_msgs/msg/LaserScan"),
    ("/points", "sensor_msgs/msg/PointCloud2"),
    ("/imu/data", "sensor_msgs/msg/Imu"),
    ("/tf_static", "tf2_msgs/msg/TFMessage"),
    ("/ground_truth/pose", "geometry_msgs/msg/PoseStamped"),
    ("/ground_truth/clock", "sensor_msgs/msg/TimeReference"),
    ("/echoes", "sensor_msgs/msg/MultiEchoLaserScan"),
    ("/livox", "livox_ros_driver2/msg/CustomMsg"),
];

fn string(into: &mut Vec<u8>, text: &str) {
    into.extend((text.len() as u32).to_le_bytes());
    into.extend(text.as_bytes());
}

fn record(into: &mut Vec<u8>, opcode: u8, fields: &[u8]) {
    into.push(opcode);
    into.extend((fields.len() as u64).to_le_bytes());
    into.extend(fields);
}

fn define(file: &mut Vec<u8>, id: u16, (topic, kind): (&str, &str), encoding: &str) {
    let mut schema = id.to_le_bytes().to_vec();
    string(&mut schema, kind);
    string(&mut schema, "ros2msg");
    string(&mut schema, "std_msgs/Header header\n");
    record(file, 3, &schema);
    let mut channel = [id.to_le_bytes(), id.to_le_bytes()].concat();
    string(&mut channel, topic);
    string(&mut channel, encoding);
    channel.extend(0_u32.to_le_bytes());
    record(file, 4, &channel);
}

fn message(file: &mut Vec<u8>, id: u16, encoding: &str, data: &[u8]) {
    let mut fields = id.to_le_bytes().to_vec();
    fields.extend([0; 20]);
    // The little-endian CDR header is given, so that the fuzzer need not find it.
    if encoding == "cdr" {
        fields.extend([0, 1, 0, 0]);
    }
    fields.extend(data);
    record(file, 5, &fields);
}

fuzz_target!(|data: &[u8]| {
    let Some((kind, data)) = data.split_first() else { return };
    let encoding = if *kind < 128 { "cdr" } else { "ros1" };
    let mut file = b"\x89MCAP0\r\n".to_vec();
    for (id, topic) in (1..).zip(TOPICS) {
        define(&mut file, id, topic, encoding);
    }
    // An IMU sample and an empty scan, all zeros, so that topics can be selected.
    message(&mut file, 3, encoding, &[0; 400]);
    message(&mut file, 1, encoding, &[0; 64]);
    message(&mut file, u16::from(kind % TOPICS.len() as u8) + 1, encoding, data);
    read_all(Cursor::new(file));
});
