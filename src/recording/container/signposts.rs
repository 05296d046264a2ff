//! Where a file's summary says that its chunks begin: what a walk holds on to when a record's length is damaged.

use super::record::{Fields, MAGIC, PREFIX, op};
use super::source::Source;
use crate::recording::RecordingError;

/// Bytes of a footer's fields: where the summary begins, where its offsets begin, and its CRC.
const FOOTER_FIELDS: u64 = 20;

/// Greatest length of a summary that is read, bytes: room for a million chunks.
const LONGEST_SUMMARY: u64 = 256 << 20;

/// Bytes of a `DataEnd` record.
const DATA_END: u64 = PREFIX + 4;

/// Offsets at which the summary says that records begin, increasing: each chunk's, and that of the end of the data.
/// Empty where there is no summary, or its CRC says that it is damaged.
///
/// # Errors
/// When the file cannot be read.
pub fn read(source: &Source) -> Result<Vec<u64>, RecordingError> {
    let Some(footer) = source.length().checked_sub(FOOTER_FIELDS + PREFIX + MAGIC.len() as u64) else {
        return Ok(Vec::new());
    };
    let mut bytes = Vec::new();
    source.read_at(footer, (PREFIX + FOOTER_FIELDS) as usize + MAGIC.len(), &mut bytes)?;
    let Some((start, crc)) = summary_start(&bytes).filter(|(start, _)| *start > 0 && *start <= footer) else {
        return Ok(Vec::new());
    };
    if footer - start > LONGEST_SUMMARY {
        return Ok(Vec::new());
    }
    // The CRC covers the summary and the footer up to the CRC itself.
    let covered = (footer - start + PREFIX + FOOTER_FIELDS - 4) as usize;
    source.read_at(start, covered, &mut bytes)?;
    if crc != 0 && crc32fast::hash(&bytes) != crc {
        return Ok(Vec::new());
    }
    Ok(chunks_in(&bytes, start))
}

fn summary_start(footer: &[u8]) -> Option<(u64, u32)> {
    let mut fields = Fields::new(footer);
    let is_footer = fields.u8()? == op::FOOTER && fields.u64()? == FOOTER_FIELDS;
    let (start, _, crc) = (fields.u64()?, fields.u64()?, fields.u32()?);
    (is_footer && fields.rest() == MAGIC).then_some((start, crc))
}

fn chunks_in(summary: &[u8], summary_start: u64) -> Vec<u64> {
    let mut offsets = Vec::new();
    let mut fields = Fields::new(summary);
    while let Some((opcode, record)) = next_record(&mut fields) {
        if opcode == op::CHUNK_INDEX {
            offsets.extend(chunk_offset(record).filter(|offset| *offset < summary_start));
        }
    }
    offsets.extend(summary_start.checked_sub(DATA_END));
    offsets.sort_unstable();
    offsets.dedup();
    offsets
}

/// The next record in memory: its opcode and its fields.
pub fn next_record<'a>(fields: &mut Fields<'a>) -> Option<(u8, &'a [u8])> {
    let opcode = fields.u8()?;
    let length = usize::try_from(fields.u64()?).ok()?;
    Some((opcode, fields.bytes(length)?))
}

fn chunk_offset(record: &[u8]) -> Option<u64> {
    let mut fields = Fields::new(record);
    fields.u64()?;
    fields.u64()?;
    fields.u64()
}
