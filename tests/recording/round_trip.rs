//! Recordings survive writing and reading.

use crate::recordings::{calibration, imu_sample, in_order, planar_scan, record, run};
use proptest::prelude::*;
use std::io::Cursor;
use zsim::geometry::{Kinematics, Pose, from_roll_pitch_yaw};
use zsim::measurement::{LidarScan, Measurement, PlanarScan, Sink};
use zsim::recording::{Reader, TopicPreference, Truth, Writer};
use zsim::time::{Span, Stamp};
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

#[test]
fn measurements_are_read_back_bit_for_bit() {
    let (bytes, written) = record(run(), 100);
    let reader = Reader::new("memory", Cursor::new(bytes)).unwrap();
    let selection = reader.select(&TopicPreference::default()).unwrap();
    assert_eq!((selection.lidar_topic.as_str(), selection.imu_topic.as_str()), ("/scan", "/imu/data_raw"));
    assert!(selection.notes.is_empty(), "{:?}", selection.notes);
    let mut measurements = reader.measurements(&selection);
    let read: Vec<_> = measurements.by_ref().map(|m| m.unwrap()).collect();
    assert!(measurements.loss().is_none(), "{}", measurements.loss());
    assert_eq!(read, in_order(written));
}

#[test]
fn points_are_read_back_bit_for_bit() {
    let (bytes, written) = record(run(), 100);
    let reader = Reader::new("memory", Cursor::new(bytes)).unwrap();
    let preference = TopicPreference { lidar_topic: Some("/points".to_owned()), imu_topic: None };
    let selection = reader.select(&preference).unwrap();
    let scans = |all: Vec<Measurement>| -> Vec<_> {
        all.into_iter().filter_map(|m| if let Measurement::Lidar(scan) = m { Some(scan) } else { None }).collect()
    };
    let read = scans(reader.measurements(&selection).map(|m| m.unwrap()).collect());
    for (read, written) in read.iter().zip(&scans(written)) {
        assert_eq!((read.stamp, &read.returns), (written.stamp, &written.returns));
    }
    assert_eq!(read.len(), 40);
}

