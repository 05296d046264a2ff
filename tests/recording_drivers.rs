//! What drivers write in their own ways: beams without a return, halves of an IMU, clocks, point times, repeats.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod foreign;

use foreign::bag::Ros1;
use foreign::{FLOAT32, FLOAT64, Foreign, Header, IMU, LaserScan, POINTS, PointCloud2, PointField, SCAN, UINT32};
use foreign::{cdr, header, imu, scan, scans, select};
use serde::Serialize;
use zsim::measurement::{ImuSample, LidarScan, Measurement};
use zsim::recording::{Preference, Reader};

const START_NS: i64 = 1_700_000_000_000_000_000;
const MS: i64 = 1_000_000;

/// A room's ranges as the lidar moves: the wall of beam `k` in scan `n`, m; every seventh beam meets nothing.
fn wall_m(n: usize, k: usize) -> Option<f32> {
    (k % 7 != 3).then(|| 3.0 + 0.01 * n as f32 + 2.0 * (k as f32 * 0.05).sin().abs())
}

fn room(n: usize, range: [f32; 2], miss: f32) -> LaserScan {
    LaserScan {
        header: header(START_NS + n as i64 * 100 * MS, "laser"),
        angles: [0.0, 3.59, 0.01],
        time_increment: 0.0002,
        scan_time: 0.1,
        range,
        ranges: (0..360).map(|k| wall_m(n, k).unwrap_or(miss)).collect(),
        intensities: Vec::new(),
    }
}

fn with_scans(range: [f32; 2], miss: f32) -> Reader {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..10 {
        let ns = START_NS + n as i64 * 100 * MS;
        foreign.message("/imu", IMU, ns, &imu(ns, "imu")).message("/scan", SCAN, ns, &room(n, range, miss));
    }
    foreign.reader()
}

#[test]
fn every_encoding_of_a_miss_gives_what_rep_117_gives() {
    let rep_117 = with_scans([0.1, 30.0], f32::INFINITY);
    assert_eq!(select(&rep_117).notes, [""; 0]);
    let expected: Vec<_> = scans(&rep_117).into_iter().map(|scan| (scan.stamp, scan.returns)).collect();
    assert_eq!(expected[0].1.len(), 360 - 51);
    let encodings = [
        ([0.1, 30.0], f32::NAN, "as NaN (14.2 % of its beams)"),
        ([0.1, 30.0], f32::NEG_INFINITY, ""),
        ([0.1, 30.0], 0.0, "as 0 (14.2 % of its beams)"),
        ([0.1, 30.0], 30.0, "as its range_max of 30 m or more (14.2 % of its beams)"),
        ([0.1, 30.0], 65.533, "as its range_max of 30 m or more (14.2 % of its beams)"),
        ([0.0, 30.0], 0.0, "as 0 (14.2 % of its beams)"),
        // Without a range_max that can be meant.
        ([0.1, 0.0], f32::INFINITY, ""),
        ([0.1, f32::NAN], f32::NAN, "as NaN"),
        ([0.1, f32::MAX], 81.91, "as a constant 81.91 m (14.2 % of its beams)"),
        ([0.0, 0.0], 81.91, "as a constant 81.91 m"),
        // A range_max that is not the one that is written.
        ([0.1, 100.0], 65.533, "as a constant 65.533 m"),
    ];
    for (range, miss, note) in encodings {
        let reader = with_scans(range, miss);
        let found: Vec<_> = scans(&reader).into_iter().map(|scan| (scan.stamp, scan.returns)).collect();
        assert_eq!(found, expected, "{range:?} {miss}");
        let notes = select(&reader).notes;
        let expected_notes = usize::from(!note.is_empty());
        assert!(notes.len() == expected_notes && notes.iter().all(|n| n.contains(note)), "{range:?} {miss}: {notes:?}");
    }
}

