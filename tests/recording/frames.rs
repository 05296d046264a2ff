//! Frames: broken, doubly parented, namespaced and moving transforms, and topics with messages of several frames.

use crate::recording::foreign::{
    FLOAT32, Foreign, IMU, LaserScan, POINTS, SCAN, TF, TransformStamped, cloud, header, imu, scan, select, transform,
};
use zsim::geometry::Pose;
use zsim::measurement::Measurement;
use zsim::recording::{FoundCalibration, Reader};

fn with_transforms(transforms: &[(&str, Vec<TransformStamped>)]) -> Reader {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for (k, (topic, transforms)) in transforms.iter().enumerate() {
        foreign.message(topic, TF, k as i64, transforms);
    }
    foreign.message("/scan", SCAN, 0, &scan(0, 0.001, 0.1)).message("/imu", IMU, 0, &imu(0, "imu"));
    foreign.reader()
}

fn calibrate(reader: &Reader) -> Result<FoundCalibration, String> {
    let found = reader.calibration(&select(reader), &crate::recordings::calibration(), None);
    found.map_err(|error| error.to_string())
}

fn turned(parent: &str, child: &str, rotation: [f64; 4]) -> TransformStamped {
    TransformStamped { rotation, ..transform(parent, child, 0.5) }
}

#[test]
fn broken_frames_that_are_not_needed_are_notes() {
    let sensors = || vec![transform("head", "laser", 0.25), transform("head", "imu", -0.5)];
    let found = |extra: Vec<TransformStamped>| {
        let reader = with_transforms(&[("/tf_static", sensors()), ("/tf_static", extra)]);
        let found = calibrate(&reader).unwrap();
        assert_eq!(found.calibration.head_from_laser, Pose::translation(0.25, 0.0, 0.0));
        found.notes
    };
    let extras = [
        (vec![turned("head", "gripper", [0.0; 4])], "frame gripper in head is not usable: the quaternion"),
        (
            vec![turned("head", "gripper", [f64::NAN; 4])],
            "frame gripper in head is not usable: a number of the pose is NaN",
        ),
        (vec![transform("head", "arm", f64::INFINITY)], "frame arm in head is not usable"),
        (
            vec![transform("head", "camera", 0.1), transform("mast", "camera", 0.0)],
            "frame camera has 2 parents, head and mast",
        ),
        // Frames above the common frame are not between the sensors.
        (vec![transform("a", "head", 0.1), transform("b", "head", 0.0)], "frame head has 2 parents, a and b"),
        (vec![transform("left", "right", 0.1), transform("right", "left", 0.0)], ""),
    ];
    for (extra, note) in extras {
        let notes = found(extra);
        assert!(
            notes.iter().all(|n| n.contains(note)) && notes.len() == usize::from(!note.is_empty()),
            "{note}: {notes:?}"
        );
    }
    // Needed, they are errors with the frame's name.
    let refused = |extra| calibrate(&with_transforms(&[("/tf_static", extra)])).unwrap_err();
    let zero = refused(vec![turned("head", "laser", [0.0; 4]), transform("head", "imu", 0.0)]);
    assert!(zero.contains("/tf_static is not usable: the transform of frame laser in head is not usable"), "{zero}");
    let fork =
        refused(vec![transform("head", "laser", 0.0), transform("mast", "laser", 0.0), transform("head", "imu", 0.0)]);
    assert!(fork.contains("frame laser has 2 parents, head and mast"), "{fork}");
}

#[test]
fn a_later_transform_of_the_same_frames_replaces_a_broken_one() {
    let broken = vec![turned("head", "laser", [0.0; 4]), transform("head", "imu", 0.0)];
    let found =
        calibrate(&with_transforms(&[("/tf_static", broken), ("/tf_static", vec![transform("head", "laser", 0.25)])]));
    assert_eq!(found.unwrap().calibration.head_from_laser, Pose::translation(0.25, 0.0, 0.0));
}

#[test]
fn transforms_of_a_namespace_are_used_with_a_note() {
    let of = |x: f64| vec![transform("head", "laser", x), transform("head", "imu", -0.5)];
    let found = calibrate(&with_transforms(&[("/a200_0000/tf_static", of(0.25))])).unwrap();
    assert!(found.from_recording);
    assert_eq!(found.calibration.head_from_laser, Pose::translation(0.25, 0.0, 0.0));
    assert_eq!(found.notes, ["The poses of the sensors are from /a200_0000/tf_static."]);
    // Those without a namespace are preferred, unless they do not connect the sensors.
    let found = calibrate(&with_transforms(&[("/a/tf_static", of(0.25)), ("/tf_static", of(0.75))])).unwrap();
    assert_eq!((found.calibration.head_from_laser, found.notes.len()), (Pose::translation(0.75, 0.0, 0.0), 0));
    let other = vec![transform("map", "odom", 0.0)];
    let found = calibrate(&with_transforms(&[("/tf_static", other), ("/a/tf_static", of(0.25))])).unwrap();
    assert_eq!(found.calibration.head_from_laser, Pose::translation(0.25, 0.0, 0.0));
}

