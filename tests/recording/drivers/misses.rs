//! Beams without a return, and scans and clouds that are empty or cannot be decoded.

use super::{Fields, MS, START_NS, point_cloud, room, wall_m};
use crate::recording::foreign::{
    FLOAT32, Foreign, IMU, LaserScan, POINTS, SCAN, UINT32, header, imu, scan, scans, select,
};
use zsim::recording::{Reader, TopicPreference};

const XYZ: Fields<'static> = &[("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("t", 12, UINT32)];

fn with_scans(range: [f32; 2], miss: f32) -> Reader {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..10 {
        let ns = START_NS + n as i64 * 100 * MS;
        foreign.message("/imu", IMU, ns, &imu(ns, "imu")).message("/scan", SCAN, ns, &room(n, range, miss));
    }
    foreign.reader()
}

#[test]
fn every_encoding_of_a_miss_is_read_as_in_rep_117() {
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
        // Without a plausible range_max.
        ([0.1, 0.0], f32::INFINITY, ""),
        ([0.1, f32::NAN], f32::NAN, "as NaN"),
        ([0.1, f32::MAX], 81.91, "as a constant 81.91 m (14.2 % of its beams)"),
        ([0.0, 0.0], 81.91, "as a constant 81.91 m"),
        // A range_max that differs from the encoded value.
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

#[test]
fn misses_in_clouds_are_not_returns() {
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
fn a_lidar_that_cannot_be_decoded_is_an_error_with_the_reason() {
    let error = |angles: [f32; 3], times: [f32; 2]| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        let scan = LaserScan { angles, time_increment: times[0], scan_time: times[1], ..room(0, [0.1, 30.0], 0.0) };
        foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/sc\u{1b}[31man", SCAN, 0, &scan);
        foreign.reader().select(&TopicPreference::default()).unwrap_err().to_string()
    };
    let unusable = "foreign: no lidar topic can be used: topic /sc\\u{1b}[31man: ";
    let kind = " in its first sensor_msgs/msg/LaserScan message";
    assert_eq!(error([0.0, 1.0, f32::NAN], [0.0; 2]), format!("{unusable}angle_increment is NaN or infinite{kind}"));
    assert_eq!(error([0.0, 1.0, 0.0], [0.0; 2]), format!("{unusable}angle_increment is 0 with several ranges{kind}"));
    assert!(error([0.0, 1.0, 0.1], [1e20, 0.0]).contains("give a scan of more than 60 s"));
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    let cloud = point_cloud(0, &[("range", 0, FLOAT32)], 4, &[vec![0; 4]]);
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/points", POINTS, 0, &cloud);
    let error = foreign.reader().select(&TopicPreference::default()).unwrap_err().to_string();
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
    // Beam times come from the first scan that has beams.
    let notes = select(&reader).notes;
    assert!(!notes.iter().any(|note| note.contains("states no")), "{notes:?}");
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu"));
    foreign.message("/points", POINTS, 1, &point_cloud(1, &[], 0, &[]));
    assert_eq!(scans(&foreign.reader())[0].returns.len(), 0);
}
