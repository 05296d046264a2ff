//! Recordings by other programs: other topics, kinds of messages, compression and order.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod recordings;

use mcap::records::MessageHeader;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Cursor;
use zsim::geometry::Pose;
use zsim::measurement::{LidarScan, Measurement};
use zsim::recording::{Preference, Reader, Selection};
use zsim::time::{Span, Stamp};

// Messages by another implementation of CDR than the one under test: serde and `cdr-encoding`.

#[derive(Serialize, Clone)]
struct Header {
    sec: i32,
    nanosec: u32,
    frame_id: String,
}

fn header(stamp_ns: i64, frame: &str) -> Header {
    Header {
        sec: (stamp_ns / 1_000_000_000) as i32,
        nanosec: (stamp_ns % 1_000_000_000) as u32,
        frame_id: frame.to_owned(),
    }
}

#[derive(Serialize)]
struct Imu {
    header: Header,
    orientation: [f64; 4],
    orientation_covariance: [f64; 9],
    angular_velocity: [f64; 3],
    angular_velocity_covariance: [f64; 9],
    linear_acceleration: [f64; 3],
    linear_acceleration_covariance: [f64; 9],
}

fn imu(stamp_ns: i64, frame: &str) -> Imu {
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
struct PointField {
    name: String,
    offset: u32,
    datatype: u8,
    count: u32,
}

#[derive(Serialize)]
struct PointCloud2 {
    header: Header,
    height: u32,
    width: u32,
    fields: Vec<PointField>,
    is_bigendian: bool,
    point_step: u32,
    row_step: u32,
    data: Vec<u8>,
    is_dense: bool,
}

const FLOAT32: u8 = 7;
const FLOAT64: u8 = 8;
const UINT32: u8 = 6;

/// A cloud of points at (1, 2, 3 + k) whose times are `times`, already in bytes of the type `kind`.
fn cloud(stamp_ns: i64, (name, kind): (&str, u8), times: &[Vec<u8>]) -> PointCloud2 {
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
struct LaserScan {
    header: Header,
    angles: [f32; 3],
    time_increment: f32,
    scan_time: f32,
    range: [f32; 2],
    ranges: Vec<f32>,
    intensities: Vec<f32>,
}

#[derive(Serialize)]
struct TransformStamped {
    header: Header,
    child: String,
    translation: [f64; 3],
    rotation: [f64; 4],
}

fn transform(parent: &str, child: &str, x: f64) -> TransformStamped {
    let translation = [x, 0.0, 0.0];
    TransformStamped { header: header(0, parent), child: child.to_owned(), translation, rotation: [0.0, 0.0, 0.0, 1.0] }
}

fn cdr(message: &impl Serialize) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(cdr_encoding::to_vec::<_, byteorder::LittleEndian>(message).unwrap());
    bytes
}

/// Writes files with the `mcap` crate.
struct Foreign {
    writer: mcap::Writer<Cursor<Vec<u8>>>,
    channels: BTreeMap<String, u16>,
}

impl Foreign {
    fn new(options: mcap::WriteOptions) -> Self {
        Self { writer: options.create(Cursor::new(Vec::new())).unwrap(), channels: BTreeMap::new() }
    }

    fn message(&mut self, topic: &str, kind: &str, log_ns: i64, message: &impl Serialize) -> &mut Self {
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
        self.writer.write_to_known_channel(&header, &cdr(message)).unwrap();
        self
    }

    fn reader(mut self) -> Reader {
        self.writer.finish().unwrap();
        Reader::new("foreign", Cursor::new(self.writer.into_inner().into_inner())).unwrap()
    }
}

const IMU: &str = "sensor_msgs/msg/Imu";
const POINTS: &str = "sensor_msgs/msg/PointCloud2";
const SCAN: &str = "sensor_msgs/msg/LaserScan";
const TF: &str = "tf2_msgs/msg/TFMessage";

fn select(reader: &Reader) -> Selection {
    reader.select(&Preference::default()).unwrap()
}

fn scans(reader: &Reader) -> Vec<LidarScan> {
    let selection = select(reader);
    let measurements = reader.measurements(&selection).map(|m| m.unwrap());
    measurements.filter_map(|m| if let Measurement::Lidar(scan) = m { Some(scan) } else { None }).collect()
}

#[test]
fn compression_and_chunks_make_no_difference() {
    let read = |options: mcap::WriteOptions| {
        let mut foreign = Foreign::new(options);
        for k in 0..200_i64 {
            foreign.message("/sensors/imu/data", IMU, k * 10_000_000, &imu(k * 10_000_000, "imu"));
            let times: Vec<_> = (0..100_u32).map(|k| (k * 1000).to_le_bytes().to_vec()).collect();
            foreign.message("/ouster/points", POINTS, k * 10_000_000, &cloud(k * 10_000_000, ("t", UINT32), &times));
        }
        let reader = foreign.reader();
        let selection = select(&reader);
        assert_eq!((&*selection.lidar_topic, &*selection.imu_topic), ("/ouster/points", "/sensors/imu/data"));
        let mut measurements = reader.measurements(&selection);
        let all: Vec<_> = measurements.by_ref().map(|m| m.unwrap()).collect();
        assert!(measurements.loss().is_none(), "{}", measurements.loss());
        all
    };
    let options = || mcap::WriteOptions::new().compression(None);
    let plain = read(options());
    assert_eq!(plain.len(), 400);
    assert_eq!(plain, read(options().compression(Some(mcap::Compression::Zstd)).chunk_size(Some(9000))));
    assert_eq!(plain, read(options().use_chunks(false)));
    assert_eq!(plain, read(options().emit_summary_records(false).emit_message_indexes(false)));
    assert_eq!(plain, read(options().calculate_chunk_crcs(false).calculate_summary_section_crc(false)));
}

#[test]
fn lz4_chunks_are_read() {
    // The chunk of a file without compression is packed by the lz4 crate's own frame format, and put in its place.
    let mut foreign = Foreign::new(mcap::WriteOptions::new().compression(None).emit_summary_records(false));
    foreign.message("/imu", IMU, 1, &imu(1, "imu")).message("/scan", SCAN, 2, &scan(2, 0.001, 0.1));
    foreign.writer.finish().unwrap();
    let plain = foreign.writer.into_inner().into_inner();
    let length = |at: usize| u64::from_le_bytes(plain[at..at + 8].try_into().unwrap());
    let start = 8 + 9 + length(8 + 1) as usize;
    assert_eq!(plain[start], 6, "the record after the header is the chunk");
    let size = length(start + 9 + 16);
    // Two times, a size, a CRC, the length of no name, a size: 40 bytes before the data.
    let data = &plain[start + 9 + 40..start + 9 + 40 + size as usize];
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    std::io::Write::write_all(&mut encoder, data).unwrap();
    let packed = encoder.finish().unwrap();
    let mut file = plain[..start].to_vec();
    let mut record = plain[start + 9..start + 9 + 28].to_vec();
    record.extend(3_u32.to_le_bytes());
    record.extend(b"lz4");
    record.extend((packed.len() as u64).to_le_bytes());
    record.extend(&packed);
    file.push(6);
    file.extend((record.len() as u64).to_le_bytes());
    file.extend(record);
    let reader = Reader::new("lz4", Cursor::new(file)).unwrap();
    assert_eq!(scans(&reader).len(), 1);
}

/// Ten beams over a tenth of a radian each; the third did not come back, the fourth is too near.
fn scan(stamp_ns: i64, time_increment: f32, scan_time: f32) -> LaserScan {
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

#[test]
fn messages_that_were_written_topic_after_topic_come_in_the_order_of_time() {
    let options = mcap::WriteOptions::new().chunk_size(Some(5000));
    let mut foreign = Foreign::new(options);
    for k in 0..500 {
        foreign.message("/imu", IMU, k * 10, &imu(k * 10, "imu"));
    }
    for k in 0..100 {
        foreign.message("/scan", SCAN, k * 50, &scan(k * 50, 0.001, 0.1));
    }
    let reader = foreign.reader();
    let selection = select(&reader);
    let stamps: Vec<_> = reader
        .measurements(&selection)
        .map(|m| match m.unwrap() {
            Measurement::Imu(sample) => sample.stamp,
            Measurement::Lidar(scan) => scan.stamp,
        })
        .collect();
    assert_eq!(stamps.len(), 600);
    assert!(stamps.is_sorted());
}

#[test]
fn beams_without_a_return_are_told_by_rep_117() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/scan", SCAN, 0, &scan(0, 0.001, 0.1));
    let scans = scans(&foreign.reader());
    let offsets: Vec<_> = scans[0].returns.iter().map(|r| r.offset.nanos()).collect();
    // The time increment is a 32-bit float: 1 ms to 47 ps.
    assert_eq!(offsets, [0, 1_000_000, 6_000_000, 7_000_000, 8_000_000, 9_000_000]);
    // Beam 6 points 0.6 rad to the left.
    let p = scans[0].returns[2].point_in_laser;
    assert!((p.x - 2.0 * 0.6_f32.cos()).abs() < 1e-6 && (p.y - 2.0 * 0.6_f32.sin()).abs() < 1e-6 && p.z == 0.0);
    assert_eq!(scans[0].planar.as_ref().unwrap().ranges_m.len(), 10);
}

#[test]
fn a_scan_without_times_is_read_with_a_note() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/front", SCAN, 0, &scan(0, 0.0, 0.1));
    let reader = foreign.reader();
    assert!(select(&reader).notes[0].starts_with("/front tells no time between beams; an even turn"));
    // 0.1 rad of a turn that takes 0.1 s: 0.1 / (2 pi) * 0.1 s = 1.591549 ms.
    assert_eq!(scans(&reader)[0].returns[1].offset.nanos(), 1_591_549);
}

