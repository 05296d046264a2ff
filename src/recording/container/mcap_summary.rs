//! Reads the summary of an MCAP file.
//!
//! The chunk offsets let indexing resume after a damaged record length; the message count reveals missing messages.

use super::record::{Fields, MAGIC, PREFIX, next_record, op};
use super::source::Source;
use crate::RecordingError;

/// Bytes of a footer's fields: offset of the summary, offset of the summary offsets, and CRC.
const FOOTER_BYTES: u64 = 20;

/// Maximum length of a summary, bytes: sufficient for a million chunks.
const MAX_SUMMARY_BYTES: u64 = 256 << 20;

/// Bytes of a `DataEnd` record.
const DATA_END_BYTES: u64 = PREFIX + 4;

/// Content of a summary.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct McapSummary {
    /// Whether there is a summary with a matching checksum or none.
    pub is_valid: bool,
    /// Offsets of the chunks, increasing.
    pub chunks: Vec<u64>,
    /// Offset of the record before the summary.
    pub data_end: Option<u64>,
    /// Number of messages in the file.
    pub messages: Option<u64>,
}

impl McapSummary {
    /// Next offset after `offset` at which a record is known to start.
    pub fn next_record_after(&self, offset: u64) -> Option<u64> {
        let next = self.chunks.partition_point(|chunk| *chunk <= offset);
        self.chunks.get(next).copied().or(self.data_end.filter(|end| *end > offset))
    }

    /// Whether a chunk starts at `offset`.
    pub fn is_chunk_start(&self, offset: u64) -> bool {
        self.chunks.binary_search(&offset).is_ok()
    }
}

/// Reads the summary; an empty one if it is missing or invalid.
///
/// # Errors
/// When the file cannot be read.
pub fn read(source: &Source) -> Result<McapSummary, RecordingError> {
    let Some(footer) = source.length().checked_sub(FOOTER_BYTES + PREFIX + MAGIC.len() as u64) else {
        return Ok(McapSummary::default());
    };
    let mut bytes = Vec::new();
    source.read_at(footer, (PREFIX + FOOTER_BYTES) as usize + MAGIC.len(), &mut bytes)?;
    let Some((start, crc)) = summary_start(&bytes) else { return Ok(McapSummary::default()) };
    if start == 0 {
        // A properly closed file without a summary.
        return Ok(McapSummary { is_valid: true, ..McapSummary::default() });
    }
    if start > footer || footer - start > MAX_SUMMARY_BYTES {
        return Ok(McapSummary::default());
    }
    // The CRC covers the summary and the footer up to the CRC itself.
    let covered = (footer - start + PREFIX + FOOTER_BYTES - 4) as usize;
    source.read_at(start, covered, &mut bytes)?;
    if crc != 0 && crc32fast::hash(&bytes) != crc {
        return Ok(McapSummary::default());
    }
    Ok(parse_summary(&bytes, start))
}

fn summary_start(footer: &[u8]) -> Option<(u64, u32)> {
    let mut fields = Fields::new(footer);
    let is_footer = fields.u8()? == op::FOOTER && fields.u64()? == FOOTER_BYTES;
    let (start, _, crc) = (fields.u64()?, fields.u64()?, fields.u32()?);
    (is_footer && fields.rest() == MAGIC).then_some((start, crc))
}

fn parse_summary(summary: &[u8], summary_start: u64) -> McapSummary {
    let data_end = summary_start.checked_sub(DATA_END_BYTES);
    let mut parsed = McapSummary { is_valid: true, data_end, ..McapSummary::default() };
    let mut fields = Fields::new(summary);
    while let Some((opcode, record)) = next_record(&mut fields) {
        match opcode {
            op::CHUNK_INDEX => parsed.chunks.extend(chunk_offset(record).filter(|offset| *offset < summary_start)),
            op::STATISTICS => parsed.messages = Fields::new(record).u64(),
            _ => {}
        }
    }
    parsed.chunks.sort_unstable();
    parsed.chunks.dedup();
    parsed
}

fn chunk_offset(record: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(record);
    fields.u64()?;
    fields.u64()?;
    fields.u64()
}