/// Fields of a point: name, offset, type.
type Fields<'a> = &'a [(&'a str, u32, u8)];

fn point_cloud(stamp_ns: i64, fields: Fields<'_>, step: u32, points: &[Vec<u8>]) -> PointCloud2 {
    let field = |(name, offset, datatype): &(&str, u32, u8)| PointField {
        name: (*name).to_owned(),
        offset: *offset,
        datatype: *datatype,
        count: 1,
    };
    assert!(points.iter().all(|point| point.len() == step as usize));
    PointCloud2 {
        header: header(stamp_ns, "lidar"),
        height: 1,
        width: points.len() as u32,
        fields: fields.iter().map(field).collect(),
        is_bigendian: false,
        point_step: step,
        row_step: step * points.len() as u32,
        data: points.concat(),
        is_dense: true,
    }
}

const XYZ: Fields<'static> = &[("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("t", 12, UINT32)];

#[test]
fn misses_of_clouds_are_no_walls() {
    let direction = |k: usize| [(k as f32 * 0.01).cos() * 0.8, (k as f32 * 0.01).sin() * 0.8, 0.6];
    let points = |n: usize, miss: &dyn Fn([f32; 3]) -> Option<[f32; 3]>| -> Vec<Vec<u8>> {
        let point = |k: usize| {
            let at = match wall_m(n, k) {
                Some(range) => Some(direction(k).map(|c| c * range)),
                None => miss(direction(k)),
            };
            at.map(|at| [at.map(f32::to_le_bytes).concat(), (k as u32 * 100_000).to_le_bytes().to_vec()].concat())
        };
        (0..360).filter_map(point).collect()
    };
    let read = |miss: &dyn Fn([f32; 3]) -> Option<[f32; 3]>| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for n in 0..10 {
            let ns = START_NS + n as i64 * 100 * MS;
            let cloud = point_cloud(ns, XYZ, 16, &points(n, miss));
            foreign.message("/imu", IMU, ns, &imu(ns, "imu")).message("/points", POINTS, ns, &cloud);
        }
        let reader = foreign.reader();
        (scans(&reader), select(&reader).notes)
    };
    let (expected, notes) = read(&|_| None);
    assert!(notes.is_empty() && expected[0].returns.len() == 309, "{notes:?}");
    assert_eq!(read(&|_| Some([f32::NAN; 3])), (expected.clone(), Vec::new()));
    let (found, notes) = read(&|_| Some([0.0; 3]));
    assert!(found == expected && notes[0].contains("as 0 (14.2 %"), "{notes:?}");
    let (found, notes) = read(&|direction| Some(direction.map(|c| c * 200.0)));
    assert!(found == expected && notes[0].contains("as a constant 200"), "{notes:?}");
}

#[test]
fn a_lidar_that_cannot_be_decoded_gets_its_reason() {
    let error = |angles: [f32; 3], times: [f32; 2]| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        let scan = LaserScan { angles, time_increment: times[0], scan_time: times[1], ..room(0, [0.1, 30.0], 0.0) };
        foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/sc\u{1b}[31man", SCAN, 0, &scan);
        foreign.reader().select(&Preference::default()).unwrap_err().to_string()
    };
    let unusable = "foreign: no lidar topic can be used: topic /sc\\u{1b}[31man: ";
    let kind = " in its first message of type sensor_msgs/msg/LaserScan";
    assert_eq!(error([0.0, 1.0, f32::NAN], [0.0; 2]), format!("{unusable}angle_increment is NaN or infinite{kind}"));
    assert_eq!(error([0.0, 1.0, 0.0], [0.0; 2]), format!("{unusable}angle_increment is 0 with several ranges{kind}"));
    assert!(error([0.0, 1.0, 0.1], [1e20, 0.0]).contains("make a scan of more than 60 s"));
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    let cloud = point_cloud(0, &[("range", 0, FLOAT32)], 4, &[vec![0; 4]]);
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/points", POINTS, 0, &cloud);
    let error = foreign.reader().select(&Preference::default()).unwrap_err().to_string();
    assert!(error.contains("topic /points: a cloud has no fields x, y and z"), "{error}");
}

#[test]
fn empty_scans_and_clouds_are_valid() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu"));
    let empty = LaserScan { ranges: Vec::new(), ..scan(0, 0.0, 0.0) };
    foreign.message("/scan", SCAN, 1, &empty).message("/scan", SCAN, 2, &scan(2, 0.001, 0.1));
    foreign.message("/scan", SCAN, 3, &LaserScan { header: header(3, "laser"), ..empty });
    let reader = foreign.reader();
    assert_eq!(scans(&reader).iter().map(|scan| scan.returns.len()).collect::<Vec<_>>(), [0, 6, 0]);
    // Its beams' times are those of the first scan that has beams.
    let notes = select(&reader).notes;
    assert!(!notes.iter().any(|note| note.contains("no time")), "{notes:?}");
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu"));
    foreign.message("/points", POINTS, 1, &point_cloud(1, &[], 0, &[]));
    assert_eq!(scans(&foreign.reader())[0].returns.len(), 0);
}

