//! Recordings of other programs: files by the `mcap` crate, messages by serde and `cdr-encoding`.

pub mod bag;

use mcap::records::MessageHeader;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Cursor;
use zsim::measurement::{LidarScan, Measurement};
use zsim::recording::{Reader, Selection, TopicPreference};

#[derive(Serialize, Clone)]
pub struct Header {
    pub sec: i32,
    pub nanosec: u32,
    pub frame_id: String,
}

pub fn header(stamp_ns: i64, frame: &str) -> Header {
    Header {
        sec: (stamp_ns / 1_000_000_000) as i32,
        nanosec: (stamp_ns % 1_000_000_000) as u32,
        frame_id: frame.to_owned(),
    }
}

#[derive(Serialize)]
pub struct Imu {
    pub header: Header,
    pub orientation: [f64; 4],
    pub orientation_covariance: [f64; 9],
    pub angular_velocity: [f64; 3],
    pub angular_velocity_covariance: [f64; 9],
    pub linear_acceleration: [f64; 3],
    pub linear_acceleration_covariance: [f64; 9],
}

pub fn imu(stamp_ns: i64, frame: &str) -> Imu {
    Imu {
        header: header(stamp_ns, frame),
        orientation: [0.0, 0.0, 0.0, 1.0],
        orientation_covariance: [0.0; 9],
        angular_velocity: [0.1, 0.2, 0.3],
        angular_velocity_covariance: [0.0; 9],
        linear_acceleration: [0.0, 0.1, 9.8],
        linear_acceleration_covariance: [0.0; 9],
    }
}

#[derive(Serialize)]
pub struct PointField {
    pub name: String,
    pub offset: u32,
    pub datatype: u8,
    pub count: u32,
}

#[derive(Serialize)]
pub struct PointCloud2 {
    pub header: Header,
    pub height: u32,
    pub width: u32,
    pub fields: Vec<PointField>,
    pub is_bigendian: bool,
    pub point_step: u32,
    pub row_step: u32,
    pub data: Vec<u8>,
    pub is_dense: bool,
}

pub const FLOAT32: u8 = 7;
pub const FLOAT64: u8 = 8;
pub const UINT32: u8 = 6;

/// A cloud of points at (1, 2, 3 + k) with the times `times`, serialised as the type `kind`.
pub fn cloud(stamp_ns: i64, (name, kind): (&str, u8), times: &[Vec<u8>]) -> PointCloud2 {
    let size = times[0].len() as u32;
    let names = [("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), (name, 16, kind)];
    let field =
        |(name, offset, datatype): (&str, u32, u8)| PointField { name: name.to_owned(), offset, datatype, count: 1 };
    let step = 16 + size;
    let mut data = Vec::new();
    for (k, time) in times.iter().enumerate() {
        for value in [1.0, 2.0, 3.0 + k as f32, 0.0] {
            data.extend(value.to_le_bytes());
        }
        data.extend(time);
    }
    PointCloud2 {
        header: header(stamp_ns, "os_lidar"),
        height: 1,
        width: times.len() as u32,
        fields: names.map(field).into(),
        is_bigendian: false,
        point_step: step,
        row_step: step * times.len() as u32,
        data,
        is_dense: true,
    }
}

#[derive(Serialize)]
pub struct LaserScan {
    pub header: Header,
    pub angles: [f32; 3],
    pub time_increment: f32,
    pub scan_time: f32,
    pub range: [f32; 2],
    pub ranges: Vec<f32>,
    pub intensities: Vec<f32>,
}

#[derive(Serialize)]
pub struct TransformStamped {
    pub header: Header,
    pub child: String,
    pub translation: [f64; 3],
    pub rotation: [f64; 4],
}

pub fn transform(parent: &str, child: &str, x: f64) -> TransformStamped {
    let translation = [x, 0.0, 0.0];
    TransformStamped { header: header(0, parent), child: child.to_owned(), translation, rotation: [0.0, 0.0, 0.0, 1.0] }
}

pub fn cdr(message: &impl Serialize) -> Vec<u8> {
    cdr::serialize::<_, _, cdr::CdrLe>(message, cdr::Infinite).unwrap()
}

/// Writes files with the `mcap` crate.
pub struct Foreign {
    pub writer: mcap::Writer<Cursor<Vec<u8>>>,
    pub channels: BTreeMap<String, u16>,
}

impl Foreign {
    pub fn new(options: mcap::WriteOptions) -> Self {
        Self { writer: options.create(Cursor::new(Vec::new())).unwrap(), channels: BTreeMap::new() }
    }

    pub fn message(&mut self, topic: &str, kind: &str, log_ns: i64, message: &impl Serialize) -> &mut Self {
        self.serialised(topic, kind, log_ns, &cdr(message))
    }

    pub fn serialised(&mut self, topic: &str, kind: &str, log_ns: i64, message: &[u8]) -> &mut Self {
        let id = match self.channels.get(topic) {
            Some(id) => *id,
            None => {
                let text = b"std_msgs/Header header\n";
                let schema = self.writer.add_schema(kind, "ros2msg", text).unwrap();
                self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
            }
        };
        self.channels.insert(topic.to_owned(), id);
        let log_time = log_ns as u64;
        let header = MessageHeader { channel_id: id, sequence: 0, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, message).unwrap();
        self
    }

    pub fn reader(mut self) -> Reader {
        self.writer.finish().unwrap();
        Reader::new("foreign", Cursor::new(self.writer.into_inner().into_inner())).unwrap()
    }
}

pub const IMU: &str = "sensor_msgs/msg/Imu";
pub const POINTS: &str = "sensor_msgs/msg/PointCloud2";
pub const SCAN: &str = "sensor_msgs/msg/LaserScan";
pub const TF: &str = "tf2_msgs/msg/TFMessage";

pub fn select(reader: &Reader) -> Selection {
    reader.select(&TopicPreference::default()).unwrap()
}

pub fn scans(reader: &Reader) -> Vec<LidarScan> {
    let selection = select(reader);
    let measurements = reader.measurements(&selection).map(|m| m.unwrap());
    measurements.filter_map(|m| if let Measurement::Lidar(scan) = m { Some(scan) } else { None }).collect()
}

/// Ten beams 0.1 rad apart; the third has no return, the fourth is too close.
pub fn scan(stamp_ns: i64, time_increment: f32, scan_time: f32) -> LaserScan {
    let mut ranges = vec![2.0; 10];
    (ranges[2], ranges[3], ranges[4], ranges[5]) = (f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.01);
    LaserScan {
        header: header(stamp_ns, "laser"),
        angles: [0.0, 0.9, 0.1],
        time_increment,
        scan_time,
        range: [0.1, 30.0],
        ranges,
        intensities: Vec::new(),
    }
}
