//! Reads rosbag2 SQLite databases: a table of topics, and one of messages in recording order.

use super::budget::Budget;
use super::database_file::open_read_only;
use super::entry::{Damage, Entry};
use super::file_index::{Block, BlockKind, Ending, FileIndex};
use super::record::{ChannelFields, SchemaFields};
use crate::RecordingError;
use rusqlite::limits::Limit;
use rusqlite::{Connection, Row};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// First bytes of an SQLite database.
pub const MAGIC: &[u8] = b"SQLite format 3\0";

/// Maximum length of a message, bytes.
const MAX_MESSAGE_BYTES: i32 = 256 << 20;

/// Maximum size of a block in bytes, and in messages.
const BLOCK_BYTES: u64 = 1 << 20;
const BLOCK_MESSAGES: u64 = 4096;

/// Tables of a rosbag2 database, with the columns that are read.
const TABLES: [(&str, &[&str]); 2] =
    [("topics", &["id", "name", "type", "serialization_format"]), ("messages", &["topic_id", "timestamp", "data"])];

/// Read-only rosbag2 database.
pub struct SqliteDatabase {
    database: Mutex<Connection>,
    length: u64,
}

impl SqliteDatabase {
    /// Opens the database at `path`.
    ///
    /// # Errors
    /// When it cannot be opened, or a transaction in it was interrupted.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let (database, length) = open_read_only(path)?;
        Ok(Self { database: Mutex::new(database), length })
    }

    /// Opens a database in memory.
    ///
    /// # Errors
    /// When SQLite rejects it.
    pub fn in_memory(bytes: &[u8]) -> Result<Self, RecordingError> {
        let problem = |error| RecordingError::Read(std::io::Error::other(error));
        let mut database = Connection::open_in_memory().map_err(problem)?;
        database.deserialize_read_exact("main", bytes, bytes.len(), true).map_err(problem)?;
        Ok(Self { database: Mutex::new(database), length: bytes.len() as u64 })
    }

    /// Size of the database and its log, bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    fn lock(&self) -> MutexGuard<'_, Connection> {
        self.database.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Indexes the database.
    ///
    /// # Errors
    /// When it is not a rosbag2 database, or exceeds `budget`.
    pub fn build_index(&self, budget: &mut Budget) -> Result<FileIndex, RecordingError> {
        let database = self.lock();
        let name = budget.name().to_owned();
        let database_error = |problem: String| RecordingError::Database { name: name.clone(), problem };
        // The schema of the file is untrusted: no functions with side effects, no views in place of tables.
        database
            .execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA query_only = ON;")
            .and_then(|()| database.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_MESSAGE_BYTES))
            .map_err(|error| database_error(unreadable(&error)))?;
        for (table, columns) in TABLES {
            check_table(&database, table, columns).map_err(&database_error)?;
        }
        let mut index = FileIndex::empty();
        read_topics(&database, &mut index, budget).map_err(|error| database_error(unreadable(&error)))??;
        index.ending = match build_blocks(&database, &mut index, budget) {
            Ok(Ok(true)) => Ending::Complete,
            Ok(Ok(false)) | Err(_) => Ending::CutShort,
            Ok(Err(error)) => return Err(error),
        };
        Ok(index)
    }

    /// Reads the messages with row numbers `first` to `last` into `bytes` and `entries`.
    ///
    /// # Errors
    /// When these rows are damaged.
    pub fn read(&self, rows: (i64, i64), bytes: &mut Vec<u8>, entries: &mut Vec<Entry>) -> Result<(), Damage> {
        let database = self.lock();
        let text = "SELECT topic_id, timestamp, data, rowid FROM messages WHERE rowid BETWEEN ?1 AND ?2 ORDER BY rowid";
        let mut read = || -> rusqlite::Result<()> {
            let mut statement = database.prepare(text)?;
            let mut results = statement.query(rows)?;
            let mut order = RowOrder::default();
            while let Some(row) = results.next()?.filter(|row| row.get(3).is_ok_and(|id| order.advances(id))) {
                let Ok(channel) = u16::try_from(row.get::<_, i64>(0)?) else { continue };
                let start = bytes.len();
                bytes.extend_from_slice(row.get_ref(2)?.as_bytes().unwrap_or_default());
                entries.push(Entry { channel, log_time_ns: time_ns(row, 1)?, data: start..bytes.len() });
            }
            Ok(())
        };
        read().map_err(|_| Damage::Records)
    }
}

/// Checks that row numbers increase, as in an undamaged table.
///
/// If pages of a damaged table are children of several others, its rows repeat exponentially often with the depth of
/// the tree.
#[derive(Default)]
struct RowOrder(Option<i64>);

