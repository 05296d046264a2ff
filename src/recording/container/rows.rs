//! The SQLite databases of rosbag2: a table of topics, and one of messages in the order in which they were recorded.

use super::chunk::{Damage, Entry};
use super::directory::{Block, BlockKind, Directory, Ending};
use super::record::{ChannelRecord, SchemaRecord};
use crate::recording::RecordingError;
use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, Row};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// First bytes of an SQLite database.
pub const MAGIC: &[u8] = b"SQLite format 3\0";

/// Greatest length of a message, bytes.
const LONGEST: i32 = 256 << 20;

/// Messages are gathered to blocks of this size in bytes, and of this many messages.
const BLOCK_BYTES: u64 = 1 << 20;
const BLOCK_MESSAGES: u64 = 4096;

/// The tables of a database of rosbag2, with the columns that are read.
const TABLES: [(&str, &[&str]); 2] =
    [("topics", &["id", "name", "type", "serialization_format"]), ("messages", &["topic_id", "timestamp", "data"])];

/// A database of rosbag2, read only.
pub struct Rows {
    database: Mutex<Connection>,
    length: u64,
}

impl Rows {
    /// Opens the database at `path`.
    ///
    /// # Errors
    /// When it cannot be opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let at = |source| RecordingError::File { path: path.to_owned(), source };
        let length = std::fs::metadata(path).map_err(at)?.len();
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let opened = Connection::open_with_flags(path, flags).map_err(|error| at(std::io::Error::other(error)))?;
        Ok(Self { database: Mutex::new(opened), length })
    }

    /// Opens a database in memory.
    ///
    /// # Errors
    /// When SQLite refuses it.
    pub fn in_memory(bytes: &[u8]) -> Result<Self, RecordingError> {
        let problem = |error| RecordingError::Read(std::io::Error::other(error));
        let mut database = Connection::open_in_memory().map_err(problem)?;
        database.deserialize_read_exact("main", bytes, bytes.len(), true).map_err(problem)?;
        Ok(Self { database: Mutex::new(database), length: bytes.len() as u64 })
    }

    /// Bytes in the database.
    pub fn length(&self) -> u64 {
        self.length
    }

    fn lock(&self) -> MutexGuard<'_, Connection> {
        self.database.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the database holds, and where.
    ///
    /// # Errors
    /// When it is no database of rosbag2 (`name` is for the message).
    pub fn directory(&self, name: &str) -> Result<Directory, RecordingError> {
        let database = self.lock();
        let refused = |problem: String| RecordingError::Database { name: name.to_owned(), problem };
        // What stands in the schema of a file is not trusted: no functions with side effects, no views for tables.
        database
            .execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA query_only = ON;")
            .and_then(|()| database.set_limit(Limit::SQLITE_LIMIT_LENGTH, LONGEST))
            .map_err(|error| refused(error.to_string()))?;
        for (table, columns) in TABLES {
            is_plain_table(&database, table, columns).map_err(&refused)?;
        }
        let mut found = Directory::empty();
        topics(&database, &mut found).map_err(|error| refused(error.to_string()))?;
        found.ending = match blocks(&database, &mut found) {
            Ok(true) => Ending::Complete,
            Ok(false) | Err(_) => Ending::CutShort,
        };
        Ok(found)
    }

    /// Reads the messages with row numbers `first` to `last` into `bytes` and `entries`.
    ///
    /// # Errors
    /// When the database is damaged there.
    pub fn read(&self, rows: (i64, i64), bytes: &mut Vec<u8>, entries: &mut Vec<Entry>) -> Result<(), Damage> {
        let database = self.lock();
        let text = "SELECT topic_id, timestamp, data, rowid FROM messages WHERE rowid BETWEEN ?1 AND ?2 ORDER BY rowid";
        let mut read = || -> rusqlite::Result<()> {
            let mut statement = database.prepare(text)?;
            let mut found = statement.query(rows)?;
            let mut order = Order::default();
            while let Some(row) = found.next()?.filter(|row| row.get(3).is_ok_and(|id| order.goes_on(id))) {
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

/// The order of row numbers, which increase in a table that is sound. Where pages of a damaged one are the children of
/// several others, its rows come again and again, in numbers that grow exponentially with the depth of the tree.
#[derive(Default)]
struct Order(Option<i64>);

impl Order {
    /// Whether row `id` comes after all before it.
    fn goes_on(&mut self, id: i64) -> bool {
        let is_next = self.0.is_none_or(|last| id > last);
        self.0 = Some(id);
        is_next
    }
}

/// Log time in column `index`, ns; of one before 1970, 0.
fn time_ns(row: &Row<'_>, index: usize) -> rusqlite::Result<u64> {
    Ok(u64::try_from(row.get::<_, i64>(index)?).unwrap_or(0))
}

/// Whether `table` is an ordinary table with `columns` that are stored: a view or a computed column may take for ever.
fn is_plain_table(database: &Connection, table: &str, columns: &[&str]) -> Result<(), String> {
    let text =
        "SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND name = ?1 AND type = 'table' AND wr = 0";
    let count: i64 = database.query_row(text, [table], |row| row.get(0)).map_err(|error| error.to_string())?;
    if count != 1 {
        return Err(format!("it has no table `{table}`"));
    }
    let text = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE lower(name) = 'rowid'";
    let count: i64 = database.query_row(text, [table], |row| row.get(0)).map_err(|error| error.to_string())?;
    if count != 0 {
        return Err(format!("its table `{table}` has a column `rowid` in the place of the number of a row"));
    }
    for column in columns {
        let text = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE name = ?2 AND hidden = 0";
        let count: i64 =
            database.query_row(text, [table, column], |row| row.get(0)).map_err(|error| error.to_string())?;
        if count != 1 {
            return Err(format!("its table `{table}` has no column `{column}`"));
        }
    }
    Ok(())
}

fn topics(database: &Connection, found: &mut Directory) -> rusqlite::Result<()> {
    let mut statement =
        database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY rowid LIMIT 65536")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let Ok(id) = u16::try_from(row.get::<_, i64>(0)?) else { continue };
        let name: String = row.get(2)?;
        let has_header = crate::recording::schema::MessageType::known_with_header(&name);
        found.schemas.insert(id, SchemaRecord { id, name, has_header });
        found.channels.insert(id, ChannelRecord { id, schema: id, topic: row.get(1)?, encoding: row.get(3)? });
    }
    Ok(())
}

/// Gathers messages to blocks, without reading them, as far as their row numbers increase; whether they do to the end.
fn blocks(database: &Connection, found: &mut Directory) -> rusqlite::Result<bool> {
    let mut statement =
        database.prepare("SELECT rowid, topic_id, timestamp, length(data) FROM messages ORDER BY rowid")?;
    let mut rows = statement.query([])?;
    let (mut messages, mut total, mut order) = (0, 0, Order::default());
    while let Some(row) = rows.next()? {
        let (id, channel) = (row.get(0)?, u16::try_from(row.get::<_, i64>(1)?));
        if !order.goes_on(id) {
            return Ok(false);
        }
        let (time, bytes) = (time_ns(row, 2)?, row.get::<_, Option<i64>>(3)?.unwrap_or(0).unsigned_abs());
        let Ok(channel) = channel else { continue };
        total += 1;
        messages += 1;
        let fits = messages <= BLOCK_MESSAGES;
        match found.blocks.last_mut() {
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
                found.blocks.push(Block { offset: 0, length: bytes, start_ns: time, kind, indexed: vec![channel] });
            }
        }
        found.expected_messages = Some(total);
    }
    Ok(true)
}