/// Samples of a selection, and its notes.
fn samples(reader: &Reader) -> (Vec<ImuSample>, Vec<String>) {
    let selection = select(reader);
    let measurements = reader.measurements(&selection).map(|m| m.unwrap());
    let samples = measurements.filter_map(|m| if let Measurement::Imu(s) = m { Some(s) } else { None }).collect();
    (samples, selection.notes)
}

/// A sample of a hand that turns and shakes, at `t` s.
fn moving(ns: i64) -> foreign::Imu {
    let t = (ns - START_NS) as f64 * 1e-9;
    foreign::Imu {
        angular_velocity: [0.3 * (3.0 * t).sin() + 0.01, 0.2, 0.4 * (2.0 * t).cos()],
        linear_acceleration: [1.5 * (8.2 * t).sin(), 1.2 * (4.4 * t).cos(), 9.8 + 0.8 * (6.1 * t).sin()],
        ..imu(ns, "imu")
    }
}

#[test]
fn halves_of_an_imu_are_paired_or_refused() {
    let rate_of = |ns: i64| foreign::Imu { linear_acceleration: [0.0; 3], ..moving(ns) };
    let force_of = |ns: i64| foreign::Imu { angular_velocity: [0.0; 3], ..moving(ns) };
    let attitude_of =
        |ns: i64| foreign::Imu { linear_acceleration: [0.0; 3], angular_velocity: [0.0; 3], ..moving(ns) };
    let record = |topics: [Option<&str>; 3]| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for k in 0..400 {
            let ns = START_NS + k * 5 * MS;
            if let Some(topic) = topics[0] {
                foreign.message(topic, IMU, ns, &rate_of(ns));
            }
            // Accelerations come at half the rate, 1 ms later.
            if let Some(topic) = topics[1].filter(|_| k % 2 == 0) {
                foreign.message(topic, IMU, ns + MS, &force_of(ns + MS));
            }
            if let Some(topic) = topics[2] {
                foreign.message(topic, IMU, ns + 2 * MS, &attitude_of(ns));
            }
            if k % 20 == 0 {
                foreign.message("/scan", SCAN, ns, &room(k as usize / 20, [0.1, 30.0], f32::INFINITY));
            }
        }
        foreign.reader()
    };
    for (topics, note) in [
        (
            [Some("/camera/gyro/sample"), Some("/camera/accel/sample"), None],
            "nearest acceleration of /camera/accel/sample",
        ),
        ([Some("/imu"), Some("/imu"), Some("/imu")], "in separate messages"),
        ([Some("/imu/gyro"), Some("/imu/acc"), Some("/imu/data")], "nearest acceleration of /imu/acc"),
    ] {
        let (samples, notes) = samples(&record(topics));
        assert!(notes.iter().any(|n| n.contains(note)), "{notes:?}");
        assert!((398..=400).contains(&samples.len()), "{topics:?}: {}", samples.len());
        for sample in &samples {
            let ns = sample.stamp.nanos();
            assert_eq!(sample.angular_velocity_rad_per_s.as_slice(), moving(ns).angular_velocity);
            // The nearest one is 1 or 4 ms away: at most 12 rad/s^2 in 1 s of 8.2 rad/s.
            let force = sample.specific_force_m_per_s2;
            let truth = zsim::geometry::Vector::from(moving(ns).linear_acceleration);
            assert!((force - truth).norm() < 0.08, "{force} {truth}");
        }
    }
    let error = |topics| record(topics).select(&Preference::default()).unwrap_err().to_string();
    let lacks = error([Some("/imu/gyro"), None, None]);
    assert!(lacks.contains("IMU topic /imu/gyro has zeros for acceleration, and no other topic carries it"), "{lacks}");
    let lacks = error([None, Some("/imu/acc"), None]);
    assert!(lacks.contains("IMU topic /imu/acc has zeros for angular velocity, and no other topic"), "{lacks}");
    let lacks = error([None, None, Some("/imu")]);
    assert!(lacks.contains("IMU topic /imu has zeros for acceleration and angular velocity"), "{lacks}");
}

