//! laspy reads clouds written as LAS. The test prints `skipped` if laspy is not installed.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::fmt::Write;
use std::fs::File;
use std::path::Path;
use std::process::Command;
use zsim::recording::{CloudPoint, LasWriter};
use zsim::time::Stamp;

#[test]
fn laspy_reads_coordinates_intensity_time_and_error() {
    let python = std::env::var("ZSIM_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    if Command::new(&python).arg("--version").output().is_err() {
        return println!("skipped: python is not installed");
    }
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
    let output = Command::new(python).args([&script, &las, &expected]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.starts_with("ok 5000 ") || said.starts_with("skipped: "), "{said}");
    print!("{said}");
}
