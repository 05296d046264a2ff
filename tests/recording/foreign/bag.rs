//! Writes ROS 1 bags and rosbag2 databases from the specifications of the formats.

use std::io::Write;

/// Bytes of a ROS 1 message: little-endian without alignment.
#[derive(Default)]
pub struct Ros1(pub Vec<u8>);

impl Ros1 {
    pub fn header(stamp_ns: i64, frame: &str) -> Self {
        let mut message = Self::default();
        message.0.extend(7_u32.to_le_bytes());
        message.0.extend(((stamp_ns / 1_000_000_000) as u32).to_le_bytes());
        message.0.extend(((stamp_ns % 1_000_000_000) as u32).to_le_bytes());
        message.string(frame)
    }

    pub fn string(mut self, text: &str) -> Self {
        self.0.extend((text.len() as u32).to_le_bytes());
        self.0.extend(text.as_bytes());
        self
    }

    pub fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    pub fn f32s(mut self, values: &[f32]) -> Self {
        values.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
        self
    }

    pub fn f64s(mut self, values: &[f64]) -> Self {
        values.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
        self
    }
}

fn fields(pairs: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, value) in pairs {
        bytes.extend(((name.len() + 1 + value.len()) as u32).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.push(b'=');
        bytes.extend(*value);
    }
    bytes
}

/// A record with the fields `header`.
pub fn record(header: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = fields(header);
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes
}

fn time(ns: i64) -> Vec<u8> {
    [((ns / 1_000_000_000) as u32).to_le_bytes(), ((ns % 1_000_000_000) as u32).to_le_bytes()].concat()
}

/// A message: index of its topic, log time, and its bytes.
pub type Logged = (usize, i64, Vec<u8>);

/// Compresses a chunk by `compression`.
fn packed(compression: &str, bytes: &[u8]) -> Vec<u8> {
    match compression {
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        "bz2" => {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        _ => bytes.to_vec(),
    }
}

/// A connection record.
pub fn connection(id: usize, (topic, kind): (&str, &str)) -> Vec<u8> {
    let definition = b"# a comment\nHeader header\n";
    let inner = fields(&[
        ("topic", topic.as_bytes()),
        ("type", kind.as_bytes()),
        ("md5sum", b"0123456789abcdef0123456789abcdef"),
        ("message_definition", definition),
    ]);
    record(&[("op", &[7]), ("conn", &(id as u32).to_le_bytes()), ("topic", topic.as_bytes())], &inner)
}

/// The first record, padded with spaces to 4096 bytes, so that the recorder can overwrite it at the end.
fn head(index: u64, connections: usize, chunks: usize) -> Vec<u8> {
    let (connections, chunks) = ((connections as u32).to_le_bytes(), (chunks as u32).to_le_bytes());
    let index = index.to_le_bytes();
    let fields: [(&str, &[u8]); 4] =
        [("index_pos", &index), ("conn_count", &connections), ("chunk_count", &chunks), ("op", &[3])];
    let mut bytes = record(&fields, &[]);
    let padding = 4096 - bytes.len();
    let length = bytes.len() - 4;
    bytes[length..].copy_from_slice(&(padding as u32).to_le_bytes());
    bytes.extend(std::iter::repeat_n(b' ', padding));
    [b"#ROSBAG V2.0\n", &bytes[..]].concat()
}

/// A chunk at `position` with its index records, and its record for the index at the end of the file.
fn chunk(topics: &[(&str, &str)], messages: &[Logged], compression: &str, position: u64) -> (Vec<u8>, Vec<u8>) {
    let (mut inner, mut counts) = (Vec::new(), vec![0_u32; topics.len()]);
    for (topic, logged, bytes) in messages {
        if counts[*topic] == 0 {
            inner.extend(connection(*topic, topics[*topic]));
        }
        counts[*topic] += 1;
        let id = (*topic as u32).to_le_bytes();
        inner.extend(record(&[("op", &[2]), ("conn", &id), ("time", &time(*logged))], bytes));
    }
    let one = 1_u32.to_le_bytes();
    let (mut bytes, mut data) = (chunk_of(&inner, compression), Vec::new());
    for (id, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (id, count_bytes) = ((id as u32).to_le_bytes(), count.to_le_bytes());
        let fields: [(&str, &[u8]); 4] = [("op", &[4]), ("ver", &one), ("conn", &id), ("count", &count_bytes)];
        bytes.extend(record(&fields, &vec![0; 12 * *count as usize]));
        data.extend([id, count_bytes].concat());
    }
    let times = messages.iter().map(|(_, logged, _)| *logged);
    let (start, end) = (time(times.clone().min().unwrap()), time(times.max().unwrap()));
    let (position, count) = (position.to_le_bytes(), ((data.len() / 8) as u32).to_le_bytes());
    let fields: [(&str, &[u8]); 6] = [
        ("op", &[6]),
        ("ver", &one),
        ("chunk_pos", &position),
        ("start_time", &start),
        ("end_time", &end),
        ("count", &count),
    ];
    (bytes, record(&fields, &data))
}

/// A chunk with the records `inner`.
pub fn chunk_of(inner: &[u8], compression: &str) -> Vec<u8> {
    let size = (inner.len() as u32).to_le_bytes();
    let header: [(&str, &[u8]); 3] = [("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)];
    record(&header, &packed(compression, inner))
}

/// A bag of `chunks` without an index.
pub fn bag_of_chunks(chunks: &[Vec<u8>]) -> Vec<u8> {
    [head(0, 0, 0), chunks.concat()].concat()
}

/// A bag of `topics` (name and type) with ten messages per chunk; `indexed` if `rosbag record` has closed it.
pub fn bag(topics: &[(&str, &str)], messages: &[Logged], compression: &str, indexed: bool) -> Vec<u8> {
    let start = head(0, 0, 0).len();
    let (mut body, mut infos) = (Vec::new(), Vec::new());
    for messages in messages.chunks(10) {
        let (bytes, info) = chunk(topics, messages, compression, (start + body.len()) as u64);
        body.extend(bytes);
        infos.push(info);
    }
    if !indexed {
        return [head(0, 0, 0), body].concat();
    }
    let index = (start + body.len()) as u64;
    topics.iter().enumerate().for_each(|(id, topic)| body.extend(connection(id, *topic)));
    infos.iter().for_each(|info| body.extend(info));
    [head(index, topics.len(), infos.len()), body].concat()
}

/// Writes a rosbag2 database to `path`; with `compressed` each message is compressed separately.
pub fn database(path: &std::path::Path, topics: &[(&str, &str)], messages: &[Logged], compressed: bool) {
    let database = rusqlite::Connection::open(path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
             serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
             data BLOB NOT NULL);
             CREATE INDEX timestamp_idx ON messages (timestamp ASC);
             BEGIN;",
        )
        .unwrap();
    for (id, (topic, kind)) in topics.iter().enumerate() {
        let row = (id as i64 + 1, topic, kind);
        database.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", row).unwrap();
    }
    for (topic, logged, bytes) in messages {
        let bytes = if compressed { zstd::encode_all(&bytes[..], 1).unwrap() } else { bytes.clone() };
        let row = (*topic as i64 + 1, logged, bytes);
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)", row).unwrap();
    }
    database.execute_batch("COMMIT").unwrap();
}
