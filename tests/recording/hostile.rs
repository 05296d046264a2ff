//! Recordings that declare more than they contain: little memory and time, and a clear error.

use crate::command::zsim;
use crate::recording::damage::file_with_chunk;
use crate::recording::foreign::bag::{bag_of_chunks, chunk_of, connection, database, record};
use std::io::Cursor;
use std::path::Path;
use std::process::Command;
use zsim::recording::{PlyReader, Reader, read_surfel_map, read_tum};
use zsim::time::Span;

const LONG_NAME: &str = "the name of a topic or type, of 20000000 bytes, exceeds 4096 bytes";

fn error_of(file: Vec<u8>) -> String {
    Reader::new("bomb", Cursor::new(file)).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_name_of_megabytes_is_an_error_in_every_container() {
    let name = "n".repeat(20_000_000);
    // A channel record of MCAP: number, schema, topic, encoding, no metadata.
    let fields = [&[1, 0, 0, 0][..], &20_000_000_u32.to_le_bytes(), name.as_bytes(), &[0; 8]].concat();
    let channel = [&[4][..], &(fields.len() as u64).to_le_bytes(), &fields].concat();
    let mcap = file_with_chunk(&zstd::encode_all(&channel[..], 1).unwrap(), "zstd", channel.len() as u64);
    assert!(mcap.len() < 10_000);
    let error = error_of(mcap);
    assert!(error.starts_with("bomb: ") && error.contains(LONG_NAME) && error.contains("mcap filter"), "{error}");
    for compression in ["none", "lz4", "bz2"] {
        for (topic, kind) in [(name.as_str(), "sensor_msgs/Imu"), ("/imu", name.as_str())] {
            let chunk = chunk_of(&connection(0, (topic, kind)), compression);
            let error = error_of(bag_of_chunks(&[chunk]));
            assert!(error.contains(LONG_NAME), "{compression}: {error}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    database(&path, &[("/imu", &name)], &[], false);
    let error = Reader::open(&path).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains(LONG_NAME), "{error}");
}

#[test]
fn names_that_are_too_many_are_an_error() {
    // 20,000 topics with names of 4 kB in each of two files; the files of a recording share their limit.
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = (0..20_000).map(|k| format!("{k:04096}")).collect();
    let topics: Vec<(&str, &str)> = names.iter().map(|name| (name.as_str(), "T")).collect();
    database(&folder.path().join("run_0.db3"), &topics, &[], false);
    Reader::open(folder.path()).unwrap();
    std::fs::hard_link(folder.path().join("run_0.db3"), folder.path().join("run_1.db3")).unwrap();
    let error = Reader::open(folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("run_1.db3: the size of names, chunk index and manifest exceeds 128 MiB"), "{error}");
}

/// Runs `zsim info` with a limit on its memory, KiB; returns the exit code and stderr.
#[cfg(target_os = "linux")]
fn info_within(kib: u64, file: &Path) -> (Option<i32>, String) {
    let command = zsim();
    let program = command.get_program().to_owned();
    let script = format!("ulimit -v {kib}; exec \"$0\" info \"$1\"");
    let output = Command::new("sh").args(["-c", &script]).arg(program).arg(file).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
#[cfg(target_os = "linux")]
fn chunks_without_messages_are_released() {
    let folder = tempfile::tempdir().unwrap();
    // 200 MB of empty records of an unknown kind, six times: 1.2 GB.
    let zeros = vec![0; 200_000_007];
    let chunk = file_with_chunk(&zstd::encode_all(&zeros[..], 1).unwrap(), "zstd", zeros.len() as u64);
    let mcap = [&chunk[..8], &chunk[8..].repeat(6)].concat();
    let chunk = chunk_of(&record(&[("op", &[9])], &zeros), "lz4");
    for (name, bytes) in [("empty.mcap", mcap), ("empty.bag", bag_of_chunks(&vec![chunk; 6]))] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let (code, stderr) = info_within(900_000, &path);
        assert_eq!(code, Some(3), "{name}: {stderr}");
        assert!(stderr.contains("The file is truncated"), "{name}: {stderr}");
    }
}

#[test]
fn a_chunk_of_a_million_empty_streams_is_damaged() {
    // The bytes of `printf '' | bzip2`.
    let empty = b"BZh9\x17\x72\x45\x38\x50\x90\0\0\0\0".repeat(1_000_000);
    let header: [(&str, &[u8]); 3] = [("op", &[5]), ("compression", b"bz2"), ("size", &1000_u32.to_le_bytes())];
    let chunk = record(&header, &empty);
    let reader = Reader::new("streams.bag", Cursor::new(bag_of_chunks(&[chunk]))).unwrap();
    assert_eq!(reader.info(Span::from_seconds(1.0)).unwrap().loss.damaged_chunks, 1);
}

#[test]
#[cfg(unix)]
fn a_pipe_or_device_is_refused_by_every_reader() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("run.mcap");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let errors = |path: &Path| {
        [
            Reader::open(path).map(|_| ()).unwrap_err().to_string(),
            read_tum(path).map(|_| ()).unwrap_err().to_string(),
            PlyReader::open(path).map(|_| ()).unwrap_err().to_string(),
            read_surfel_map(path).map(|_| ()).unwrap_err().to_string(),
        ]
    };
    for error in errors(&pipe) {
        assert!(error.ends_with("run.mcap: is a FIFO (pipe), not a regular file; specify a file on disk"), "{error}");
    }
    for error in errors(Path::new("/dev/zero")) {
        assert_eq!(error, "/dev/zero: is a device, not a regular file; specify a file on disk");
    }
    std::fs::rename(&pipe, folder.path().join("metadata.yaml")).unwrap();
    let error = Reader::open(folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("metadata.yaml: is a FIFO (pipe)"), "{error}");
}
