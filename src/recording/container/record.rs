//! Records of the MCAP format (mcap.dev/spec, version 0): an opcode, a length, little-endian fields.

use super::encoding::{Compression, Encoding};

/// First and last bytes of every MCAP file.
pub const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// Bytes of a record before the fields: opcode and length.
pub const PREFIX: u64 = 9;

/// Bytes of a message record's fields before the data.
pub const MESSAGE_FIELDS: usize = 22;

/// Opcodes of the records that are read.
pub mod op {
    /// End of the file.
    pub const FOOTER: u8 = 0x02;
    /// Message definition.
    pub const SCHEMA: u8 = 0x03;
    /// Topic.
    pub const CHANNEL: u8 = 0x04;
    /// Message.
    pub const MESSAGE: u8 = 0x05;
    /// Compressed group of records.
    pub const CHUNK: u8 = 0x06;
    /// Offsets of a topic's messages in a chunk.
    pub const MESSAGE_INDEX: u8 = 0x07;
    /// Offset of a chunk in the file.
    pub const CHUNK_INDEX: u8 = 0x08;
    /// Number of messages.
    pub const STATISTICS: u8 = 0x0B;
    /// Names and values.
    pub const METADATA: u8 = 0x0C;
    /// End of the data section.
    pub const DATA_END: u8 = 0x0F;

    /// Whether the opcode is part of the format or reserved for applications.
    pub fn is_known(op: u8) -> bool {
        (0x01..=DATA_END).contains(&op) || op >= 0x80
    }
}

/// Reads consecutive fields of a record; `None` if the record is too short.
pub struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    /// Reads the fields in `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Bytes not yet read.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*taken)
    }

    /// Reads one byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    /// Reads two bytes.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    /// Reads four bytes.
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    /// Reads eight bytes.
    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// Reads `length` bytes.
    pub fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    /// Reads a string with a length prefix.
    pub fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.bytes(length)?).ok()
    }
}

/// Fields of a message type definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SchemaFields<'a> {
    /// Number in the file.
    pub id: u16,
    /// Type name: `package/msg/Type`.
    pub name: &'a str,
    /// Whether the first field is a `std_msgs/Header`.
    pub has_header: bool,
}

/// Fields of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChannelFields<'a> {
    /// Number in the file.
    pub id: u16,
    /// Number of the message definition.
    pub schema: u16,
    /// Topic name.
    pub topic: &'a str,
    /// Message encoding: `cdr` in the ROS 2 profile.
    pub encoding: &'a str,
}

/// Header of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChunkHeader {
    /// Log time of the earliest message, ns.
    pub start_ns: u64,
    /// Compression, uncompressed size and checksum.
    pub encoding: Encoding,
    /// Compressed size, bytes.
    pub compressed_size: u64,
    /// Size of this header, bytes.
    pub header_size: u64,
}

/// Header of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageHeader {
    /// Channel number of the topic.
    pub channel: u16,
    /// Log time, ns.
    pub log_time_ns: u64,
}

/// Reads a schema record's fields.
pub fn schema(bytes: &[u8]) -> Option<SchemaFields<'_>> {
    let mut fields = Fields::new(bytes);
    let (id, name) = (fields.u16()?, fields.string()?);
    fields.string()?;
    Some(SchemaFields { id, name, has_header: begins_with_header(fields.string().unwrap_or_default()) })
}

/// Whether the first field of a `ros2msg` definition is a header.
pub fn begins_with_header(definition: &str) -> bool {
    let mut lines = definition.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let kind = lines.next().and_then(|line| line.split_whitespace().next());
    matches!(kind, Some("std_msgs/Header" | "std_msgs/msg/Header" | "Header"))
}

/// Reads a channel record's fields.
pub fn channel(bytes: &[u8]) -> Option<ChannelFields<'_>> {
    let mut fields = Fields::new(bytes);
    let (id, schema) = (fields.u16()?, fields.u16()?);
    Some(ChannelFields { id, schema, topic: fields.string()?, encoding: fields.string()? })
}

/// Reads the header of a chunk record.
pub fn chunk_header(bytes: &[u8]) -> Option<ChunkHeader> {
    let mut fields = Fields::new(bytes);
    let (start_ns, _end_ns) = (fields.u64()?, fields.u64()?);
    let (size, crc) = (fields.u64()?, fields.u32()?);
    let encoding = Encoding { compression: Compression::named(fields.string()?), size, crc };
    let compressed_size = fields.u64()?;
    let header_size = (bytes.len() - fields.rest.len()) as u64;
    Some(ChunkHeader { start_ns, encoding, compressed_size, header_size })
}

/// Reads the header of a message record.
pub fn message_header(bytes: &[u8]) -> Option<MessageHeader> {
    let mut fields = Fields::new(bytes);
    let channel = fields.u16()?;
    fields.u32()?;
    let log_time_ns = fields.u64()?;
    fields.u64()?;
    Some(MessageHeader { channel, log_time_ns })
}

/// Reads a metadata record: its name, and the value of `key`.
pub fn metadata<'a>(bytes: &'a [u8], key: &str) -> Option<(&'a str, Option<&'a str>)> {
    let mut fields = Fields::new(bytes);
    let (name, length) = (fields.string()?, fields.u32()? as usize);
    let (mut map, mut found) = (Fields::new(fields.bytes(length)?), None);
    while !map.rest.is_empty() {
        let (key_here, value) = (map.string()?, map.string()?);
        if key_here == key {
            found = Some(value);
        }
    }
    Some((name, found))
}

/// Reads the next record in memory: opcode and fields.
pub fn next_record<'a>(fields: &mut Fields<'a>) -> Option<(u8, &'a [u8])> {
    let opcode = fields.u8()?;
    let length = usize::try_from(fields.u64()?).ok()?;
    Some((opcode, fields.bytes(length)?))
}
