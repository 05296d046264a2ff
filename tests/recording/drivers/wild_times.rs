//! Point times that are impossible, equal, missing, or of 64 bits.

use super::points::{CustomMsg, CustomPoint};
use super::{Fields, MS, START_NS, point_cloud};
use crate::recording::foreign::{FLOAT32, FLOAT64, Foreign, IMU, POINTS, UINT32, header, imu, select};
use zsim::measurement::{LidarScan, Measurement};
use zsim::recording::{Loss, Reader};

const POINTS_EACH: usize = 400;
const CLOUDS: i64 = 8;
const INT64: u8 = 9;
const UINT64: u8 = 10;

/// Scans, what was lost, and notes.
fn read(reader: &Reader) -> (Vec<LidarScan>, Loss, Vec<String>) {
    let selection = select(reader);
    let mut measurements = reader.measurements(&selection);
    let scans =
        measurements.by_ref().filter_map(|m| if let Measurement::Lidar(scan) = m.unwrap() { Some(scan) } else { None });
    let scans = scans.collect();
    (scans, measurements.loss().clone(), selection.notes)
}

/// Clouds of 100 ms at 10 Hz whose points have the bytes of their time from `time`, for a cloud's start and a time in it, ns.
fn clouds(name: &str, kind: u8, time: impl Fn(i64, usize) -> Vec<u8>) -> Reader {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..CLOUDS {
        let start_ns = START_NS + n * 100 * MS;
        let point = |k: usize| {
            let xyz = [x_m(n, k), 2.0, 3.0].map(f32::to_le_bytes).concat();
            [xyz, time(n, k)].concat()
        };
        let points: Vec<_> = (0..POINTS_EACH).map(point).collect();
        let fields: Fields<'_> = &[("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), (name, 12, kind)];
        foreign.message("/imu", IMU, start_ns, &imu(start_ns, "imu"));
        let step = points[0].len() as u32;
        foreign.message("/points", POINTS, start_ns, &point_cloud(start_ns, fields, step, &points));
    }
    foreign.reader()
}

/// Coordinate of point `k` of cloud `n`: equal clouds would be duplicates.
fn x_m(n: i64, k: usize) -> f32 {
    1.0 + 0.1 * n as f32 + 0.001 * k as f32
}

/// Time of point `k` after the start of its cloud, ns.
fn after_ns(k: usize) -> i64 {
    k as i64 * 250_000
}

/// Checks scans without the points 11 to 30 of the clouds for which `has_wild` holds.
fn check_without_wild(scans: &[LidarScan], has_wild: impl Fn(usize) -> bool, case: &str) {
    assert_eq!(scans.len(), CLOUDS as usize, "{case}");
    for (n, scan) in scans.iter().enumerate() {
        let is_kept = |k: &usize| !has_wild(n) || !(11..31).contains(k);
        let expected: Vec<_> = (0..POINTS_EACH).filter(is_kept).collect();
        assert_eq!(scan.returns.len(), expected.len(), "{case}: cloud {n}");
        for (point, k) in scan.returns.iter().zip(expected) {
            let off_ns = (scan.stamp + point.offset).nanos() - START_NS - n as i64 * 100 * MS - after_ns(k);
            assert!(off_ns.abs() < 500, "{case}: point {k} of cloud {n} is {off_ns} ns off");
        }
    }
}

#[test]
fn points_with_impossible_times_are_dropped_and_counted() {
    type Way<'a> = (&'a str, u8, &'a dyn Fn(i64, usize) -> Vec<u8>);
    let start_ns = |n: i64| START_NS + n * 100 * MS;
    let is_wild = |k: usize| (11..31).contains(&k);
    let ways: [Way<'_>; 8] = [
        ("t", UINT32, &|_, k| (if is_wild(k) { 3_604_361_924 } else { after_ns(k) as u32 }).to_le_bytes().to_vec()),
        ("t", UINT32, &|_, k| (if is_wild(k) { 310 } else { (after_ns(k) / MS) as u32 }).to_le_bytes().to_vec()),
        ("time", FLOAT32, &|_, k| {
            (if is_wild(k) { f32::NAN } else { after_ns(k) as f32 * 1e-9 }).to_le_bytes().to_vec()
        }),
        ("time", FLOAT32, &|_, k| (if is_wild(k) { -1e30 } else { after_ns(k) as f32 * 1e-9 }).to_le_bytes().to_vec()),
        ("stamps", FLOAT64, &|n, k| {
            (if is_wild(k) { 0.0 } else { (start_ns(n) + after_ns(k)) as f64 * 1e-9 }).to_le_bytes().to_vec()
        }),
        // The clock of the sensor, since power-up.
        ("timestamp", FLOAT64, &|n, k| {
            (if is_wild(k) { 1e-300 } else { 1000.0 + n as f64 * 0.1 + after_ns(k) as f64 * 1e-9 })
                .to_le_bytes()
                .to_vec()
        }),
        ("Timestamp", UINT64, &|n, k| {
            (if is_wild(k) { u64::MAX } else { (start_ns(n) + after_ns(k)) as u64 }).to_le_bytes().to_vec()
        }),
        ("time_offset", INT64, &|_, k| (if is_wild(k) { i64::MIN } else { after_ns(k) }).to_le_bytes().to_vec()),
    ];
    for (name, kind, time) in ways {
        for clouds_with in [1, CLOUDS] {
            let case = format!("{name} {kind}, {clouds_with} clouds");
            // Where there are no impossible times, those points continue the others.
            let usual = |n: i64, k: usize| if n < clouds_with || !is_wild(k) { time(n, k) } else { time(n, 31) };
            let (scans, loss, notes) = read(&clouds(name, kind, usual));
            assert_eq!(loss.impossible_point_times, 20 * clouds_with as u64, "{case}: {notes:?}");
            let sentence = format!("{} lidar returns have times far from those of their cloud", 20 * clouds_with);
            assert!(loss.sentences().iter().any(|loss| loss.starts_with(&sentence)), "{loss}");
            if clouds_with == CLOUDS && (name, kind) != ("t", UINT32) {
                check_without_wild(&scans, |_| true, &case);
            }
        }
    }
}