#[test]
fn every_way_to_tell_a_points_time_gives_the_same_scan() {
    let stamp_ns = 1_700_000_000_250_000_000_i64;
    let stamp_s = stamp_ns as f64 * 1e-9;
    let at = |k: usize| k as f64 * 1e-3;
    let f32s =
        |f: &dyn Fn(usize) -> f64| -> Vec<Vec<u8>> { (0..50).map(|k| (f(k) as f32).to_le_bytes().to_vec()).collect() };
    let f64s = |f: &dyn Fn(usize) -> f64| -> Vec<Vec<u8>> { (0..50).map(|k| f(k).to_le_bytes().to_vec()).collect() };
    let u32s = |f: &dyn Fn(usize) -> u32| -> Vec<Vec<u8>> { (0..50).map(|k| f(k).to_le_bytes().to_vec()).collect() };
    let ways = [
        ("t", UINT32, u32s(&|k| k as u32 * 1_000_000)),
        ("offset_time", UINT32, u32s(&|k| k as u32 * 1_000_000)),
        ("time", FLOAT32, f32s(&at)),
        ("timestamp", FLOAT64, f64s(&|k| stamp_s + at(k))),
        ("timestamp", FLOAT64, f64s(&|k| stamp_ns as f64 + k as f64 * 1e6)),
        ("timestamp", FLOAT64, f64s(&|k| (stamp_s + at(k)) * 1e6)),
        ("t", FLOAT32, f32s(&|k| at(k) * 1e9)),
    ];
    for (name, kind, times) in ways {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, stamp_ns, &imu(stamp_ns, "imu"));
        foreign.message("/points", POINTS, stamp_ns, &cloud(stamp_ns, (name, kind), &times));
        let scan = &scans(&foreign.reader())[0];
        assert_eq!(scan.returns.len(), 50, "{name} {kind}");
        for (k, point) in scan.returns.iter().enumerate() {
            let stamp = scan.stamp + point.offset;
            // A double of seconds since 1970 holds 0.24 us.
            let off_ns = (stamp - Stamp::from_nanos(stamp_ns + k as i64 * 1_000_000)).nanos();
            assert!(off_ns.abs() < 500, "{name} {kind}: point {k} is off by {off_ns} ns");
            assert_eq!(point.point_in_laser.z, 3.0 + k as f32);
        }
    }
}

