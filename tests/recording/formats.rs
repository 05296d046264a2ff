//! ROS 1 bags and rosbag2 databases give the same measurements as an MCAP file with the same messages.

use crate::recording::foreign::bag::{Logged, Ros1, bag, database};
use crate::recording::foreign::{Foreign, IMU, POINTS, SCAN, TF, UINT32, cdr, cloud, imu, scan, select, transform};
use std::io::Cursor;
use zsim::geometry::Pose;
use zsim::measurement::{Calibration, ImuAveraging, ImuNoise, LidarNoise, Measurement};
use zsim::recording::{Loss, Reader, TopicPreference};
use zsim::time::Span;

/// Start time, ns: ROS 1 times are unsigned 32-bit seconds since 1970.
const START_NS: i64 = 1_700_000_000_000_000_000;

pub const TOPICS: [(&str, &str); 4] = [("/imu/data", IMU), ("/scan", SCAN), ("/points", POINTS), ("/tf_static", TF)];
pub const ROS_1_TOPICS: [(&str, &str); 4] = [
    ("/imu/data", "sensor_msgs/Imu"),
    ("/scan", "sensor_msgs/LaserScan"),
    ("/points", "sensor_msgs/PointCloud2"),
    ("/tf_static", "tf2_msgs/TFMessage"),
];

fn point_times() -> Vec<Vec<u8>> {
    (0..20_u32).map(|k| (k * 1_000_000).to_le_bytes().to_vec()).collect()
}

/// Topic index and log time of each message: an IMU at 100 Hz, a scan and a cloud at 10 Hz.
fn schedule() -> Vec<(usize, i64)> {
    let mut schedule = vec![(3, START_NS)];
    for k in 0..100 {
        schedule.push((0, START_NS + k * 10_000_000));
        if k % 10 == 0 {
            schedule.extend([(1, START_NS + k * 10_000_000 + 1), (2, START_NS + k * 10_000_000 + 2)]);
        }
    }
    schedule
}

pub fn ros_2_messages() -> Vec<Logged> {
    let bytes = |topic: usize, ns: i64| match topic {
        0 => cdr(&imu(ns, "imu")),
        1 => cdr(&scan(ns, 0.001, 0.1)),
        2 => cdr(&cloud(ns, ("t", UINT32), &point_times())),
        _ => cdr(&vec![transform("imu", "laser", 0.5), transform("imu", "os_lidar", 0.25)]),
    };
    schedule().into_iter().map(|(topic, ns)| (topic, ns, bytes(topic, ns))).collect()
}