#[test]
fn times_of_64_bits_are_read() {
    type Way<'a> = (&'a str, u8, &'a dyn Fn(i64, usize) -> Vec<u8>);
    let stamp_ns = |n: i64, k: usize| START_NS + n * 100 * MS + after_ns(k);
    let ways: [Way<'_>; 5] = [
        ("timestamp", UINT64, &|n, k| (stamp_ns(n, k) as u64).to_le_bytes().to_vec()),
        ("timestamp", INT64, &|n, k| (stamp_ns(n, k) / 1000).to_le_bytes().to_vec()),
        ("t", UINT64, &|_, k| (after_ns(k) as u64).to_le_bytes().to_vec()),
        ("t", INT64, &|_, k| (after_ns(k) - 100 * MS).to_le_bytes().to_vec()),
        ("time_offset", INT64, &|_, k| (after_ns(k) / 1000).to_le_bytes().to_vec()),
    ];
    for (name, kind, time) in ways {
        let (mut scans, loss, notes) = read(&clouds(name, kind, time));
        assert!(loss.is_none(), "{name} {kind}: {loss} {notes:?}");
        if (name, kind) == ("t", INT64) {
            scans.iter_mut().for_each(|scan| scan.stamp += scan.stamped_after);
        }
        check_without_wild(&scans, |_| false, &format!("{name} {kind}"));
    }
}

#[test]
fn times_in_two_words_are_read() {
    let halves = |n: i64, k: usize| {
        let ns = (START_NS + n * 100 * MS + after_ns(k)) as u64;
        ((ns >> 32) as u32, ns as u32)
    };
    let seconds = |n: i64, k: usize| {
        let ns = START_NS + n * 100 * MS + after_ns(k);
        ((ns / 1_000_000_000) as u32, (ns % 1_000_000_000) as u32)
    };
    let read_pairs = |names: [&str; 2], pair: &dyn Fn(i64, usize) -> (u32, u32)| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for n in 0..CLOUDS {
            let point = |k: usize| {
                let (first, second) = pair(n, k);
                let xyz = [x_m(n, k), 2.0, 3.0].map(f32::to_le_bytes).concat();
                [xyz, first.to_le_bytes().to_vec(), second.to_le_bytes().to_vec()].concat()
            };
            let points: Vec<_> = (0..POINTS_EACH).map(point).collect();
            let [a, b] = names;
            let xyz = [("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32)];
            let fields: Vec<_> = xyz
                .into_iter()
                .chain([(a, 12, UINT32), (b, 16, UINT32)].into_iter().filter(|f| !f.0.is_empty()))
                .collect();
            let start_ns = START_NS + n * 100 * MS;
            let mut cloud = point_cloud(start_ns, &fields, 20, &points);
            if b.is_empty() {
                // One field of two words: the lower one first in little-endian clouds.
                cloud.fields[3].count = 2;
            }
            foreign.message("/imu", IMU, start_ns, &imu(start_ns, "imu")).message("/points", POINTS, start_ns, &cloud);
        }
        read(&foreign.reader()).0
    };
    check_without_wild(&read_pairs(["timestamp_h", "timestamp_l"], &halves), |_| false, "halves");
    check_without_wild(&read_pairs(["t_sec", "t_nsec"], &seconds), |_| false, "seconds");
    let swapped = |n: i64, k: usize| (halves(n, k).1, halves(n, k).0);
    check_without_wild(&read_pairs(["timestamp", ""], &swapped), |_| false, "two words");
}

#[test]
fn equal_and_missing_times_are_reported_with_the_fields() {
    for (name, value, problem) in
        [("t", 7_u32, "has the same time in all points of a cloud"), ("ring", 3, "has no field of point times")]
    {
        let (scans, loss, notes) = read(&clouds(name, UINT32, |_, _| value.to_le_bytes().to_vec()));
        assert!(loss.is_none() && scans.iter().all(|scan| scan.returns.iter().all(|point| point.offset.nanos() == 0)));
        let fields = format!("Its fields are x (float32), y (float32), z (float32), {name} (uint32)");
        let is_complete = |note: &&String| [problem, &fields, "time_offset, "].iter().all(|part| note.contains(part));
        assert_eq!(notes.iter().filter(is_complete).count(), 1, "{notes:?}");
    }
    // A field of a recognised name that is the same in all points is not used if another one has times.
    let time = |_: i64, k: usize| [7.5_f32.to_le_bytes(), (after_ns(k) as u32).to_le_bytes()].concat();
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..CLOUDS {
        let start_ns = START_NS + n * 100 * MS;
        let point = |k: usize| [[x_m(n, k), 2.0, 3.0].map(f32::to_le_bytes).concat(), time(n, k)].concat();
        let points: Vec<_> = (0..POINTS_EACH).map(point).collect();
        let fields: Fields<'_> = &[
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("time", 12, FLOAT32),
            ("offset_time", 16, UINT32),
        ];
        foreign.message("/imu", IMU, start_ns, &imu(start_ns, "imu"));
        foreign.message("/points", POINTS, start_ns, &point_cloud(start_ns, fields, 20, &points));
    }
    check_without_wild(&read(&foreign.reader()).0, |_| false, "two fields");
}