#[test]
fn a_cloud_stamped_at_its_end_begins_with_its_first_point() {
    // Velodyne's driver stamps the last packet: times are negative seconds. Rows are rings, so times go up and down.
    let times: Vec<_> = [-0.09_f32, -0.05, 0.0, -0.10, -0.04].iter().map(|t| t.to_le_bytes().to_vec()).collect();
    let stamp_ns = 1_700_000_000_000_000_000;
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, stamp_ns, &imu(stamp_ns, "imu"));
    foreign.message("/velodyne_points", POINTS, stamp_ns, &cloud(stamp_ns, ("time", FLOAT32), &times));
    let scan = &scans(&foreign.reader())[0];
    assert!((scan.stamp - Stamp::from_nanos(stamp_ns - 100_000_000)).nanos().abs() < 10);
    let zs: Vec<_> = scan.returns.iter().map(|r| r.point_in_laser.z).collect();
    assert_eq!(zs, [6.0, 3.0, 4.0, 7.0, 5.0]);
    assert_eq!(scan.returns[0].offset, Span::ZERO);
}

#[test]
fn times_in_a_simulation_that_starts_at_zero_are_told_apart() {
    // Absolute seconds, small because the clock is: at 2.0 s, points from 2.00 to 2.09 s.
    for (stamp_ns, first_s) in [(2_000_000_000_i64, 2.0), (0, 0.0), (50_000_000, 0.05)] {
        let times: Vec<_> = (0..10).map(|k| (first_s + 0.01 * f64::from(k)).to_le_bytes().to_vec()).collect();
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, 0, &imu(0, "imu"));
        foreign.message("/points", POINTS, 0, &cloud(stamp_ns, ("timestamp", FLOAT64), &times));
        let scan = &scans(&foreign.reader())[0];
        assert_eq!(scan.stamp.nanos(), stamp_ns);
        assert_eq!(scan.returns[9].offset.nanos(), 90_000_000);
    }
}

