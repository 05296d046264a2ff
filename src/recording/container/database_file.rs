//! Opens an SQLite database without writing next to it.
//!
//! Most recorders leave their database in WAL mode (sqlite.org/wal.html): SQLite then creates the files `-wal` and `-shm` next
//! to it even to read it, which fails in a folder without write access and litters the user's folder otherwise.

use crate::RecordingError;
use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags};
use std::ffi::OsString;
use std::fs::File;
use std::io::{Error, Read};
use std::path::{Path, PathBuf};

/// Opens the database at `path`, with the content that is in its write-ahead log only. Returns the size of both, bytes.
///
/// # Errors
/// When it cannot be opened, or a transaction in it was interrupted.
pub fn open_read_only(path: &Path) -> Result<(Connection, u64), RecordingError> {
    let file_error = |source: Error| RecordingError::File { path: path.to_owned(), source };
    // SQLite looks for the log next to the file that a link names.
    let real = path.canonicalize().map_err(file_error)?;
    if has_interrupted_transaction(&real).map_err(file_error)? {
        let problem = format!(
            "a transaction was interrupted; copy it with its file {} to another folder and roll back the transaction with \
             `sqlite3 COPY 'SELECT count(*) FROM messages'`",
            companion(&real, "-journal").display()
        );
        return Err(file_error(Error::other(problem)));
    }
    let length = real.metadata().map_err(file_error)?.len();
    let log_length = companion(&real, "-wal").metadata().map_or(0, |log| log.len());
    let opened = if log_length > 0 { open_with_log(&real) } else { open_immutable(&real) };
    Ok((opened.map_err(|error| file_error(Error::other(error)))?, length + log_length))
}

/// Opens a database whose file has all the content: SQLite neither looks for nor creates other files.
fn open_immutable(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
    let escaped: String = path.as_os_str().as_encoded_bytes().iter().map(|byte| escape(*byte)).collect();
    Connection::open_with_flags(format!("file:{escaped}?immutable=1"), flags)
}

/// Opens a database with its write-ahead log.
///
/// In exclusive mode SQLite keeps the log's index in memory instead of a file. The lock that this mode needs is omitted:
/// nothing is written.
fn open_with_log(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let database = Connection::open_with_flags_and_vfs(path, flags, NO_LOCKS)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    database.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
    Ok(database)
}

/// SQLite's access to files without locks.
const NO_LOCKS: &std::ffi::CStr = if cfg!(windows) { c"win32-none" } else { c"unix-none" };

/// Byte of a path in a URI.
fn escape(byte: u8) -> String {
    let is_plain = byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte);
    if is_plain { char::from(byte).to_string() } else { format!("%{byte:02X}") }
}

/// Path of a file that SQLite keeps next to the database `path`.
fn companion(path: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(ending);
    name.into()
}

/// Whether the rollback journal of the database `path` has to be applied: its first byte is not 0.
fn has_interrupted_transaction(path: &Path) -> Result<bool, Error> {
    let journal = companion(path, "-journal");
    if !journal.is_file() {
        return Ok(false);
    }
    let mut first = Vec::new();
    File::open(journal)?.take(1).read_to_end(&mut first)?;
    Ok(first.first().is_some_and(|byte| *byte != 0))
}
