//! Indexes an MCAP file record by record.

use super::budget::Budget;
use super::file_index::{Block, BlockKind, Ending, FileIndex};
use super::mcap_summary::{self, McapSummary};
use super::record::{self, MAGIC, MESSAGE_FIELDS, PREFIX, op};
use super::source::{Input, Source};
use crate::RecordingError;
use std::io::{BufReader, Read, Seek, SeekFrom};

/// Maximum length of a record that is read completely here (definitions, topics, metadata), bytes.
const MAX_RECORD_BYTES: u64 = 16 << 20;

/// Bytes of a chunk record that are sufficient for the header: fixed fields and a 64-byte compression name.
const CHUNK_HEADER_BYTES: u64 = 8 + 8 + 8 + 4 + 4 + 64 + 8;

/// Name and key of the metadata in which [`crate::Writer`] stores the manifest of a run.
const OWN_METADATA: &str = "zsim";
const MANIFEST_KEY: &str = "manifest";

/// Maximum size of a block of records outside chunks, bytes: about that of a chunk.
const PLAIN_BLOCK_BYTES: u64 = 1 << 20;

/// Indexes the MCAP file in `source`.
///
/// # Errors
/// When it cannot be read, or the budget is exhausted.
pub fn index_mcap(source: &Source, budget: &mut Budget) -> Result<FileIndex, RecordingError> {
    let summary = mcap_summary::read(source)?;
    let mut input = source.lock();
    input.seek(SeekFrom::Start(0)).map_err(RecordingError::Read)?;
    let mut indexer = McapIndexer {
        input: BufReader::new(&mut **input),
        end: source.length(),
        at: 0,
        summary,
        index: FileIndex::empty(),
        budget,
        in_summary: false,
    };
    indexer.take(MAGIC.len() as u64)?;
    indexer.index.expected_messages = indexer.summary.messages;
    while indexer.step()? {}
    Ok(indexer.index)
}

struct McapIndexer<'a> {
    input: BufReader<&'a mut dyn Input>,
    end: u64,
    at: u64,
    summary: McapSummary,
    index: FileIndex,
    budget: &'a mut Budget,
    in_summary: bool,
}