#[test]
fn times_of_points_without_a_return_decide_nothing() {
    // Two thirds of the points have no return and the time 0 or garbage, as some drivers write them.
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..CLOUDS {
        let start_ns = START_NS + n * 100 * MS;
        let point = |k: usize| {
            let (x, time_s) = match k % 3 {
                0 => (x_m(n, k), (start_ns + after_ns(k)) as f64 * 1e-9),
                1 => (f32::NAN, 0.0),
                _ => (f32::NAN, -5e17),
            };
            [[x, 2.0, 3.0].map(f32::to_le_bytes).concat(), f64::to_le_bytes(time_s).to_vec()].concat()
        };
        let points: Vec<_> = (0..POINTS_EACH).map(point).collect();
        let fields: Fields<'_> = &[("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("timestamp", 12, FLOAT64)];
        foreign.message("/imu", IMU, start_ns, &imu(start_ns, "imu"));
        foreign.message("/points", POINTS, start_ns, &point_cloud(start_ns, fields, 20, &points));
    }
    let (scans, loss, notes) = read(&foreign.reader());
    assert!(
        loss.is_none() && !notes.iter().any(|note| note.contains("clock") || note.contains("point times in")),
        "{notes:?}"
    );
    for (n, scan) in scans.iter().enumerate() {
        for (point, k) in scan.returns.iter().zip((0..POINTS_EACH).step_by(3)) {
            let off_ns = (scan.stamp + point.offset).nanos() - START_NS - n as i64 * 100 * MS - after_ns(k);
            assert!(off_ns.abs() < 500, "point {k} of cloud {n} is {off_ns} ns off");
        }
    }
}

#[test]
fn impossible_times_of_livox_points_are_dropped_and_counted() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..CLOUDS {
        let start_ns = START_NS + n * 100 * MS;
        let point = |k: usize| CustomPoint {
            // An offset below 0 that wrapped around.
            offset_time: if (11..31).contains(&k) { u32::MAX - 690_605_371 } else { after_ns(k) as u32 },
            xyz: [x_m(n, k), 2.0, 3.0],
            reflectivity_tag_line: [9, 0, 1],
        };
        let message = CustomMsg {
            header: header(start_ns, "livox_frame"),
            timebase: start_ns as u64,
            point_num: POINTS_EACH as u32,
            lidar_id: 1,
            rsvd: [0; 3],
            points: (0..POINTS_EACH).map(point).collect(),
        };
        foreign.message("/livox/imu", IMU, start_ns, &imu(start_ns, "imu"));
        foreign.message("/livox/lidar", "livox_ros_driver2/msg/CustomMsg", start_ns, &message);
    }
    let (scans, loss, _) = read(&foreign.reader());
    assert_eq!(loss.impossible_point_times, 20 * CLOUDS as u64);
    assert_eq!(loss.unreadable_messages, 0);
    check_without_wild(&scans, |_| true, "livox");
}
