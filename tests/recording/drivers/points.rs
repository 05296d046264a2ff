//! Point times of different drivers, and lidars with several echoes.

use super::{Fields, MS, START_NS, point_cloud};
use crate::recording::foreign::bag::{Ros1, bag};
use crate::recording::foreign::{
    FLOAT32, FLOAT64, Foreign, Header, IMU, POINTS, UINT32, cdr, header, imu, scans, select,
};
use serde::Serialize;
use zsim::measurement::LidarScan;
use zsim::recording::Reader;

/// A point as a driver serialises it, with its time after the stamp.
type Encode = fn(i64, i64) -> Vec<u8>;

fn xyz_i(after_ns: i64) -> Vec<u8> {
    [1.0, 2.0, 3.0 + after_ns as f32 * 1e-9, 40.0].map(f32::to_le_bytes).concat()
}

/// Name, fields after x, y and z, bytes per point, delay of the stamp after the first point, the point.
type Driver = (&'static str, Fields<'static>, u32, i64, Encode);

const DRIVERS: [Driver; 6] = [
    (
        "ouster",
        &[
            ("intensity", 16, FLOAT32),
            ("t", 20, UINT32),
            ("reflectivity", 24, 4),
            ("ring", 26, 4),
            ("ambient", 28, 4),
            ("range", 32, UINT32),
        ],
        48,
        0,
        |_, after_ns| {
            let mut bytes = xyz_i(after_ns);
            bytes.splice(12..12, [0; 4]);
            bytes.extend((after_ns as u32).to_le_bytes());
            bytes.resize(48, 0);
            bytes
        },
    ),
    (
        "velodyne, relative to the end of the scan",
        &[("intensity", 12, FLOAT32), ("ring", 16, 4), ("time", 18, FLOAT32)],
        22,
        100 * MS,
        |_, after_ns| {
            let time_s = (after_ns - 100 * MS) as f32 * 1e-9;
            [xyz_i(after_ns), vec![5, 0], time_s.to_le_bytes().to_vec()].concat()
        },
    ),
    (
        "hesai",
        &[("intensity", 12, FLOAT32), ("ring", 16, 4), ("timestamp", 18, FLOAT64)],
        26,
        0,
        |start_ns, after_ns| {
            let time_s = (start_ns + after_ns) as f64 * 1e-9;
            [xyz_i(after_ns), vec![5, 0], time_s.to_le_bytes().to_vec()].concat()
        },
    ),
    (
        "robosense, stamped at its end",
        &[("intensity", 16, FLOAT32), ("ring", 20, 4), ("timestamp", 24, FLOAT64)],
        32,
        100 * MS,
        |start_ns, after_ns| {
            let mut bytes = xyz_i(after_ns);
            bytes.splice(12..12, [0; 4]);
            bytes.extend([5, 0, 0, 0]);
            bytes.extend(((start_ns + after_ns) as f64 * 1e-9).to_le_bytes());
            bytes
        },
    ),
    (
        "livox_ros_driver2",
        &[("intensity", 12, FLOAT32), ("tag", 16, 2), ("line", 17, 2), ("timestamp", 18, FLOAT64)],
        26,
        0,
        |start_ns, after_ns| {
            [xyz_i(after_ns), vec![0, 3], ((start_ns + after_ns) as f64).to_le_bytes().to_vec()].concat()
        },
    ),
    (
        "livox_ros_driver, by the clock of the sensor",
        &[("intensity", 12, FLOAT32), ("tag", 16, 2), ("line", 17, 2), ("timestamp", 18, FLOAT64)],
        26,
        0,
        |start_ns, after_ns| {
            let since_on_ns = start_ns - START_NS + 123_000_000_000 + after_ns;
            [xyz_i(after_ns), vec![0, 3], (since_on_ns as f64).to_le_bytes().to_vec()].concat()
        },
    ),
];

