//! rosbag2 databases in WAL mode: all content is read, and nothing is written next to them.

use crate::recording::foreign::bag::database;
use crate::recording::formats::{TOPICS, content, expected, ros_2_messages};
use std::collections::BTreeMap;
use std::path::Path;
use zsim::recording::Reader;
use zsim::time::Span;

/// Names and contents of the files in `folder`.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(path).unwrap()))
        .collect()
}

/// Writes a database in WAL mode to `folder`, as a recorder that was killed leaves it: without `-shm`, and with the
/// messages from `in_log` in the log only.
fn write_with_log(folder: &Path, name: &str, in_log: usize) {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("live.db3");
    let messages = ros_2_messages();
    database(&path, &TOPICS, &messages[..in_log], false);
    let recorder = rusqlite::Connection::open(&path).unwrap();
    recorder.execute_batch("PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0").unwrap();
    for (topic, logged, bytes) in &messages[in_log..] {
        let row = (*topic as i64 + 1, logged, bytes);
        recorder.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)", row).unwrap();
    }
    std::fs::copy(&path, folder.join(name)).unwrap();
    let log = temporary.path().join("live.db3-wal");
    if log.metadata().is_ok_and(|log| log.len() > 0) {
        std::fs::copy(log, folder.join(format!("{name}-wal"))).unwrap();
    }
}

fn messages(path: &Path) -> u64 {
    let info = Reader::open(path).unwrap().info(Span::from_seconds(0.5)).unwrap();
    assert!(info.loss.is_none(), "{}", info.loss);
    info.messages
}

#[test]
fn content_of_the_log_is_read_without_writing_a_file() {
    // All in the database, half of it in the log, and nearly all.
    for in_log in [121, 60, 1] {
        let folder = tempfile::tempdir().unwrap();
        write_with_log(folder.path(), "run #1 100%?.db3", in_log);
        let before = files(folder.path());
        assert_eq!(before.len(), if in_log < 121 { 2 } else { 1 });
        let reader = Reader::open(&folder.path().join("run #1 100%?.db3")).unwrap();
        assert!(content(&reader) == expected(), "{in_log} messages before the log");
        drop(reader);
        assert!(files(folder.path()) == before, "{in_log}: {:?}", files(folder.path()).keys());
    }
}

#[test]
fn an_empty_log_is_no_content() {
    let folder = tempfile::tempdir().unwrap();
    write_with_log(folder.path(), "run.db3", 121);
    std::fs::write(folder.path().join("run.db3-wal"), "").unwrap();
    let before = files(folder.path());
    assert_eq!(messages(&folder.path().join("run.db3")), 121);
    assert!(files(folder.path()) == before);
}

#[test]
#[cfg(unix)]
fn a_database_behind_a_link_is_read_with_its_log() {
    let (folder, links) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    write_with_log(folder.path(), "run.db3", 60);
    let link = links.path().join("link.db3");
    std::os::unix::fs::symlink(folder.path().join("run.db3"), &link).unwrap();
    assert_eq!(messages(&link), 121);
    assert_eq!(files(links.path()).len() + files(folder.path()).len(), 3);
}

#[test]
fn a_damaged_log_gives_the_content_before_the_damage() {
    let folder = tempfile::tempdir().unwrap();
    write_with_log(folder.path(), "run.db3", 60);
    let log = folder.path().join("run.db3-wal");
    let mut bytes = std::fs::read(&log).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x55;
    std::fs::write(&log, bytes).unwrap();
    let read = messages(&folder.path().join("run.db3"));
    assert!((60..121).contains(&read), "{read}");
}

#[test]
fn an_interrupted_transaction_is_an_error_with_its_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let live = tempfile::tempdir().unwrap();
    let path = live.path().join("run.db3");
    database(&path, &TOPICS, &ros_2_messages(), false);
    // With a cache of one page the change goes to the file before it is committed.
    let recorder = rusqlite::Connection::open(&path).unwrap();
    recorder.execute_batch("PRAGMA cache_size = 1; BEGIN; UPDATE messages SET timestamp = 0").unwrap();
    for name in ["run.db3", "run.db3-journal"] {
        std::fs::copy(live.path().join(name), folder.path().join(name)).unwrap();
    }
    let error = Reader::open(&folder.path().join("run.db3")).map(|_| ()).unwrap_err().to_string();
    assert!(
        error.contains("a transaction was interrupted; copy it with its file ") && error.contains("sqlite3"),
        "{error}"
    );
    assert_eq!(files(folder.path()).len(), 2);
}