#[test]
fn extrinsics_and_manifest_are_read_back() {
    let (bytes, _) = record(run(), 10);
    let reader = Reader::new("memory", Cursor::new(bytes)).unwrap();
    let selection = reader.select(&TopicPreference::default()).unwrap();
    let mut defaults = calibration();
    defaults.head_from_imu = Pose::identity();
    defaults.head_from_laser = Pose::identity();
    let found = reader.calibration(&selection, &defaults, None).unwrap();
    assert_eq!((found.calibration, found.body_frame.as_str()), (calibration(), "head"));
    assert!(found.from_recording);
    assert_eq!(reader.manifest(), Some("(seed: 1)"));
    // With the IMU as the body, the laser pose is the composition of both extrinsics.
    let of_imu = reader.calibration(&selection, &defaults, Some("imu_link")).unwrap().calibration;
    let expected = calibration().head_from_imu.inverse() * calibration().head_from_laser;
    assert!((of_imu.head_from_laser.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12);
    assert!((of_imu.head_from_imu.to_homogeneous() - Pose::identity().to_homogeneous()).norm() < 1e-12);
}

#[test]
fn ground_truth_is_read_separately_from_measurements() {
    let head = |k: i64| {
        let angle = k as f64 * 0.01;
        Pose::from_parts([angle, 2.0, 0.5].into(), from_roll_pitch_yaw(angle, -angle, 3.0 * angle))
    };
    let clock = ClockTruth { lidar_offset: Span::from_nanos(-5), imu_offset: Span::from_nanos(3_000_001) };
    let (file, bytes) = crate::recordings::shared_file();
    let mut writer = Writer::new(file, run()).unwrap();
    for k in 0..50 {
        let now = Stamp::from_nanos(k * 1_000_000);
        let sample = TruthSample {
            lidar_stamp: now + clock.lidar_offset,
            head: Kinematics::at_rest(head(k)),
            base: Kinematics::at_rest(Pose::identity()),
        };
        writer.truth(now, &sample).unwrap();
        writer.clock(now, &clock).unwrap();
        writer.lidar(now, &planar_scan(now)).unwrap();
        writer.imu(now, &imu_sample(now)).unwrap();
    }
    writer.finish().unwrap();
    let reader = Reader::new("memory", Cursor::new(bytes.take())).unwrap();
    let trajectory = reader.truth_trajectory().unwrap();
    for (k, (stamp, pose)) in (0..).zip(trajectory.iter()) {
        assert_eq!((stamp.nanos(), *pose), (k * 1_000_000 - 5, head(k)));
    }
    assert_eq!(trajectory.len(), 50);
    let clocks: Vec<_> = reader
        .truth()
        .filter_map(|t| if let Truth::Clock(now, c) = t.unwrap() { Some((now, c)) } else { None })
        .collect();
    assert_eq!(clocks.len(), 50);
    assert_eq!(clocks[7], (Stamp::from_nanos(7_000_000), clock));
}

#[test]
fn two_recordings_of_one_run_have_the_same_bytes() {
    assert_eq!(record(run(), 100).0, record(run(), 100).0);
}

/// Any sweep that a `LaserScan` can represent: beams with a return, and others encoded as in REP-117.
fn any_sweep() -> impl Strategy<Value = LidarScan> {
    let range = prop_oneof![0.1_f32..30.0, Just(f32::INFINITY), Just(f32::NEG_INFINITY), 30.01_f32..60.0];
    let beams = prop::collection::vec((range, 0_f32..1e4), 0..300);
    (beams, -3.2_f32..3.2, 1e-4_f32..0.1, 1e-7_f32..1e-4, 0_i64..1 << 60).prop_map(
        |(beams, angle_min, increment, step, stamp_ns)| {
            let (ranges_m, intensities): (Vec<_>, Vec<_>) = beams.into_iter().unzip();
            let planar = PlanarScan {
                angle_min_rad: angle_min.into(),
                angle_increment_rad: increment.into(),
                time_increment_s: step.into(),
                scan_time_s: 0.0,
                range_min_m: 0.1,
                range_max_m: 30.0,
                ranges_m,
                intensities,
            };
            crate::recordings::with_returns(Stamp::from_nanos(stamp_ns), planar)
        },
    )
}

proptest! {
    #![proptest_config(super::property_test())]

    #[test]
    fn any_sweep_is_read_back_bit_for_bit(sweeps in prop::collection::vec(any_sweep(), 1..5)) {
        let (file, bytes) = crate::recordings::shared_file();
        let mut writer = Writer::new(file, run()).unwrap();
        for (k, sweep) in (0..).zip(&sweeps) {
            writer.imu(Stamp::from_nanos(k), &imu_sample(Stamp::from_nanos(k))).unwrap();
            writer.lidar(Stamp::from_nanos(k), sweep).unwrap();
        }
        writer.finish().unwrap();
        let reader = Reader::new("memory", Cursor::new(bytes.take())).unwrap();
        let selection = reader.select(&TopicPreference::default()).unwrap();
        let read: Vec<_> = reader.measurements(&selection).map(|m| m.unwrap()).collect();
        let mut read: Vec<_> =
            read.into_iter().filter_map(|m| if let Measurement::Lidar(scan) = m { Some(scan) } else { None }).collect();
        // Sweeps that are years apart are read in log order.
        let mut sweeps = sweeps;
        read.sort_by_key(|sweep| sweep.stamp);
        sweeps.sort_by_key(|sweep| sweep.stamp);
        prop_assert_eq!(read, sweeps);
    }
}

/// A disk with this many free bytes.
struct FullDisk(usize);

impl std::io::Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 = self.0.checked_sub(bytes.len()).ok_or(std::io::ErrorKind::StorageFull)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_at_any_point() {
    for room in [0, 100, 10_000, 500_000, 1_000_000] {
        let result = Writer::new(FullDisk(room), run()).map_err(|e| e.to_string()).and_then(|mut writer| {
            for k in 0..200 {
                let now = Stamp::from_nanos(k * 25_000_000);
                writer.lidar(now, &planar_scan(now)).map_err(|e| e.to_string())?;
            }
            writer.finish().map_err(|e| e.to_string())
        });
        let message = result.unwrap_err();
        assert!(message.starts_with("writing stopped: ") && message.contains("the part written before"), "{message}");
    }
}

#[test]
fn a_dropped_writer_leaves_a_complete_file() {
    let (file, bytes) = crate::recordings::shared_file();
    let mut writer = Writer::new(file, run()).unwrap();
    writer.lidar(Stamp::from_nanos(0), &planar_scan(Stamp::from_nanos(0))).unwrap();
    drop(writer);
    let reader = Reader::new("memory", Cursor::new(bytes.take())).unwrap();
    assert!(reader.loss().is_none());
    assert_eq!(reader.info(Span::from_seconds(1.0)).unwrap().messages, 3);
}