#[test]
fn transforms_of_tf_are_used_if_they_are_constant() {
    let sensors = |x: f64| vec![transform("base", "laser", x), transform("base", "imu", -0.5)];
    let odom = |x: f64| vec![transform("odom", "base", x)];
    let found = calibrate(&with_transforms(&[
        ("/tf", odom(0.0)),
        ("/tf", sensors(0.25)),
        ("/tf", odom(1.0)),
        ("/tf", sensors(0.25)),
    ]));
    let found = found.unwrap();
    assert!(found.from_recording);
    assert_eq!(found.calibration.head_from_laser, Pose::translation(0.75, 0.0, 0.0));
    assert_eq!(found.notes, ["The poses of the sensors are from /tf, where they are constant."]);
    // A part in /tf_static, a part in /tf.
    let fixed = vec![transform("base", "imu", -0.5), transform("mount", "laser", 0.25)];
    let mount = |x: f64| vec![transform("base", "mount", x)];
    let found =
        calibrate(&with_transforms(&[("/tf_static", fixed), ("/tf", mount(1.0)), ("/tf", mount(1.0))])).unwrap();
    assert_eq!(found.calibration.head_from_laser, Pose::translation(1.75, 0.0, 0.0));
    // A mount that moves.
    let fixed = vec![transform("base", "imu", -0.5), transform("mount", "laser", 0.25)];
    let error =
        calibrate(&with_transforms(&[("/tf_static", fixed), ("/tf", mount(1.0)), ("/tf", mount(1.1))])).unwrap_err();
    let parts = [
        "/tf_static does not connect",
        "/tf joins the frames laser and imu, but frame mount moves in base",
        "--calibration",
    ];
    assert!(parts.iter().all(|part| error.contains(part)), "{error}");
}

#[test]
fn messages_of_another_frame_are_not_mixed_with_the_sensors() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for k in 0..40_i64 {
        let ns = k * 25_000_000;
        foreign.message("/imu", IMU, ns, &imu(ns, "imu"));
        // The first message is of the lidar that has fewer.
        let frame = if k % 3 == 0 { "rear" } else { "front" };
        let ranges = vec![2.0 + k as f32 * 1e-3; 10];
        foreign.message("/scan", SCAN, ns, &LaserScan { header: header(ns, frame), ranges, ..scan(ns, 0.001, 0.1) });
    }
    let reader = foreign.reader();
    let selection = select(&reader);
    assert_eq!(selection.lidar_frame, "front");
    let several = "/scan has messages of several frames: those of front are used, not those of rear.";
    assert!(selection.notes.iter().any(|note| note == several), "{:?}", selection.notes);
    let mut measurements = reader.measurements(&selection);
    let scans = measurements.by_ref().filter(|m| matches!(m, Ok(Measurement::Lidar(_)))).count();
    let loss = measurements.loss();
    assert_eq!((scans, loss.is_none()), (26, true));
    assert_eq!(loss.notes(), ["14 messages of /scan have the frame rear, not that of the sensor, and were not used"]);
    // Clouds and IMUs too.
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for k in 0..40_i64 {
        let (ns, other) = (k * 25_000_000, k % 4 == 1);
        foreign.message("/imu", IMU, ns, &imu(ns, if other { "second_imu" } else { "/imu" }));
        let mut cloud =
            cloud(ns, ("time", FLOAT32), &[0.0_f32.to_le_bytes().to_vec(), 0.02_f32.to_le_bytes().to_vec()]);
        cloud.data[..4].copy_from_slice(&(1.0 + 0.01 * k as f32).to_le_bytes());
        cloud.header = header(ns, if other { "second" } else { "first" });
        foreign.message("/points", POINTS, ns, &cloud);
    }
    let reader = foreign.reader();
    let mut measurements = reader.measurements(&select(&reader));
    let all = measurements.by_ref().count();
    assert_eq!((all, measurements.loss().other_frames.len()), (60, 2), "{:?}", measurements.loss());
}