#[test]
fn a_scan_with_times_is_preferred_and_other_sensors_are_named() {
    let times: Vec<_> = (0..3_u32).map(|k| k.to_le_bytes().to_vec()).collect();
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/points", POINTS, 0, &cloud(0, ("t", UINT32), &times));
    foreign.message("/untimed", SCAN, 0, &scan(0, 0.0, 0.0));
    foreign.message("/b/imu/data", IMU, 0, &imu(0, "b")).message("/a/imu/data", IMU, 0, &imu(0, "a"));
    foreign.message("/imu/data_raw", IMU, 0, &imu(0, "c"));
    foreign.message("/ground_truth/imu", IMU, 0, &imu(0, "truth"));
    let reader = foreign.reader();
    let selection = select(&reader);
    assert_eq!((&*selection.lidar_topic, &*selection.imu_topic), ("/points", "/imu/data_raw"));
    assert_eq!(
        selection.notes,
        [
            "Of several lidar topics, /points is read, not /untimed.",
            "Of several IMU topics, /imu/data_raw is read, not /a/imu/data, /b/imu/data."
        ]
    );
    let asked = Preference { lidar_topic: Some("/untimed".into()), imu_topic: Some("/b/imu/data".into()) };
    let selection = reader.select(&asked).unwrap();
    assert_eq!((&*selection.lidar_topic, &*selection.imu_frame), ("/untimed", "b"));
    let wrong = Preference { lidar_topic: Some("/velodyne".into()), imu_topic: None };
    let error = reader.select(&wrong).unwrap_err().to_string();
    assert!(error.starts_with("foreign: topic /velodyne is not there as sensor_msgs/msg/LaserScan or"), "{error}");
}

#[test]
fn a_recording_without_an_imu_is_refused_with_what_it_has() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1));
    let error = foreign.reader().select(&Preference::default()).unwrap_err().to_string();
    let expected = "foreign: no IMU in the recording (sensor_msgs/msg/Imu); it has /scan (sensor_msgs/msg/LaserScan)";
    assert_eq!(error, expected);
}

#[test]
fn samples_that_are_not_finite_are_left_out_and_counted() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
    let broken = Imu { linear_acceleration: [f64::NAN, 0.0, 0.0], ..imu(1, "imu") };
    foreign.message("/imu", IMU, 1, &broken).message("/imu", IMU, 2, &header(2, "imu"));
    let reader = foreign.reader();
    let selection = select(&reader);
    let mut measurements = reader.measurements(&selection);
    assert_eq!(measurements.by_ref().count(), 2);
    assert_eq!((measurements.loss().samples_not_finite, measurements.loss().unreadable_messages), (1, 1));
}

#[test]
fn extrinsics_are_found_along_any_way_through_the_tree() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    // base -> mast -> laser, base -> box -> imu: x adds up along each way.
    let tree = vec![transform("base", "mast", 1.0), transform("mast", "laser", 0.25), transform("base", "box", -2.0)];
    foreign.message("/tf_static", TF, 0, &tree).message("/tf_static", TF, 0, &vec![transform("box", "imu", 0.5)]);
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "/imu"));
    let reader = foreign.reader();
    let selection = select(&reader);
    let of = |body: Option<&str>| reader.calibration(&selection, &recordings::calibration(), body);
    let found = of(None).unwrap();
    // Without a frame `head`, the IMU is the body: the laser lies at 1.25 - (-1.5) in it.
    assert_eq!(found.body_frame, "imu");
    assert_eq!(found.calibration.head_from_laser, Pose::translation(2.75, 0.0, 0.0));
    assert_eq!(found.calibration.head_from_imu, Pose::identity());
    assert_eq!(of(Some("mast")).unwrap().calibration.head_from_imu, Pose::translation(-2.5, 0.0, 0.0));
    let error = of(Some("gripper")).unwrap_err().to_string();
    assert!(error.starts_with("foreign: /tf_static does not connect frame laser to gripper; it has"), "{error}");
}

#[test]
fn a_tree_that_goes_in_a_circle_or_forks_upwards_is_an_error() {
    let with_tree = |tree: Vec<TransformStamped>| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/tf_static", TF, 0, &tree);
        foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
        let reader = foreign.reader();
        reader.calibration(&select(&reader), &recordings::calibration(), None).unwrap_err().to_string()
    };
    let circle = with_tree(vec![transform("laser", "imu", 1.0), transform("imu", "laser", 1.0)]);
    assert!(circle.contains("does not connect frame laser to imu"), "{circle}");
    let fork = with_tree(vec![transform("a", "imu", 1.0), transform("b", "imu", 1.0)]);
    assert!(fork.contains("gives frame imu two parents, a and b"), "{fork}");
}

#[test]
fn a_recording_without_tf_static_takes_the_defaults_and_says_so() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
    let reader = foreign.reader();
    let found = reader.calibration(&select(&reader), &recordings::calibration(), None).unwrap();
    assert_eq!(found.calibration, recordings::calibration());
    assert!(!found.from_recording);
}