impl McapIndexer<'_> {
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

    /// Indexes one record; `false` after the last.
    fn step(&mut self) -> Result<bool, RecordingError> {
        let start = self.at;
        let prefix = self.take(PREFIX)?;
        let mut fields = record::Fields::new(&prefix);
        let (Some(opcode), Some(length)) = (fields.u8(), fields.u64()) else {
            return self.resume(start);
        };
        // A record with an impossible length or opcode makes the indexer resume at the next known record.
        let fits = opcode != 0 && length <= self.end - self.at;
        let next = self.at.saturating_add(length);
        let straddles = self.summary.next_record_after(start).is_some_and(|offset| offset < next);
        let footer_is_last = opcode != op::FOOTER || self.end.checked_sub(MAGIC.len() as u64) == Some(next);
        if !fits || straddles || !footer_is_last {
            return self.resume(start);
        }
        let opcode_is_right = op::is_known(opcode) && (opcode == op::CHUNK || !self.summary.is_chunk_start(start));
        if !opcode_is_right || !self.record(opcode, start, length)? {
            self.index.lost_bytes += next - start;
        }
        if opcode == op::FOOTER {
            self.index.ending = if self.summary.is_valid { Ending::Complete } else { Ending::SummaryDamaged };
            return Ok(false);
        }
        self.go_to(next)?;
        Ok(true)
    }

    /// Resumes at the next record known from the summary; `false` if there is none.
    fn resume(&mut self, start: u64) -> Result<bool, RecordingError> {
        let next = self.summary.next_record_after(start);
        self.index.lost_bytes += next.unwrap_or(self.end) - start;
        if let Some(offset) = next {
            self.go_to(offset)?;
        }
        Ok(next.is_some())
    }

    /// Processes a record; `false` if it does not match the opcode.
    fn record(&mut self, opcode: u8, start: u64, length: u64) -> Result<bool, RecordingError> {
        Ok(match opcode {
            op::MESSAGE => self.message(start, length)?,
            op::CHUNK => self.chunk(length)?,
            op::MESSAGE_INDEX => self.message_index(length)?,
            op::DATA_END => {
                self.in_summary = true;
                true
            }
            op::SCHEMA | op::CHANNEL | op::METADATA if length <= MAX_RECORD_BYTES => {
                let bytes = self.take(length)?;
                self.definition_or_metadata(opcode, &bytes, start)?
            }
            _ => true,
        })
    }

    fn definition_or_metadata(&mut self, opcode: u8, bytes: &[u8], start: u64) -> Result<bool, RecordingError> {
        if self.in_summary && !self.summary.is_valid {
            return Ok(true);
        }
        if !self.in_summary && opcode != op::METADATA {
            // Definitions between messages outside chunks belong to the block, which is read again with them.
            self.extend_plain(start, PREFIX + bytes.len() as u64, None)?;
        }
        if opcode != op::METADATA {
            return self.index.define(opcode, bytes, self.budget);
        }
        let Some((name, manifest)) = record::metadata(bytes, MANIFEST_KEY) else { return Ok(false) };
        if let Some(manifest) = manifest.filter(|_| name == OWN_METADATA && self.index.manifest.is_none()) {
            self.budget.item(manifest.len())?;
            self.index.manifest = Some(manifest.to_owned());
        }
        Ok(true)
    }

    fn message(&mut self, start: u64, length: u64) -> Result<bool, RecordingError> {
        let bytes = self.take(length.min(MESSAGE_FIELDS as u64))?;
        let header = record::message_header(&bytes);
        if let Some(header) = header {
            self.extend_plain(start, PREFIX + length, Some(header.log_time_ns))?;
        }
        Ok(header.is_some())
    }

    /// Adds a record outside chunks to the adjacent block, or starts a new block.
    fn extend_plain(&mut self, start: u64, length: u64, log_time_ns: Option<u64>) -> Result<(), RecordingError> {
        let time = log_time_ns.unwrap_or(u64::MAX);
        match self.index.blocks.last_mut() {
            Some(block)
                if block.kind == BlockKind::Plain
                    && block.offset + block.length == start
                    && block.length + length <= PLAIN_BLOCK_BYTES =>
            {
                block.length += length;
                block.start_ns = block.start_ns.min(time);
                Ok(())
            }
            _ => {
                let block =
                    Block { offset: start, length, start_ns: time, kind: BlockKind::Plain, indexed: Vec::new() };
                self.index.add_block(block, self.budget)
            }
        }
    }

    fn chunk(&mut self, length: u64) -> Result<bool, RecordingError> {
        let body = self.at;
        let bytes = self.take(length.min(CHUNK_HEADER_BYTES))?;
        let header = record::chunk_header(&bytes)
            .filter(|header| header.header_size.checked_add(header.compressed_size).is_some_and(|size| size <= length));
        let Some(header) = header else { return Ok(false) };
        let block = Block {
            offset: body + header.header_size,
            length: header.compressed_size,
            start_ns: header.start_ns,
            kind: BlockKind::Chunk(header.encoding),
            indexed: Vec::new(),
        };
        self.index.add_block(block, self.budget)?;
        Ok(true)
    }

    /// Notes that the previous chunk has messages of a topic.
    fn message_index(&mut self, length: u64) -> Result<bool, RecordingError> {
        let bytes = self.take(length.min(6))?;
        let mut fields = record::Fields::new(&bytes);
        let (Some(channel), Some(size)) = (fields.u16(), fields.u32()) else { return Ok(false) };
        if let Some(block) = self.index.blocks.last_mut().filter(|_| size > 0) {
            block.indexed.push(channel);
        }
        Ok(true)
    }
}
