//! laspy reads clouds written as LAS. The test is skipped if laspy is not installed.

use crate::recording::readers::python;
use crate::skip::run_or_skip;
use std::fmt::Write;
use std::fs::File;
use std::path::Path;
use zsim::recording::{CloudPoint, LasWriter};
use zsim::time::Stamp;

#[test]
fn laspy_reads_coordinates_intensity_time_and_error() {
    let folder = tempfile::tempdir().unwrap();
    let (las, expected) = (folder.path().join("cloud.las"), folder.path().join("expected.txt"));
    let mut writer = LasWriter::new(File::create(&las).unwrap()).unwrap();
    let mut text = String::new();
    for k in 0..5000_i64 {
        let wave = |m: f64| ((k as f64 * m).sin() * 40.0) as f32;
        let point = CloudPoint {
            point_in_map: nalgebra::Vector3::new(wave(0.7), wave(1.1), wave(1.9)),
            intensity: 300.0 + wave(0.3),
            stamp: Stamp::from_nanos(1_000_000_000 + k * 25_000),
            error_m: 0.01 + 1e-6 * k as f32,
        };
        writer.point(&point).unwrap();
        let (p, time_s) = (point.point_in_map, 1.0 + k as f64 * 25e-6);
        writeln!(text, "{} {} {} {} {time_s} {}", p.x, p.y, p.z, point.intensity, point.error_m).unwrap();
    }
    writer.finish().unwrap();
    std::fs::write(&expected, text).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check_las.py");
    let Some(output) = run_or_skip("laspy", python().args([&script, &las, &expected])) else { return };
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
    assert!(stdout.starts_with("ok 5000 "), "{stdout}");
}
