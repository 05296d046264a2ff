//! Point times in the encodings of different drivers.

use crate::recording::foreign::{FLOAT32, FLOAT64, Foreign, IMU, POINTS, UINT32, cloud, imu, scans, select};
use zsim::time::{Span, Stamp};

#[test]
fn every_encoding_of_point_times_gives_the_same_scan() {
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
            // A double of seconds since 1970 has a resolution of 0.24 us.
            let off_ns = (stamp - Stamp::from_nanos(stamp_ns + k as i64 * 1_000_000)).nanos();
            assert!(off_ns.abs() < 500, "{name} {kind}: point {k} is off by {off_ns} ns");
            assert_eq!(point.point_in_laser.z, 3.0 + k as f32);
        }
    }
}

#[test]
fn the_unit_of_point_times_is_determined_from_the_duration_of_clouds() {
    // Clouds of 90 ms at 10 Hz. The default units are nanoseconds for integers and seconds for floats.
    type Way<'a> = (&'a str, u8, &'a dyn Fn(usize) -> Vec<u8>);
    let ways: [Way<'_>; 5] = [
        ("t", UINT32, &|ms| (ms as u32 * 1_000_000).to_le_bytes().to_vec()),
        ("t", UINT32, &|ms| (ms as u32 * 1_000).to_le_bytes().to_vec()),
        ("offset_time", UINT32, &|ms| (ms as u32).to_le_bytes().to_vec()),
        ("time", FLOAT32, &|ms| (ms as f32 * 1e3).to_le_bytes().to_vec()),
        ("time", FLOAT64, &|ms| (ms as f64).to_le_bytes().to_vec()),
    ];
    for (name, kind, bytes) in ways {
        let times: Vec<_> = (0..10).map(|k| bytes(10 * k)).collect();
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, 0, &imu(0, "imu"));
        for stamp_ns in (0..8).map(|k| 1_700_000_000_000_000_000 + k * 100_000_000) {
            foreign.message("/points", POINTS, stamp_ns, &cloud(stamp_ns, (name, kind), &times));
        }
        for scan in scans(&foreign.reader()) {
            let offsets: Vec<_> = scan.returns.iter().map(|point| point.offset.nanos()).collect();
            assert_eq!(offsets, (0..10).map(|k| k * 10_000_000).collect::<Vec<_>>(), "{name} {kind}");
        }
    }
}

#[test]
fn times_by_another_clock_count_from_the_first_point() {
    // Lidar time since power-up, in TAI, or in fractions of a second; the stamp is from the computer's clock.
    let stamp_ns = 1_700_000_000_250_000_000_i64;
    let tai_s = 1_700_000_037.0;
    for (first, parts) in [(1234.5, 1.0), (tai_s, 1.0), (tai_s * 1e6, 1e6), (77.0e9, 1e9), (77.0e3, 1e3)] {
        let times: Vec<_> = (0..10).map(|k| (first + 0.01 * f64::from(k) * parts).to_le_bytes().to_vec()).collect();
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/imu", IMU, stamp_ns, &imu(stamp_ns, "imu"));
        foreign.message("/points", POINTS, stamp_ns, &cloud(stamp_ns, ("timestamp", FLOAT64), &times));
        let reader = foreign.reader();
        let scan = &scans(&reader)[0];
        assert_eq!(scan.stamp.nanos(), stamp_ns, "{first}");
        for (k, point) in scan.returns.iter().enumerate() {
            assert!((point.offset.seconds() - 0.01 * k as f64).abs() < 1e-6, "{first}: {point:?}");
        }
        let notes = select(&reader).notes;
        assert!(notes.iter().any(|note| note.contains("another clock")), "{notes:?}");
    }
}

#[test]
fn a_cloud_stamped_at_its_end_starts_at_its_first_point() {
    // Velodyne's driver stamps the last packet: times are negative seconds. Rows are rings, so times are not sorted.
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
    assert_eq!(scan.stamp + scan.stamped_after, Stamp::from_nanos(stamp_ns));
}

#[test]
fn absolute_times_close_to_zero_are_recognised() {
    // Absolute seconds of a simulation that starts at zero: at 2.0 s, points from 2.00 to 2.09 s.
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
