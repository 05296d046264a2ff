//! Layouts of clouds: lengths of rows, and fields of any type.

use super::{Fields, MS, START_NS, point_cloud};
use crate::recording::foreign::{FLOAT32, FLOAT64, Foreign, IMU, POINTS, PointCloud2, UINT32, imu, scans, select};
use zsim::recording::{Reader, TopicPreference};

const XYZ_T: Fields<'static> = &[("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("t", 12, UINT32)];
const HEIGHT: usize = 4;
const WIDTH: usize = 50;

fn points(extra: usize) -> Vec<Vec<u8>> {
    let point = |k: usize| {
        let xyz = [1.0 + k as f32, 2.0, 3.0].map(f32::to_le_bytes).concat();
        [xyz, (k as u32 * 400_000).to_le_bytes().to_vec(), vec![0xff; extra]].concat()
    };
    (0..HEIGHT * WIDTH).map(point).collect()
}

fn recording(cloud: impl Fn(i64) -> PointCloud2) -> Reader {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for n in 0..6 {
        let ns = START_NS + n * 100 * MS;
        foreign.message("/imu", IMU, ns, &imu(ns, "imu")).message("/points", POINTS, ns, &cloud(ns));
    }
    foreign.reader()
}

fn first_xs(reader: &Reader) -> Vec<f32> {
    scans(reader)[0].returns.iter().map(|point| point.point_in_laser.x).collect()
}

#[test]
fn a_wrong_length_of_rows_is_ignored_if_the_points_fill_the_data() {
    let in_rows = |ns: i64, row_step: u32| PointCloud2 {
        height: HEIGHT as u32,
        width: WIDTH as u32,
        row_step,
        ..point_cloud(ns, XYZ_T, 16, &points(0))
    };
    let expected: Vec<_> = (0..HEIGHT * WIDTH).map(|k| 1.0 + k as f32).collect();
    let right = 16 * WIDTH as u32;
    for row_step in [right, 0, 1, right - 1, right + 1, HEIGHT as u32 * right, 3, u32::MAX] {
        let reader = recording(|ns| in_rows(ns, row_step));
        assert_eq!(first_xs(&reader), expected, "{row_step}");
        let notes = select(&reader).notes;
        let is_noted = notes.iter().any(|note| note.contains(&format!("a row_step of {row_step} bytes")));
        assert_eq!(is_noted, row_step != right, "{row_step}: {notes:?}");
    }
    // Rows with a gap of 8 bytes; the last row may lack it.
    for missing in [0, 8] {
        let reader = recording(|ns| {
            let mut cloud = in_rows(ns, right + 8);
            let rows: Vec<_> = cloud.data.chunks(right as usize).map(|row| [row, &[0xff; 8]].concat()).collect();
            cloud.data = rows.concat();
            cloud.data.truncate(cloud.data.len() - missing);
            cloud
        });
        assert_eq!(first_xs(&reader), expected);
    }
    let reader = recording(|ns| PointCloud2 { height: 5, ..in_rows(ns, right) });
    let error = reader.select(&TopicPreference::default()).unwrap_err().to_string();
    assert!(error.contains("less data than its width and height require"), "{error}");
}

#[test]
fn fields_that_are_not_used_are_not_judged() {
    // 64-bit integers, a flag, an unknown type, a field behind the end of a point, and one at the largest offset.
    for extra in [
        ("id", 16, 9),
        ("id", 16, 10),
        ("valid", 16, 11),
        ("a", 16, 0),
        ("a", 16, 200),
        ("b", 23, 8),
        ("b", u32::MAX, 8),
    ] {
        let fields = [XYZ_T, &[extra]].concat();
        let reader = recording(|ns| point_cloud(ns, &fields, 24, &points(8)));
        assert_eq!(first_xs(&reader).len(), HEIGHT * WIDTH, "{extra:?}");
        assert_eq!(select(&reader).notes, [""; 0], "{extra:?}");
    }
    // A time field of an unknown type is as good as none, which a note states with its type.
    let fields = [&XYZ_T[..3], &[("t", 12, 17)]].concat();
    let reader = recording(|ns| point_cloud(ns, &fields, 16, &points(0)));
    let notes = select(&reader).notes;
    assert!(
        notes.iter().any(|note| note.contains("no field of point times") && note.contains("t (datatype 17)")),
        "{notes:?}"
    );
}

#[test]
fn a_refused_field_is_named_with_its_type() {
    let refused = |x: (&str, u32, u8)| {
        let fields = [&[x], &XYZ_T[1..]].concat();
        let reader = recording(|ns| point_cloud(ns, &fields, 16, &points(0)));
        reader.select(&TopicPreference::default()).unwrap_err().to_string()
    };
    let unknown = refused(("x", 0, 42));
    assert!(unknown.contains("topic /points: field x (datatype 42) has an unknown type"), "{unknown}");
    let beyond = refused(("x", 12, FLOAT64));
    assert!(beyond.contains("field x (float64) exceeds the size of a point"), "{beyond}");
}
