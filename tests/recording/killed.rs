//! A process that is killed while it records loses only its last chunk.

use std::path::Path;
use std::process::{Command, Stdio};
use zsim::measurement::Sink;
use zsim::recording::{Reader, TopicPreference, Writer};
use zsim::time::Stamp;

/// Environment variable with the file that the child process records to.
const FILE: &str = "ZSIM_TEST_RECORDING";

#[test]
#[ignore = "never ends: the other test starts it in a child process and kills that"]
fn record_until_killed() {
    let Ok(path) = std::env::var(FILE) else { return };
    let mut writer = Writer::create(Path::new(&path), crate::recordings::run()).unwrap();
    for k in 0.. {
        let now = Stamp::from_nanos(k * 25_000_000);
        writer.lidar(now, &crate::recordings::planar_scan(now)).unwrap();
        writer.imu(now, &crate::recordings::imu_sample(now)).unwrap();
    }
}

#[test]
fn a_killed_process_loses_only_its_last_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "recording::killed::record_until_killed", "--ignored"])
        .env(FILE, &path)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let length = || std::fs::metadata(&path).map_or(0, |file| file.len());
    while length() < 2_000_000 {
        assert!(child.try_wait().unwrap().is_none(), "the child ended before it was killed");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();

    let reader = Reader::open(&path).unwrap();
    let selection = reader.select(&TopicPreference::default()).unwrap();
    let mut measurements = reader.measurements(&selection);
    let count = measurements.by_ref().filter(Result::is_ok).count();
    let loss = measurements.loss();
    assert!(loss.cut_short && loss.damaged_chunks == 0, "{loss}");
    // A chunk has 1 MB of messages; the loss is less than one compressed chunk.
    assert!(loss.lost_bytes < 1 << 20, "{loss}");
    // A sweep and a sample are at most 30 kB compressed: everything in the file was read.
    assert!(count as u64 * 15_000 > length() - loss.lost_bytes, "{count} measurements of {} bytes", length());
}
