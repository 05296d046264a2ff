//! Recordings of other programs: other topics, message types, compression and order.

use crate::recording::foreign::{
    Foreign, IMU, Imu, POINTS, SCAN, TF, TransformStamped, UINT32, cloud, header, imu, scan, scans, select, transform,
};
use std::io::Cursor;
use zsim::geometry::Pose;
use zsim::measurement::Measurement;
use zsim::recording::{Reader, TopicPreference};

#[test]
fn compression_and_chunks_make_no_difference() {
    let read = |options: mcap::WriteOptions| {
        let mut foreign = Foreign::new(options);
        for k in 0..200_i64 {
            foreign.message("/sensors/imu/data", IMU, k * 10_000_000, &imu(k * 10_000_000, "imu"));
            // No two clouds are equal, as with a real sensor.
            let times: Vec<_> = (0..100_u32).map(|p| (p * 1000 + k as u32).to_le_bytes().to_vec()).collect();
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
    // Compresses the chunk of an uncompressed file in the frame format of the lz4 crate, and replaces it.
    let mut foreign = Foreign::new(mcap::WriteOptions::new().compression(None).emit_summary_records(false));
    foreign.message("/imu", IMU, 1, &imu(1, "imu")).message("/scan", SCAN, 2, &scan(2, 0.001, 0.1));
    foreign.writer.finish().unwrap();
    let plain = foreign.writer.into_inner().into_inner();
    let length = |at: usize| u64::from_le_bytes(plain[at..at + 8].try_into().unwrap());
    let start = 8 + 9 + length(8 + 1) as usize;
    assert_eq!(plain[start], 6, "the record after the header is the chunk");
    let size = length(start + 9 + 16);
    // Two times, a size, a CRC, the length of an empty name, a size: 40 bytes before the data.
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

#[test]
fn messages_written_by_topic_are_read_in_time_order() {
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
fn beams_without_a_return_are_recognised_as_in_rep_117() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/scan", SCAN, 0, &scan(0, 0.001, 0.1));
    let scans = scans(&foreign.reader());
    let offsets: Vec<_> = scans[0].returns.iter().map(|r| r.offset.nanos()).collect();
    // The time increment is a 32-bit float: 1 ms is exact to 47 ps.
    assert_eq!(offsets, [0, 1_000_000, 6_000_000, 7_000_000, 8_000_000, 9_000_000]);
    // Beam 6 points 0.6 rad to the left.
    let p = scans[0].returns[2].point_in_laser;
    assert!((p.x - 2.0 * 0.6_f32.cos()).abs() < 1e-6 && (p.y - 2.0 * 0.6_f32.sin()).abs() < 1e-6 && p.z == 0.0);
    assert_eq!(scans[0].planar.as_ref().unwrap().ranges_m.len(), 10);
}

#[test]
fn a_scan_without_beam_times_is_read_with_a_note() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/imu", IMU, 0, &imu(0, "imu")).message("/front", SCAN, 0, &scan(0, 0.0, 0.1));
    let reader = foreign.reader();
    assert!(select(&reader).notes[0].starts_with("/front states no time between beams; uniform rotation"));
    // 0.1 rad of a turn that takes 0.1 s: 0.1 / (2 pi) * 0.1 s = 1.591549 ms.
    assert_eq!(scans(&reader)[0].returns[1].offset.nanos(), 1_591_549);
}

#[test]
fn a_lidar_with_beam_times_is_preferred_and_other_sensors_are_listed() {
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
            "Of several lidar topics, /points is used, not /untimed.",
            "Of several IMU topics, /imu/data_raw is used, not /a/imu/data, /b/imu/data."
        ]
    );
    let asked = TopicPreference { lidar_topic: Some("/untimed".into()), imu_topic: Some("/b/imu/data".into()) };
    let selection = reader.select(&asked).unwrap();
    assert_eq!((&*selection.lidar_topic, &*selection.imu_frame), ("/untimed", "b"));
    let wrong = TopicPreference { lidar_topic: Some("/velodyne".into()), imu_topic: None };
    let error = reader.select(&wrong).unwrap_err().to_string();
    assert!(
        error.starts_with("foreign: topic /velodyne is missing or not of type sensor_msgs/msg/LaserScan or"),
        "{error}"
    );
}

#[test]
fn a_recording_without_an_imu_is_refused_with_its_topics() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1));
    let error = foreign.reader().select(&TopicPreference::default()).unwrap_err().to_string();
    let expected = "foreign: no IMU in the recording (sensor_msgs/msg/Imu); it has /scan (sensor_msgs/msg/LaserScan)";
    assert_eq!(error, expected);
}

#[test]
fn non_finite_samples_are_dropped_and_counted() {
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
fn accelerations_in_g_are_distinguished_from_m_per_s2() {
    // A swinging head: its acceleration other than gravity varies.
    for (unit, in_m_per_s2) in [(1.0, false), (9.80665, true)] {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        for k in 0..50_i64 {
            let mut sample = imu(k * 10_000_000, "imu");
            let swing = (k as f64 * 0.3).sin();
            sample.linear_acceleration = [0.6 * swing * unit, 0.0, (1.0 + 0.3 * swing * swing) * unit];
            foreign.message("/imu", IMU, k * 10_000_000, &sample);
        }
        foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1));
        let reader = foreign.reader();
        let selection = select(&reader);
        assert_eq!(selection.notes.iter().any(|note| note.contains("accelerations in g")), !in_m_per_s2);
        let samples = reader.measurements(&selection).filter_map(|measurement| match measurement.unwrap() {
            Measurement::Imu(sample) => Some(sample.specific_force_m_per_s2),
            Measurement::Lidar(_) => None,
        });
        for (k, force) in samples.enumerate() {
            let swing = (k as f64 * 0.3).sin();
            assert!((force.z / 9.80665 - 1.0 - 0.3 * swing * swing).abs() < 1e-12, "{k}: {force}");
        }
    }
}

