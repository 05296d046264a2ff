//! Split IMU messages, units and conventions of accelerations, and stamps of another epoch.

use super::{MS, START_NS, moving, room};
use crate::recording::foreign::{self, Foreign, IMU, SCAN, select};
use zsim::measurement::{ImuSample, Measurement};
use zsim::recording::{Reader, TopicPreference};

/// Samples of a selection, and its notes.
fn samples(reader: &Reader) -> (Vec<ImuSample>, Vec<String>) {
    let selection = select(reader);
    let measurements = reader.measurements(&selection).map(|m| m.unwrap());
    let samples = measurements.filter_map(|m| if let Measurement::Imu(s) = m { Some(s) } else { None }).collect();
    (samples, selection.notes)
}

#[test]
fn split_imu_messages_are_paired_or_refused() {
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
            // Accelerations have half the rate and are 1 ms later.
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
            // The nearest acceleration is 1 or 4 ms away; the derivative is at most 1.5 * 8.2 = 12 m/s^3 along x.
            let force = sample.specific_force_m_per_s2;
            let truth = zsim::geometry::Vector::from(moving(ns).linear_acceleration);
            assert!((force - truth).norm() < 0.08, "{force} {truth}");
        }
    }
    let error = |topics| record(topics).select(&TopicPreference::default()).unwrap_err().to_string();
    let lacks = error([Some("/imu/gyro"), None, None]);
    assert!(lacks.contains("IMU topic /imu/gyro has zeros for acceleration, and no other topic has it"), "{lacks}");
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
    let error = linear.select(&TopicPreference::default()).unwrap_err().to_string();
    assert!(error.contains("IMU topic /phone/imu has accelerations without gravity (median 1."), "{error}");
    assert!(error.contains("TYPE_ACCELEROMETER"), "{error}");
    let (in_g, notes) = samples(&record(12, &|force| force.map(|c| c / 9.806_65)));
    assert!(notes.iter().any(|note| note.contains("accelerations in g")), "{notes:?}");
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
    // IMU time since power-up; TAI; 60 s off; 0.2 s off.
    for ahead_ns in [-START_NS + 5_000_000_000, 37_000_000_000, -60_000_000_000, 200 * MS] {
        let (first_ns, notes) = record(ahead_ns, 2);
        assert!(first_ns.abs() < 10 * MS, "{ahead_ns}: {first_ns}");
        assert!(notes[0].starts_with("By log times, the stamps of /imu and /scan differ by "), "{notes:?}");
    }
    // Offsets that the estimator determines better, and offsets below the jitter of log times.
    assert_eq!(record(15 * MS, 2), (15 * MS, Vec::new()));
    assert_eq!(record(200 * MS, 150), (200 * MS, Vec::new()));
}