impl RowOrder {
    /// Whether row `id` follows all earlier ones.
    fn advances(&mut self, id: i64) -> bool {
        let is_next = self.0.is_none_or(|last| id > last);
        self.0 = Some(id);
        is_next
    }
}

/// Log time in column `index`, ns; 0 if it is before 1970.
fn time_ns(row: &Row<'_>, index: usize) -> rusqlite::Result<u64> {
    Ok(u64::try_from(row.get::<_, i64>(index)?).unwrap_or(0))
}

/// Describes an error of SQLite, with the remedy.
fn unreadable(error: &rusqlite::Error) -> String {
    format!("{error}; recover the readable rows with `sqlite3 FILE .recover`")
}

/// Checks that `table` is an ordinary table with stored `columns`.
///
/// A view or a computed column may take unlimited time.
fn check_table(database: &Connection, table: &str, columns: &[&str]) -> Result<(), String> {
    let text =
        "SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND name = ?1 AND type = 'table' AND wr = 0";
    let count: i64 = database.query_row(text, [table], |row| row.get(0)).map_err(|error| unreadable(&error))?;
    if count != 1 {
        return Err(format!("it has no table `{table}`"));
    }
    let text = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE lower(name) = 'rowid'";
    let count: i64 = database.query_row(text, [table], |row| row.get(0)).map_err(|error| unreadable(&error))?;
    if count != 0 {
        return Err(format!("its table `{table}` has a column `rowid` that hides the row number"));
    }
    for column in columns {
        let text = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE name = ?2 AND hidden = 0";
        let count: i64 =
            database.query_row(text, [table, column], |row| row.get(0)).map_err(|error| unreadable(&error))?;
        if count != 1 {
            return Err(format!("its table `{table}` has no column `{column}`"));
        }
    }
    Ok(())
}

/// Reads the table of topics. The inner error is an exhausted budget.
fn read_topics(
    database: &Connection,
    index: &mut FileIndex,
    budget: &mut Budget,
) -> rusqlite::Result<Result<(), RecordingError>> {
    let mut statement =
        database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY rowid LIMIT 65536")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let Ok(id) = u16::try_from(row.get::<_, i64>(0)?) else { continue };
        let (topic, name, encoding) = (row.get_ref(1)?.as_str()?, row.get_ref(2)?.as_str()?, row.get_ref(3)?.as_str()?);
        let channel = ChannelFields { id, schema: id, topic, encoding };
        let mut add = || -> Result<(), RecordingError> {
            index.add_channel(channel, budget)?;
            let has_header = crate::schema::MessageType::has_header(name);
            index.add_schema(SchemaFields { id, name, has_header }, budget)
        };
        if let Err(error) = add() {
            return Ok(Err(error));
        }
    }
    Ok(Ok(()))
}

/// Groups messages to blocks, without reading them. `false` if row numbers stop increasing; the inner error is an exhausted
/// budget.
fn build_blocks(
    database: &Connection,
    index: &mut FileIndex,
    budget: &mut Budget,
) -> rusqlite::Result<Result<bool, RecordingError>> {
    let mut statement =
        database.prepare("SELECT rowid, topic_id, timestamp, octet_length(data) FROM messages ORDER BY rowid")?;
    let mut rows = statement.query([])?;
    let (mut messages, mut total, mut order) = (0, 0, RowOrder::default());
    while let Some(row) = rows.next()? {
        let (id, channel) = (row.get(0)?, u16::try_from(row.get::<_, i64>(1)?));
        if !order.advances(id) {
            return Ok(Ok(false));
        }
        let (time, bytes) = (time_ns(row, 2)?, row.get::<_, Option<i64>>(3)?.unwrap_or(0).unsigned_abs());
        let Ok(channel) = channel else { continue };
        total += 1;
        messages += 1;
        let fits = messages <= BLOCK_MESSAGES;
        match index.blocks.last_mut() {
            Some(block) if fits && block.length + bytes <= BLOCK_BYTES => {
                block.length += bytes;
                block.start_ns = block.start_ns.min(time);
                if !block.indexed.contains(&channel) {
                    block.indexed.push(channel);
                }
                if let BlockKind::Rows { last, .. } = &mut block.kind {
                    *last = id;
                }
            }
            _ => {
                messages = 1;
                let kind = BlockKind::Rows { first: id, last: id };
                let block = Block { offset: 0, length: bytes, start_ns: time, kind, indexed: vec![channel] };
                if let Err(error) = index.add_block(block, budget) {
                    return Ok(Err(error));
                }
            }
        }
        index.expected_messages = Some(total);
    }
    Ok(Ok(true))
}
