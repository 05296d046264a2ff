//! Stamps that are not of their time, and clocks that are set while they run.

use crate::recording::foreign::{Foreign, IMU, POINTS, UINT32, cloud, imu};
use zsim::measurement::Measurement;
use zsim::recording::{Loss, TopicPreference};

const START_NS: i64 = 1_700_000_000_000_000_000;
const MS: i64 = 1_000_000;

/// IMU samples at 100 Hz and clouds at 10 Hz for 4 s, logged 2 to 6 ms after their end, with the stamps of `change` (is IMU, number, stamp).
///
/// Returns the stamps that are read, of samples and of clouds, ms after the start, and the loss.
fn read(change: impl Fn(bool, i64, i64) -> i64) -> ([Vec<i64>; 2], Loss) {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    let times: Vec<_> = (0..10_u32).map(|k| (k * 9_000_000).to_le_bytes().to_vec()).collect();
    for k in 0..400 {
        let (now, late) = (START_NS + k * 10 * MS, (2 + k * 3 % 5) * MS);
        let stamp = change(true, k, now);
        foreign.message("/imu", IMU, now + late, &imu(stamp, "imu"));
        if k % 10 == 0 {
            let stamp = change(false, k / 10, now);
            foreign.message("/points", POINTS, now + 90 * MS + late, &cloud(stamp, ("t", UINT32), &times));
        }
    }
    let reader = foreign.reader();
    let selection = reader.select(&TopicPreference::default()).unwrap();
    let mut measurements = reader.measurements(&selection);
    let mut stamps = [Vec::new(), Vec::new()];
    for measurement in measurements.by_ref() {
        let (sensor, stamp) = match measurement.unwrap() {
            Measurement::Imu(sample) => (0, sample.stamp),
            Measurement::Lidar(scan) => (1, scan.stamp + scan.stamped_after),
        };
        stamps[sensor].push((stamp.nanos() - START_NS) / MS);
    }
    (stamps, measurements.loss().clone())
}

#[test]
fn stamps_of_zero_and_lone_outliers_are_left_out_and_counted() {
    let ([samples, clouds], loss) = read(|is_imu, k, stamp| match (is_imu, k) {
        (true, 0..5 | 200) | (false, 0 | 20) => 0,
        (true, 300) => stamp - 3600 * 1000 * MS,
        (false, 30) => stamp + 86_400 * 1000 * MS,
        _ => stamp,
    });
    let expected: Vec<i64> = (5..400).filter(|k| ![200, 300].contains(k)).map(|k| 10 * k).collect();
    assert!(samples == expected, "{samples:?}");
    assert_eq!(clouds, (1..40).filter(|k| ![20, 30].contains(k)).map(|k| 100 * k).collect::<Vec<i64>>());
    assert_eq!((loss.outlying_stamps, loss.clock_steps.len()), (10, 0));
    assert!(
        loss.is_none() && loss.notes()[0].starts_with("dropped messages") && loss.notes()[0].ends_with(": 10"),
        "{loss:?}"
    );
}

#[test]
fn steps_of_the_clocks_are_left_out_of_the_stamps_and_reported() {
    // Of both sensors, of the IMU alone, and of the lidar alone and back again.
    type Change<'a> = &'a dyn Fn(bool, i64) -> i64;
    let both: Change = &|_, ms| if ms < 1995 { 0 } else { -5000 };
    let of_imu: Change = &|is_imu, ms| if is_imu && ms >= 1000 { 400 } else { 0 };
    let of_lidar: Change = &|is_imu, ms| if !is_imu && (1250..2950).contains(&ms) { 37_000 } else { 0 };
    for (change, steps_ms) in [(both, vec![-5000, -5000]), (of_imu, vec![400]), (of_lidar, vec![37_000, -37_000])] {
        let stamp =
            |is_imu: bool, k: i64, stamp: i64| stamp + change(is_imu, if is_imu { 10 * k } else { 100 * k }) * MS;
        let ([samples, clouds], loss) = read(stamp);
        assert!(samples == (0..400).map(|k| 10 * k).collect::<Vec<i64>>(), "{steps_ms:?}: {samples:?}");
        assert_eq!(clouds, (0..40).map(|k| 100 * k).collect::<Vec<i64>>(), "{steps_ms:?}");
        let found: Vec<i64> = loss.clock_steps.iter().map(|step| step.by.nanos() / MS).collect();
        assert_eq!((found, loss.outlying_stamps), (steps_ms, 0));
        assert!(loss.is_none());
    }
}