pub fn ros_1_messages() -> Vec<Logged> {
    let transform = |message: Ros1, child: &str, x: f64| {
        message.u32(0).u32(0).u32(0).string("imu").string(child).f64s(&[x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    };
    let bytes = |topic: usize, ns: i64| match topic {
        0 => {
            let message = Ros1::header(ns, "imu").f64s(&[0.0, 0.0, 0.0, 1.0]).f64s(&[0.0; 9]);
            message.f64s(&[0.1, 0.2, 0.3]).f64s(&[0.0; 9]).f64s(&[0.0, 0.1, 9.8]).f64s(&[0.0; 9])
        }
        1 => {
            let scan = scan(ns, 0.001, 0.1);
            let message = Ros1::header(ns, "laser").f32s(&scan.angles).f32s(&[0.001, 0.1]).f32s(&scan.range);
            message.u32(10).f32s(&scan.ranges).u32(0)
        }
        2 => {
            let cloud = cloud(ns, ("t", UINT32), &point_times());
            let mut message = Ros1::header(ns, "os_lidar").u32(cloud.height).u32(cloud.width).u32(4);
            for field in &cloud.fields {
                message = message.string(&field.name).u32(field.offset).bytes(&[field.datatype]).u32(1);
            }
            let message = message.bytes(&[0]).u32(cloud.point_step).u32(cloud.row_step);
            message.u32(cloud.data.len() as u32).bytes(&cloud.data).bytes(&[1])
        }
        _ => transform(transform(Ros1::default().u32(2), "laser", 0.5), "os_lidar", 0.25),
    };
    schedule().into_iter().map(|(topic, ns)| (topic, ns, bytes(topic, ns).0)).collect()
}

fn calibration() -> Calibration {
    Calibration {
        head_from_laser: Pose::identity(),
        head_from_imu: Pose::identity(),
        imu: ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 1e-4,
            accel_density_m_per_s2_per_sqrt_hz: 1e-3,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 1e-5,
            accel_bias_walk_m_per_s2_per_sqrt_s: 1e-4,
            gyro_turn_on_bias_rad_per_s: 0.01,
            accel_turn_on_bias_m_per_s2: 0.1,
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: 10.0,
            accel_limit_m_per_s2: 100.0,
        },
        imu_averaging: ImuAveraging::ConingCorrected,
        lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
    }
}

/// Drops the polar form, whose NaN ranges cannot be compared.
fn without_polar_form(mut measurement: Measurement) -> Measurement {
    if let Measurement::Lidar(scan) = &mut measurement {
        scan.planar = None;
    }
    measurement
}

/// All measurements with each lidar, and the scanner's position relative to the IMU.
pub fn content(reader: &Reader) -> (Vec<Measurement>, f64) {
    let mut all = Vec::new();
    for topic in ["/scan", "/points"] {
        let preference = TopicPreference { lidar_topic: Some(topic.into()), imu_topic: None };
        let selection = reader.select(&preference).unwrap();
        let mut measurements = reader.measurements(&selection);
        all.extend(measurements.by_ref().map(|m| without_polar_form(m.unwrap())));
        let loss = Loss { damaged_summary: false, cut_short: false, ..measurements.loss().clone() };
        assert!(loss.is_none() || reader.loss().lost_bytes > 0, "{loss}");
    }
    let found = reader.calibration(&select(reader), &calibration(), None).unwrap();
    (all, found.calibration.head_from_laser.translation.x)
}

/// Content of a file that the `mcap` crate writes with the same messages.
pub fn expected() -> (Vec<Measurement>, f64) {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for (topic, ns, bytes) in ros_2_messages() {
        let (name, kind) = TOPICS[topic];
        foreign.serialised(name, kind, ns, &bytes);
    }
    let content = content(&foreign.reader());
    assert_eq!((content.0.len(), content.1), (220, 0.5));
    content
}

#[test]
fn a_ros_1_bag_is_read_with_any_compression() {
    let expected = expected();
    for (compression, indexed) in [("none", true), ("lz4", true), ("bz2", true), ("none", false), ("bz2", false)] {
        let bytes = bag(&ROS_1_TOPICS, &ros_1_messages(), compression, indexed);
        let reader = Reader::new("run.bag", Cursor::new(bytes)).unwrap();
        assert_eq!(reader.loss().cut_short, !indexed, "{compression}");
        let info = reader.info(Span::from_seconds(0.5)).unwrap();
        // The stamps are the log times; a header of ROS 1 begins with a sequence number.
        let clocks: Vec<f64> = info.topics.iter().filter_map(|topic| Some(topic.clock?.offset_s)).collect();
        assert!(clocks.len() > 1 && clocks.iter().all(|offset_s| offset_s.abs() < 1e-6), "{clocks:?}");
        assert_eq!((info.messages, info.topics.len()), (121, 4), "{compression}");
        if indexed {
            assert!(info.loss.is_none(), "{}", info.loss);
            assert_eq!(content(&reader), expected, "{compression}");
        }
    }
}

#[test]
fn a_truncated_bag_loses_only_its_end() {
    let whole = bag(&ROS_1_TOPICS, &ros_1_messages(), "none", true);
    let mut before = 0;
    for cut in (0..whole.len()).step_by(997) {
        let Ok(reader) = Reader::new("cut.bag", Cursor::new(whole[..cut].to_vec())) else {
            assert!(cut < 16, "cut at {cut}");
            continue;
        };
        assert!(reader.loss().cut_short, "cut at {cut}");
        let messages = reader.info(Span::from_seconds(0.5)).unwrap().messages;
        assert!(messages >= before, "cut at {cut}: {messages} messages after {before}");
        before = messages;
    }
    assert_eq!(before, 121);
}

#[test]
fn a_damaged_bag_is_read_without_its_damaged_parts() {
    let whole = bag(&ROS_1_TOPICS, &ros_1_messages(), "none", true);
    let mut random = 12345_u64;
    for _ in 0..300 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let mut bytes = whole.clone();
        let at = 13 + (random >> 33) as usize % (bytes.len() - 13);
        bytes[at] ^= 0x55;
        if let Ok(reader) = Reader::new("damaged.bag", Cursor::new(bytes)) {
            let messages = reader.info(Span::from_seconds(0.5)).unwrap().messages;
            // Damages the header with the position of the index, or one chunk of ten messages.
            assert!(messages >= 100, "{messages} messages with byte {at} damaged");
        }
    }
}

#[test]
fn single_split_and_compressed_rosbag2_databases_are_read() {
    let expected = expected();
    let (messages, folder) = (ros_2_messages(), tempfile::tempdir().unwrap());
    for compressed in [false, true] {
        let file = folder.path().join(format!("alone_{compressed}.db3"));
        database(&file, &TOPICS, &messages, compressed);
        assert_eq!(content(&Reader::open(&file).unwrap()), expected, "compressed: {compressed}");
        let bytes = std::fs::read(&file).unwrap();
        assert_eq!(content(&Reader::new("in memory", Cursor::new(bytes)).unwrap()), expected);
    }
    let split = tempfile::tempdir().unwrap();
    let (first, second) = messages.split_at(50);
    // Each file has only its own topics, in its own order: ids differ between files.
    database(&split.path().join("run_9.db3"), &TOPICS, first, false);
    let turned: Vec<_> = TOPICS.into_iter().rev().collect();
    let second: Vec<_> = second.iter().map(|(topic, ns, bytes)| (3 - topic, *ns, bytes.clone())).collect();
    database(&split.path().join("run_10.db3"), &turned, &second, false);
    let reader = Reader::open(split.path()).unwrap();
    assert_eq!(content(&reader), expected);
    let info = reader.info(Span::from_seconds(0.5)).unwrap();
    assert_eq!((info.messages, info.topics.len()), (121, 4));
    assert!(info.loss.is_none(), "{}", info.loss);
}