#[test]
fn accelerations_without_gravity_are_refused_and_units_of_gravity_are_not() {
    let record = |seconds: i64, of: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for k in 0..seconds * 100 {
            let ns = START_NS + k * 10 * MS;
            let sample = moving(ns);
            let linear_acceleration = of(sample.linear_acceleration);
            foreign.message("/phone/imu", IMU, ns, &foreign::Imu { linear_acceleration, ..sample });
        }
        foreign.message("/scan", SCAN, START_NS, &room(0, [0.1, 30.0], f32::INFINITY));
        foreign.reader()
    };
    let linear = record(12, &|[x, y, z]| [x, y, z - 9.8]);
    let error = linear.select(&Preference::default()).unwrap_err().to_string();
    assert!(error.contains("IMU topic /phone/imu has accelerations without gravity (median 1."), "{error}");
    assert!(error.contains("TYPE_ACCELEROMETER"), "{error}");
    let (in_g, notes) = samples(&record(12, &|force| force.map(|c| c / 9.806_65)));
    assert!(notes.iter().any(|note| note.contains("units of gravity")), "{notes:?}");
    assert!((in_g[0].specific_force_m_per_s2.z - 9.8).abs() < 1e-9);
    let (fall, _) = samples(&record(3, &|[x, y, z]| [0.01 * x, 0.01 * y, 0.01 * (z - 9.8)]));
    assert_eq!(fall.len(), 300);
}

#[test]
fn stamps_of_another_epoch_are_shifted_by_log_times() {
    let record = |imu_ahead_ns: i64, jitter_ms: i64| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for k in 0..500_i64 {
            let ns = START_NS + k * 10 * MS;
            foreign.message("/imu", IMU, ns + MS + (k * 7919 % 13) * jitter_ms * MS / 13, &moving(ns + imu_ahead_ns));
            if k % 10 == 0 {
                // A scan of 72 ms is logged 4 ms after its end.
                foreign.message("/scan", SCAN, ns + 76 * MS, &room(k as usize / 10, [0.1, 30.0], f32::INFINITY));
            }
        }
        let (samples, notes) = samples(&foreign.reader());
        (samples[0].stamp.nanos() - START_NS, notes)
    };
    // The IMU's clock counts from when it was switched on; TAI; a minute off; 0.2 s off.
    for ahead_ns in [-START_NS + 5_000_000_000, 37_000_000_000, -60_000_000_000, 200 * MS] {
        let (first_ns, notes) = record(ahead_ns, 2);
        assert!(first_ns.abs() < 10 * MS, "{ahead_ns}: {first_ns}");
        assert!(notes[0].starts_with("The stamps of /imu and /scan are "), "{notes:?}");
    }
    // What the estimator finds better itself, and what the jitter of log times hides.
    assert_eq!(record(15 * MS, 2), (15 * MS, Vec::new()));
    assert_eq!(record(200 * MS, 150), (200 * MS, Vec::new()));
}

/// A point as a driver writes it, with its time.
type Encode = fn(i64, i64) -> Vec<u8>;

fn xyz_i(after_ns: i64) -> Vec<u8> {
    [1.0, 2.0, 3.0 + after_ns as f32 * 1e-9, 40.0].map(f32::to_le_bytes).concat()
}

/// Name, fields, bytes of a point, when the cloud is stamped after its first point, the point.
type Driver = (&'static str, Fields<'static>, u32, i64, Encode);

