//! A walk through a file, from record to record, that tells what is where.

use super::directory::{Block, BlockKind, Directory, Ending};
use super::record::{self, MAGIC, MESSAGE_FIELDS, PREFIX, op};
use super::signposts::{self, Signposts};
use super::source::{Input, Source};
use crate::recording::RecordingError;
use std::io::{BufReader, Read, Seek, SeekFrom};

/// Greatest length of a record that is kept whole here (definitions, topics, metadata), bytes.
const LONGEST_KEPT: u64 = 16 << 20;

/// Bytes of a chunk record that are enough for what it says before its data.
const CHUNK_FIELDS: u64 = 8 + 8 + 8 + 4 + 4 + 64 + 8;

/// Plain records are gathered to blocks of about a chunk's size.
const PLAIN_BLOCK: u64 = 1 << 20;

/// Walks through all of `source`.
///
/// # Errors
/// When it cannot be read.
pub fn walk(source: &Source) -> Result<Directory, RecordingError> {
    let signposts = signposts::read(source)?;
    let mut input = source.lock();
    input.seek(SeekFrom::Start(0)).map_err(RecordingError::Read)?;
    let mut walk = Walk {
        input: BufReader::new(&mut **input),
        end: source.length(),
        at: 0,
        signposts,
        found: Directory::empty(),
        in_summary: false,
    };
    walk.take(MAGIC.len() as u64)?;
    walk.found.expected_messages = walk.signposts.messages;
    while walk.step()? {}
    Ok(walk.found)
}

struct Walk<'a> {
    input: BufReader<&'a mut dyn Input>,
    end: u64,
    at: u64,
    signposts: Signposts,
    found: Directory,
    in_summary: bool,
}

impl Walk<'_> {
    /// Reads `length` bytes, fewer at the end of the file.
    fn take(&mut self, length: u64) -> Result<Vec<u8>, RecordingError> {
        let mut bytes = Vec::new();
        (&mut self.input).take(length).read_to_end(&mut bytes).map_err(RecordingError::Read)?;
        self.at += bytes.len() as u64;
        Ok(bytes)
    }

    fn go_to(&mut self, offset: u64) -> Result<(), RecordingError> {
        let ahead = offset.cast_signed() - self.at.cast_signed();
        self.input.seek_relative(ahead).map_err(RecordingError::Read)?;
        self.at = offset;
        Ok(())
    }

    /// Takes one record; whether there may be another.
    fn step(&mut self) -> Result<bool, RecordingError> {
        let start = self.at;
        let prefix = self.take(PREFIX)?;
        let mut fields = record::Fields::new(&prefix);
        let (Some(opcode), Some(length)) = (fields.u8(), fields.u64()) else {
            return self.resume(start);
        };
        // Everything but a record of length and opcode that may be sends the walk on to the next signpost.
        let fits = opcode != 0 && length <= self.end - self.at;
        let next = self.at.saturating_add(length);
        let straddles = self.signposts.after(start).is_some_and(|post| post < next);
        let footer_is_last = opcode != op::FOOTER || next + MAGIC.len() as u64 == self.end;
        if !fits || straddles || !footer_is_last {
            return self.resume(start);
        }
        let opcode_is_right = op::is_known(opcode) && (opcode == op::CHUNK || !self.signposts.is_chunk(start));
        if !opcode_is_right || !self.record(opcode, start, length)? {
            self.found.lost_bytes += next - start;
        }
        if opcode == op::FOOTER {
            self.found.ending = if self.signposts.sound { Ending::Complete } else { Ending::SummaryDamaged };
            return Ok(false);
        }
        self.go_to(next)?;
        Ok(true)
    }

    /// Goes on at the next place where the summary says that a record begins; ends the walk where there is none.
    fn resume(&mut self, start: u64) -> Result<bool, RecordingError> {
        let next = self.signposts.after(start);
        self.found.lost_bytes += next.unwrap_or(self.end) - start;
        if let Some(post) = next {
            self.go_to(post)?;
        }
        Ok(next.is_some())
    }

    /// Takes what a record tells; `false` where it is not what its opcode says.
    fn record(&mut self, opcode: u8, start: u64, length: u64) -> Result<bool, RecordingError> {
        Ok(match opcode {
            op::MESSAGE => self.message(start, length)?,
            op::CHUNK => self.chunk(length)?,
            op::MESSAGE_INDEX => self.message_index(length)?,
            op::DATA_END => {
                self.in_summary = true;
                true
            }
            op::SCHEMA | op::CHANNEL | op::METADATA if length <= LONGEST_KEPT => {
                let bytes = self.take(length)?;
                self.keep(opcode, &bytes, start)
            }
            _ => true,
        })
    }

    fn keep(&mut self, opcode: u8, bytes: &[u8], start: u64) -> bool {
        if self.in_summary && !self.signposts.sound {
            return true;
        }
        if !self.in_summary && opcode != op::METADATA {
            // Definitions between plain messages belong to the block, which is read again with them.
            self.extend_plain(start, PREFIX + bytes.len() as u64, None);
        }
        if opcode != op::METADATA {
            return self.found.define(opcode, bytes);
        }
        let Some((name, map)) = record::metadata(bytes) else { return false };
        self.found.metadata.entry(name).or_insert(map);
        true
    }

    fn message(&mut self, start: u64, length: u64) -> Result<bool, RecordingError> {
        let bytes = self.take(length.min(MESSAGE_FIELDS as u64))?;
        let header = record::message_header(&bytes);
        if let Some(header) = header {
            self.extend_plain(start, PREFIX + length, Some(header.log_time_ns));
        }
        Ok(header.is_some())
    }

    /// Adds a plain record to the block that ends where it begins, or begins another.
    fn extend_plain(&mut self, start: u64, length: u64, log_time_ns: Option<u64>) {
        let time = log_time_ns.unwrap_or(u64::MAX);
        match self.found.blocks.last_mut() {
            Some(block)
                if block.kind == BlockKind::Plain
                    && block.offset + block.length == start
                    && block.length + length <= PLAIN_BLOCK =>
            {
                block.length += length;
                block.start_ns = block.start_ns.min(time);
            }
            _ => self.found.blocks.push(Block {
                offset: start,
                length,
                start_ns: time,
                kind: BlockKind::Plain,
                indexed: Vec::new(),
            }),
        }
    }

    fn chunk(&mut self, length: u64) -> Result<bool, RecordingError> {
        let body = self.at;
        let bytes = self.take(length.min(CHUNK_FIELDS))?;
        let header = record::chunk_header(&bytes)
            .filter(|header| header.header_size.checked_add(header.compressed_size).is_some_and(|size| size <= length));
        let Some(header) = header else { return Ok(false) };
        self.found.blocks.push(Block {
            offset: body + header.header_size,
            length: header.compressed_size,
            start_ns: header.start_ns,
            kind: BlockKind::Chunk(header),
            indexed: Vec::new(),
        });
        Ok(true)
    }

    /// Takes up that the chunk before has messages of a topic.
    fn message_index(&mut self, length: u64) -> Result<bool, RecordingError> {
        let bytes = self.take(length.min(6))?;
        let mut fields = record::Fields::new(&bytes);
        let (Some(channel), Some(size)) = (fields.u16(), fields.u32()) else { return Ok(false) };
        if let Some(block) = self.found.blocks.last_mut().filter(|_| size > 0) {
            block.indexed.push(channel);
        }
        Ok(true)
    }
}