#[test]
fn point_times_of_all_drivers_are_read() {
    for (driver, fields, step, stamped_after_ns, encode) in DRIVERS {
        let fields = [&[("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32)], fields].concat();
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for n in 0..8 {
            let start_ns = START_NS + n * 100 * MS;
            let points: Vec<_> = (0..=50).map(|k| encode(start_ns, k * 2 * MS)).collect();
            let stamp_ns = start_ns + stamped_after_ns;
            foreign.message("/imu", IMU, start_ns, &imu(start_ns, "imu"));
            foreign.message("/points", POINTS, stamp_ns, &point_cloud(stamp_ns, &fields, step, &points));
        }
        let scans = scans(&foreign.reader());
        assert_eq!(scans.len(), 8, "{driver}");
        for (n, scan) in scans.iter().enumerate() {
            assert_eq!(scan.returns.len(), 51, "{driver}");
            for (k, point) in scan.returns.iter().enumerate() {
                let off_ns = (scan.stamp + point.offset).nanos() - (START_NS + n as i64 * 100 * MS + k as i64 * 2 * MS);
                // Seconds since 1970 in a double have a resolution of 0.24 us.
                assert!(off_ns.abs() < 500, "{driver}: point {k} of scan {n} is {off_ns} ns off");
                assert_eq!((point.point_in_laser.x, point.intensity), (1.0, 40.0), "{driver}");
            }
        }
    }
}

#[derive(Serialize)]
pub(super) struct CustomPoint {
    pub offset_time: u32,
    pub xyz: [f32; 3],
    pub reflectivity_tag_line: [u8; 3],
}

#[derive(Serialize)]
pub(super) struct CustomMsg {
    pub header: Header,
    pub timebase: u64,
    pub point_num: u32,
    pub lidar_id: u8,
    pub rsvd: [u8; 3],
    pub points: Vec<CustomPoint>,
}

#[test]
fn custom_messages_of_livox_are_read_in_both_serialisations() {
    let point = |k: u32| CustomPoint {
        offset_time: k * 1_000_000,
        xyz: if k == 3 { [0.0; 3] } else { [1.0, k as f32, 2.0] },
        reflectivity_tag_line: [k as u8, 0, 1],
    };
    let message = CustomMsg {
        header: header(START_NS, "livox_frame"),
        timebase: 987_654_321,
        point_num: 10,
        lidar_id: 1,
        rsvd: [0; 3],
        points: (0..10).map(point).collect(),
    };
    let mut ros_1 = Ros1::header(START_NS, "livox_frame").bytes(&message.timebase.to_le_bytes()).u32(10);
    ros_1 = ros_1.bytes(&[1, 0, 0, 0]).u32(10);
    for point in &message.points {
        ros_1 = ros_1.u32(point.offset_time).f32s(&point.xyz).bytes(&point.reflectivity_tag_line);
    }
    let check = |scan: &LidarScan| {
        assert_eq!((scan.stamp.nanos(), scan.returns.len()), (START_NS, 9));
        assert_eq!((scan.returns[3].offset.nanos(), scan.returns[3].intensity), (4_000_000, 4.0));
        assert_eq!(scan.returns[3].point_in_laser.y, 4.0);
    };
    for kind in ["livox_ros_driver/msg/CustomMsg", "livox_ros_driver2/msg/CustomMsg"] {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, START_NS, &imu(START_NS, "imu"));
        foreign.serialised("/livox/lidar", kind, START_NS, &cdr(&message));
        check(&scans(&foreign.reader())[0]);
    }
    let force = Ros1::header(START_NS, "imu").f64s(&[0.0; 13]).f64s(&[0.1; 12]).f64s(&[9.8; 12]).0;
    let topics = [("/livox/imu", "sensor_msgs/Imu"), ("/livox/lidar", "livox_ros_driver2/CustomMsg")];
    let bag = bag(&topics, &[(0, START_NS, force), (1, START_NS, ros_1.0)], "lz4", true);
    check(&scans(&Reader::new("livox.bag", std::io::Cursor::new(bag)).unwrap())[0]);
}

#[derive(Serialize)]
struct MultiEcho {
    header: Header,
    angles: [f32; 3],
    times: [f32; 2],
    range: [f32; 2],
    ranges: Vec<Vec<f32>>,
    intensities: Vec<Vec<f32>>,
}

#[test]
fn of_several_echoes_the_strongest_is_used() {
    let read = |intensities: Vec<Vec<f32>>| {
        let message = MultiEcho {
            header: header(START_NS, "laser"),
            angles: [0.0, 0.4, 0.1],
            times: [0.001, 0.1],
            range: [0.1, 30.0],
            ranges: vec![vec![2.0, 3.0], vec![4.0], vec![], vec![f32::INFINITY], vec![5.0, 6.0, 7.0]],
            intensities,
        };
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, START_NS, &imu(START_NS, "imu"));
        foreign.message("/most_intense", "sensor_msgs/msg/MultiEchoLaserScan", START_NS, &message);
        let reader = foreign.reader();
        assert!(select(&reader).notes[0].contains("the strongest is used"));
        scans(&reader)[0].planar.as_ref().unwrap().ranges_m.clone()
    };
    let none = f32::INFINITY;
    let intensities = vec![vec![10.0, 90.0], vec![5.0], vec![], vec![0.0], vec![7.0, 9.0, 8.0]];
    assert_eq!(read(intensities), [3.0, 4.0, none, none, 6.0]);
    assert_eq!(read(Vec::new()), [2.0, 4.0, none, none, 5.0]);
}
