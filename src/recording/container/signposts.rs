//! What a file's summary says: where chunks begin, which a walk holds on to when a record's length is damaged, and how
//! many messages there are, by which it shows what is missing.

use super::record::{Fields, MAGIC, PREFIX, op};
use super::source::Source;
use crate::recording::RecordingError;

/// Bytes of a footer's fields: where the summary begins, where its offsets begin, and its CRC.
const FOOTER_FIELDS: u64 = 20;

/// Greatest length of a summary that is read, bytes: room for a million chunks.
const LONGEST_SUMMARY: u64 = 256 << 20;

/// Bytes of a `DataEnd` record.
const DATA_END: u64 = PREFIX + 4;

/// What a summary says.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Signposts {
    /// Whether there is a summary, and its checksum does not speak against it.
    pub sound: bool,
    /// Where chunks begin, increasing.
    pub chunks: Vec<u64>,
    /// Where the record before the summary begins.
    pub data_end: Option<u64>,
    /// How many messages there are in the file.
    pub messages: Option<u64>,
}

impl Signposts {
    /// The next place after `offset` at which a record begins.
    pub fn after(&self, offset: u64) -> Option<u64> {
        let next = self.chunks.partition_point(|chunk| *chunk <= offset);
        self.chunks.get(next).copied().or(self.data_end.filter(|end| *end > offset))
    }

    /// Whether a chunk begins at `offset`.
    pub fn is_chunk(&self, offset: u64) -> bool {
        self.chunks.binary_search(&offset).is_ok()
    }
}

/// Reads the summary, if there is a sound one.
///
/// # Errors
/// When the file cannot be read.
pub fn read(source: &Source) -> Result<Signposts, RecordingError> {
    let Some(footer) = source.length().checked_sub(FOOTER_FIELDS + PREFIX + MAGIC.len() as u64) else {
        return Ok(Signposts::default());
    };
    let mut bytes = Vec::new();
    source.read_at(footer, (PREFIX + FOOTER_FIELDS) as usize + MAGIC.len(), &mut bytes)?;
    let Some((start, crc)) = summary_start(&bytes) else { return Ok(Signposts::default()) };
    if start == 0 {
        // A file that ends as it should, and says that it has no summary.
        return Ok(Signposts { sound: true, ..Signposts::default() });
    }
    if start > footer || footer - start > LONGEST_SUMMARY {
        return Ok(Signposts::default());
    }
    // The CRC covers the summary and the footer up to the CRC itself.
    let covered = (footer - start + PREFIX + FOOTER_FIELDS - 4) as usize;
    source.read_at(start, covered, &mut bytes)?;
    if crc != 0 && crc32fast::hash(&bytes) != crc {
        return Ok(Signposts::default());
    }
    Ok(in_summary(&bytes, start))
}

fn summary_start(footer: &[u8]) -> Option<(u64, u32)> {
    let mut fields = Fields::new(footer);
    let is_footer = fields.u8()? == op::FOOTER && fields.u64()? == FOOTER_FIELDS;
    let (start, _, crc) = (fields.u64()?, fields.u64()?, fields.u32()?);
    (is_footer && fields.rest() == MAGIC).then_some((start, crc))
}

fn in_summary(summary: &[u8], summary_start: u64) -> Signposts {
    let data_end = summary_start.checked_sub(DATA_END);
    let mut found = Signposts { sound: true, data_end, ..Signposts::default() };
    let mut fields = Fields::new(summary);
    while let Some((opcode, record)) = next_record(&mut fields) {
        match opcode {
            op::CHUNK_INDEX => found.chunks.extend(chunk_offset(record).filter(|offset| *offset < summary_start)),
            op::STATISTICS => found.messages = Fields::new(record).u64(),
            _ => {}
        }
    }
    found.chunks.sort_unstable();
    found.chunks.dedup();
    found
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