#[test]
fn a_database_with_views_or_other_tables_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, sql: &str| {
        let path = folder.path().join(name);
        rusqlite::Connection::open(&path).unwrap().execute_batch(sql).unwrap();
        Reader::open(&path).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused("other.db3", "CREATE TABLE people(name TEXT)").contains("it has no table `topics`"));
    let topics = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);";
    let endless = "CREATE VIEW messages AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) \
                   SELECT k AS id, 1 AS topic_id, k AS timestamp, x'00' AS data FROM n;";
    assert!(refused("view.db3", &format!("{topics}{endless}")).contains("it has no table `messages`"));
    let computed = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, \
                    data AS (zeroblob(1000000000)) VIRTUAL);";
    assert!(refused("computed.db3", &format!("{topics}{computed}")).contains("has no column `data`"));
    let numbered = "CREATE TABLE messages(rowid TEXT, topic_id, timestamp, data);";
    assert!(refused("numbered.db3", &format!("{topics}{numbered}")).contains("has a column `rowid`"));
}

#[test]
fn a_damaged_database_gives_an_error_or_the_intact_messages() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.db3");
    database(&file, &TOPICS, &ros_2_messages(), false);
    let whole = std::fs::read(&file).unwrap();
    for at in (16..whole.len()).step_by(251) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x55;
        if let Ok(reader) = Reader::new("damaged.db3", Cursor::new(bytes)) {
            let _ = reader.info(Span::from_seconds(0.5)).unwrap();
        }
    }
    for cut in (16..whole.len()).step_by(1021) {
        if let Ok(reader) = Reader::new("cut.db3", Cursor::new(whole[..cut].to_vec())) {
            let _ = reader.info(Span::from_seconds(0.5)).unwrap();
        }
    }
}

/// Damages the B-tree of messages so that every page below its root is a child of all pages above it.
///
/// An interior table page (type 5) has its cell offsets from byte 12, each cell starts with the number of its child,
/// and the last child is at byte 8 (sqlite.org/fileformat2.html, section 1.6).
fn link_pages_repeatedly(bytes: &mut [u8], page_size: usize, root: usize) {
    let two = |bytes: &[u8], at: usize| usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
    let is_interior = |bytes: &[u8], page: usize| bytes[(page - 1) * page_size] == 5;
    let children = |bytes: &[u8], page: usize| -> Vec<usize> {
        let start = (page - 1) * page_size;
        let cells = (0..two(bytes, start + 3)).map(|k| start + two(bytes, start + 12 + 2 * k));
        cells.chain([start + 8]).collect()
    };
    let child = |bytes: &[u8], at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (mut path, mut page) = (Vec::new(), root);
    while is_interior(bytes, page) {
        path.push(page);
        page = child(bytes, children(bytes, page)[0]);
    }
    // The leaves after the first one become interior pages too, as copies of the last interior page.
    let last = *path.last().unwrap();
    let leaves: Vec<usize> = children(bytes, last).iter().map(|at| child(bytes, *at)).collect();
    let copied = bytes[(last - 1) * page_size..last * page_size].to_vec();
    for leaf in &leaves[1..9] {
        bytes[(leaf - 1) * page_size..leaf * page_size].copy_from_slice(&copied);
    }
    path.extend(&leaves[1..9]);
    for (k, above) in path.iter().enumerate() {
        let below = path.get(k + 1).copied().unwrap_or(leaves[0]);
        for at in children(bytes, *above) {
            bytes[at..at + 4].copy_from_slice(&(below as u32).to_be_bytes());
        }
    }
}

#[test]
fn rows_repeated_by_a_damaged_tree_are_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.db3");
    let sql = "PRAGMA page_size = 512; CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data);
        INSERT INTO topics VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr');
        WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n LIMIT 3000)
        INSERT INTO messages SELECT k, 1, k, zeroblob(200) FROM n;";
    let database = rusqlite::Connection::open(&file).unwrap();
    database.execute_batch(sql).unwrap();
    let text = "SELECT rootpage FROM sqlite_schema WHERE name = 'messages'";
    let root: i64 = database.query_row(text, [], |row| row.get(0)).unwrap();
    drop(database);
    let mut bytes = std::fs::read(&file).unwrap();
    link_pages_repeatedly(&mut bytes, 512, root as usize);
    let reader = Reader::new("tangled.db3", Cursor::new(bytes)).unwrap();
    let info = reader.info(Span::from_seconds(0.5)).unwrap();
    // A leaf of 512 bytes has two messages of 200 bytes; without a check more than 30^10 rows would be read.
    assert_eq!(info.messages, 2);
    assert!(!info.loss.is_none());
}