const DRIVERS: [Driver; 6] = [
    (
        "ouster",
        &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
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
        &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("intensity", 12, FLOAT32),
            ("ring", 16, 4),
            ("time", 18, FLOAT32),
        ],
        22,
        100 * MS,
        |_, after_ns| {
            let time_s = (after_ns - 100 * MS) as f32 * 1e-9;
            [xyz_i(after_ns), vec![5, 0], time_s.to_le_bytes().to_vec()].concat()
        },
    ),
    (
        "hesai",
        &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("intensity", 12, FLOAT32),
            ("ring", 16, 4),
            ("timestamp", 18, FLOAT64),
        ],
        26,
        0,
        |start_ns, after_ns| {
            let time_s = (start_ns + after_ns) as f64 * 1e-9;
            [xyz_i(after_ns), vec![5, 0], time_s.to_le_bytes().to_vec()].concat()
        },
    ),
    (
        "robosense, stamped at its end",
        &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("intensity", 16, FLOAT32),
            ("ring", 20, 4),
            ("timestamp", 24, FLOAT64),
        ],
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
        &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("intensity", 12, FLOAT32),
            ("tag", 16, 2),
            ("line", 17, 2),
            ("timestamp", 18, FLOAT64),
        ],
        26,
        0,
        |start_ns, after_ns| {
            [xyz_i(after_ns), vec![0, 3], ((start_ns + after_ns) as f64).to_le_bytes().to_vec()].concat()
        },
    ),
    (
        "livox_ros_driver, by the clock of the sensor",
        &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("intensity", 12, FLOAT32),
            ("tag", 16, 2),
            ("line", 17, 2),
            ("timestamp", 18, FLOAT64),
        ],
        26,
        0,
        |start_ns, after_ns| {
            let since_on_ns = start_ns - START_NS + 123_000_000_000 + after_ns;
            [xyz_i(after_ns), vec![0, 3], (since_on_ns as f64).to_le_bytes().to_vec()].concat()
        },
    ),
];

#[test]
fn points_are_timed_as_their_drivers_write_them() {
    for (driver, fields, step, stamped_after_ns, encode) in DRIVERS {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for n in 0..8 {
            let start_ns = START_NS + n * 100 * MS;
            let points: Vec<_> = (0..=50).map(|k| encode(start_ns, k * 2 * MS)).collect();
            let stamp_ns = start_ns + stamped_after_ns;
            foreign.message("/imu", IMU, start_ns, &imu(start_ns, "imu"));
            foreign.message("/points", POINTS, stamp_ns, &point_cloud(stamp_ns, fields, step, &points));
        }
        let scans = scans(&foreign.reader());
        assert_eq!(scans.len(), 8, "{driver}");
        for (n, scan) in scans.iter().enumerate() {
            assert_eq!(scan.returns.len(), 51, "{driver}");
            for (k, point) in scan.returns.iter().enumerate() {
                let off_ns = (scan.stamp + point.offset).nanos() - (START_NS + n as i64 * 100 * MS + k as i64 * 2 * MS);
                // Seconds since 1970 in a double are whole 0.24 us.
                assert!(off_ns.abs() < 500, "{driver}: point {k} of scan {n} is {off_ns} ns off");
                assert_eq!((point.point_in_laser.x, point.intensity), (1.0, 40.0), "{driver}");
            }
        }
    }
}

#[derive(Serialize)]
struct CustomPoint {
    offset_time: u32,
    xyz: [f32; 3],
    reflectivity_tag_line: [u8; 3],
}

#[derive(Serialize)]
struct CustomMsg {
    header: Header,
    timebase: u64,
    point_num: u32,
    lidar_id: u8,
    rsvd: [u8; 3],
    points: Vec<CustomPoint>,
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
    let bag = foreign::bag::bag(&topics, &[(0, START_NS, force), (1, START_NS, ros_1.0)], "lz4", true);
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

#[test]
fn what_comes_twice_is_used_once() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for k in 0..100_i64 {
        let ns = START_NS + k * 10 * MS;
        for _ in 0..1 + k % 2 {
            foreign.message("/imu", IMU, ns, &moving(ns));
        }
        if k % 10 == 0 {
            let room = room(k as usize / 10, [0.1, 30.0], f32::INFINITY);
            // The same message again, and its ranges published again 50 ms later.
            foreign.message("/scan", SCAN, ns, &room).message("/scan", SCAN, ns, &room);
            let again = LaserScan { header: header(ns + 50 * MS, "laser"), ..room };
            foreign.message("/scan", SCAN, ns + 50 * MS, &again);
        }
    }
    let reader = foreign.reader();
    let selection = select(&reader);
    let mut measurements = reader.measurements(&selection);
    let all: Vec<_> = measurements.by_ref().map(|m| m.unwrap()).collect();
    assert_eq!(all.len(), 100 + 10);
    let loss = measurements.loss();
    assert_eq!((loss.repeated_samples, loss.repeated_scans, loss.is_none()), (50, 20, true));
    assert_eq!(
        loss.notes(),
        ["20 scans came twice and were used once", "50 IMU samples came twice and were used once"]
    );
}
