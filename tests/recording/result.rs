//! An estimate exported as a recording for viewers, read by the `mcap` crate.

use std::collections::BTreeMap;
use zsim::geometry::{Pose, Trajectory};
use zsim::recording::{CloudPoint, ResultWriter};
use zsim::time::Stamp;

#[test]
fn a_result_has_path_transform_pose_and_all_points_in_time_order() {
    let ms = |ms: i64| Stamp::from_nanos(ms * 1_000_000);
    let poses = (0..300).map(|k| (ms(10 * k), Pose::translation(k as f64, 0.0, 0.0)));
    let trajectory = Trajectory::from_poses(poses).unwrap();
    let points = (0..120_000).map(|k: i64| CloudPoint {
        point_in_map: nalgebra::Vector3::new(k as f32, 0.0, 0.0),
        intensity: 1.0,
        stamp: Stamp::from_nanos(k * 20_000),
        error_m: f32::NAN,
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.mcap");
    let mut result = ResultWriter::create(&path, "head", &trajectory, &[]).unwrap();
    points.for_each(|point| result.point(point).unwrap());
    result.finish().unwrap();

    let bytes = std::fs::read(path).unwrap();
    let mut counts = BTreeMap::new();
    let (mut last, mut points) = (0, 0);
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(message.log_time >= last, "{} goes back", message.channel.topic);
        last = message.log_time;
        *counts.entry(message.channel.topic.clone()).or_insert(0) += 1;
        if message.channel.topic == "/cloud" {
            // Header of `map`: 8 + 4 + 4 bytes; then height and width.
            points += u32::from_le_bytes(message.data[4 + 20..4 + 24].try_into().unwrap());
        }
    }
    assert_eq!((counts["/path"], counts["/tf"], points), (1, 300, 120_000));
    // 2.4 s of points, 0.5 s per message, at most 50,000 points per message.
    assert_eq!(counts["/cloud"], 5);
}