#[test]
fn extrinsics_are_composed_along_any_path_in_the_tree() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    // base -> mast -> laser, base -> box -> imu: x is summed along each path.
    let tree = vec![transform("base", "mast", 1.0), transform("mast", "laser", 0.25), transform("base", "box", -2.0)];
    foreign.message("/tf_static", TF, 0, &tree).message("/tf_static", TF, 0, &vec![transform("box", "imu", 0.5)]);
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "/imu"));
    let reader = foreign.reader();
    let selection = select(&reader);
    let of = |body: Option<&str>| reader.calibration(&selection, &crate::recordings::calibration(), body);
    let found = of(None).unwrap();
    // Without a frame `head` the IMU is the body: the laser is at 1.25 - (-1.5) in it.
    assert_eq!(found.body_frame, "imu");
    assert_eq!(found.calibration.head_from_laser, Pose::translation(2.75, 0.0, 0.0));
    assert_eq!(found.calibration.head_from_imu, Pose::identity());
    assert_eq!(of(Some("mast")).unwrap().calibration.head_from_imu, Pose::translation(-2.5, 0.0, 0.0));
    let error = of(Some("gripper")).unwrap_err().to_string();
    assert!(error.starts_with("foreign: /tf_static does not connect frame laser to gripper; it has"), "{error}");
}

#[test]
fn a_lidar_connected_to_the_imu_is_preferred() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/tf_static", TF, 0, &vec![transform("imu", "laser", 0.25)]);
    // First by name and with beam times, but of unknown pose.
    let times: Vec<_> = (0..3_u32).map(|k| k.to_le_bytes().to_vec()).collect();
    foreign.message("/front/points", POINTS, 0, &cloud(0, ("t", UINT32), &times));
    foreign.message("/scan", SCAN, 0, &scan(0, 0.0, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
    let reader = foreign.reader();
    let selection = select(&reader);
    assert_eq!(selection.lidar_topic, "/scan");
    let lost = TopicPreference { lidar_topic: Some("/front/points".into()), imu_topic: None };
    let error =
        reader.calibration(&reader.select(&lost).unwrap(), &crate::recordings::calibration(), None).unwrap_err();
    assert!(error.to_string().contains("--lidar-topic"), "{error}");
}

#[test]
fn a_transform_tree_with_a_cycle_or_two_parents_is_an_error() {
    let with_tree = |tree: Vec<TransformStamped>| {
        let mut foreign = Foreign::new(mcap::WriteOptions::new());
        foreign.message("/tf_static", TF, 0, &tree);
        foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
        let reader = foreign.reader();
        reader.calibration(&select(&reader), &crate::recordings::calibration(), None).unwrap_err().to_string()
    };
    let circle = with_tree(vec![transform("laser", "imu", 1.0), transform("imu", "laser", 1.0)]);
    assert!(circle.contains("/tf_static is not usable: frame laser is above itself"), "{circle}");
    let fork = with_tree(vec![transform("a", "imu", 1.0), transform("b", "imu", 1.0)]);
    assert!(fork.contains("/tf_static is not usable: frame imu has 2 parents, a and b"), "{fork}");
}

#[test]
fn a_recording_without_tf_static_uses_the_defaults_with_a_note() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
    let reader = foreign.reader();
    let found = reader.calibration(&select(&reader), &crate::recordings::calibration(), None).unwrap();
    assert_eq!(found.calibration, crate::recordings::calibration());
    assert!(!found.from_recording);
}

#[test]
fn a_type_name_without_msg_is_recognised() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    foreign.message("/scan", "sensor_msgs/LaserScan", 0, &scan(0, 0.001, 0.1));
    foreign.message("/imu", "sensor_msgs/Imu", 0, &imu(0, "imu"));
    assert_eq!(scans(&foreign.reader()).len(), 1);
}

#[test]
fn a_folder_must_be_one_recording() {
    let folder = tempfile::tempdir().unwrap();
    let message = || Reader::open(folder.path()).map(|reader| reader.name().to_owned()).map_err(|e| e.to_string());
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    assert!(message().unwrap_err().contains("contains no recording (.mcap, .db3, .bag)"));
    put("metadata.yaml", b"");
    let (bytes, _) = crate::recordings::record(crate::recordings::run(), 1);
    put("run_0.mcap", &bytes);
    assert!(message().unwrap().ends_with("run_0.mcap"));
    put("other.mcap", &bytes);
    assert!(message().unwrap_err().contains("contains 2 recordings; specify one of them"));
    put(
        "metadata.yaml",
        b"rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths: [run_0.mcap, run_1.mcap]\n",
    );
    assert!(message().unwrap_err().contains("lacks the file `run_1.mcap`, which its metadata.yaml lists"));
    put("metadata.yaml", b"rosbag2_bagfile_information:\n  relative_file_paths: [run_0.mcap, run_0.mcap]\n");
    assert!(message().unwrap_err().contains("it lists a file twice"));
    put("run_1.mcap.zstd", &bytes);
    put("metadata.yaml", b"rosbag2_bagfile_information:\n  relative_file_paths:\n    - run_1.mcap.zstd\n");
    assert!(message().unwrap_err().contains("decompress it with `zstd -d --rm "));
    put("run_1.mcap", &bytes);
    assert!(message().unwrap().ends_with("run_1.mcap"));
    put("metadata.yaml", b"a: [");
    assert!(message().unwrap_err().contains("has an unreadable metadata.yaml"));
}
