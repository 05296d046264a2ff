//! ROS 1 bags whose lengths or index are wrong: every message that is in the file is read.

use crate::recording::foreign::bag::bag;
use crate::recording::formats::{ROS_1_TOPICS, content, expected, ros_1_messages};
use std::io::Cursor;
use std::ops::Range;
use zsim::recording::Reader;
use zsim::time::Span;

const BAG_HEADER: u8 = 3;
const INDEX: u8 = 4;
const CHUNK: u8 = 5;
const CHUNK_INFO: u8 = 6;
const CONNECTION: u8 = 7;

/// A record of an intact bag.
#[derive(Clone)]
struct Record {
    op: u8,
    /// Position of the header, and of the data.
    header: Range<usize>,
    data: Range<usize>,
}

fn u32_at(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

/// Position of the value of the field `name`, of `length` bytes, in a record's header.
fn value(bytes: &[u8], record: &Record, name: &str, length: usize) -> Range<usize> {
    let text = [((name.len() + 1 + length) as u32).to_le_bytes().as_slice(), name.as_bytes(), b"="].concat();
    let found = bytes[record.header.clone()].windows(text.len()).position(|window| window == text).unwrap();
    let start = record.header.start + found + text.len();
    start..start + length
}

/// The records outside chunks.
fn records(bytes: &[u8]) -> Vec<Record> {
    let (mut at, mut records) = (b"#ROSBAG V2.0\n".len(), Vec::new());
    while at < bytes.len() {
        let header = at + 4..at + 4 + u32_at(bytes, at);
        let data = header.end + 4..header.end + 4 + u32_at(bytes, header.end);
        at = data.end;
        let mut record = Record { op: 0, header, data };
        record.op = bytes[value(bytes, &record, "op", 1)][0];
        records.push(record);
    }
    records
}

/// The bag after `edit`, which gets the records with operation `op`.
fn edited(compression: &str, op: u8, edit: impl Fn(&mut [u8], &[Record])) -> Vec<u8> {
    let mut bytes = bag(&ROS_1_TOPICS, &ros_1_messages(), compression, true);
    let found: Vec<_> = records(&bytes).into_iter().filter(|record| record.op == op).collect();
    assert!(!found.is_empty());
    edit(&mut bytes, &found);
    bytes
}

fn put_u32(bytes: &mut [u8], at: usize, value: usize) {
    bytes[at..at + 4].copy_from_slice(&(value as u32).to_le_bytes());
}

/// Asserts that all messages are read, and returns the text of the loss.
fn reads_all(bytes: Vec<u8>, case: &str) -> String {
    let reader = Reader::new("run.bag", Cursor::new(bytes)).unwrap();
    let info = reader.info(Span::from_seconds(0.5)).unwrap();
    assert_eq!((info.messages, info.topics.len()), (121, 4), "{case}: {}", info.loss);
    assert_eq!((info.loss.missing_messages, info.loss.unreadable_messages), (0, 0), "{case}: {}", info.loss);
    assert!(content(&reader) == expected(), "{case}");
    info.loss.to_string()
}

const COMPRESSIONS: [&str; 3] = ["none", "lz4", "bz2"];

#[test]
fn wrong_lengths_of_records_hide_no_message() {
    for compression in COMPRESSIONS {
        for op in [BAG_HEADER, CHUNK, INDEX, CHUNK_INFO] {
            // The length of the data is before the data; only the second record is wrong, or all are.
            for (change, all) in [(-5_isize, false), (7, false), (5000, false), (3, true)] {
                let bytes = edited(compression, op, |bytes, records| {
                    let wrong = if all { records } else { &records[records.len().min(2) - 1..records.len().min(2)] };
                    for record in wrong {
                        let length = record.data.len().saturating_add_signed(change);
                        put_u32(bytes, record.data.start - 4, length);
                    }
                });
                let loss = reads_all(bytes, &format!("{compression}, op {op}, {change} bytes, all {all}"));
                assert!(!loss.is_empty());
            }
        }
    }
}

#[test]
fn a_chunk_that_seems_to_end_at_a_record_inside_is_read() {
    let bytes = edited("none", CHUNK, |bytes, chunks| {
        for chunk in chunks {
            // The second connection of the chunk, if it has one: a record that may also be outside chunks.
            let data = &bytes[chunk.data.clone()];
            let starts = (1..data.len() - 8).filter(|at| data[*at..].starts_with(b"\x04\0\0\0op=\x07"));
            if let Some(start) = starts.map(|at| at - 4).find(|start| *start > 0) {
                put_u32(bytes, chunk.data.start - 4, start);
            }
        }
    });
    reads_all(bytes, "second connection");
}

#[test]
fn a_chunk_with_a_wrong_uncompressed_size_is_read() {
    for compression in COMPRESSIONS {
        for change in [-9_isize, 1000] {
            let bytes = edited(compression, CHUNK, |bytes, records| {
                for record in records {
                    let at = value(bytes, record, "size", 4).start;
                    put_u32(bytes, at, u32_at(bytes, at).saturating_add_signed(change));
                }
            });
            assert_eq!(reads_all(bytes, &format!("{compression}, {change} bytes")), "");
        }
    }
}

#[test]
fn a_wrong_index_hides_no_message() {
    let rebuilt = "The file's summary is damaged; the index was rebuilt from the data.";
    for compression in COMPRESSIONS {
        let index_of_another_topic = edited(compression, INDEX, |bytes, records| {
            for record in records {
                let at = value(bytes, record, "conn", 4).start;
                put_u32(bytes, at, 9);
            }
        });
        assert_eq!(reads_all(index_of_another_topic, "topics of the index"), rebuilt);
        let chunks_elsewhere = edited(compression, CHUNK_INFO, |bytes, records| {
            for record in records {
                let at = value(bytes, record, "chunk_pos", 8).start;
                put_u32(bytes, at, u32_at(bytes, at) + 100);
            }
        });
        assert_eq!(reads_all(chunks_elsewhere, "positions of chunks"), rebuilt);
        let late = edited(compression, CHUNK_INFO, |bytes, records| {
            let at = value(bytes, &records[0], "start_time", 8).start;
            put_u32(bytes, at, u32_at(bytes, at) + 3600);
        });
        assert_eq!(reads_all(late, "times of chunks"), "");
        let counts = edited(compression, CHUNK_INFO, |bytes, records| {
            records.iter().for_each(|record| put_u32(bytes, record.data.start + 4, 1_000_000));
        });
        assert_eq!(reads_all(counts, "counts of messages"), "");
    }
}

#[test]
fn a_bag_without_its_index_is_read() {
    for compression in COMPRESSIONS {
        for position in [0_u64, 4117 + 30, u64::MAX] {
            let bytes = edited(compression, BAG_HEADER, |bytes, records| {
                let at = value(bytes, &records[0], "index_pos", 8);
                bytes[at].copy_from_slice(&position.to_le_bytes());
            });
            reads_all(bytes, &format!("{compression}, index at {position}"));
        }
        // Cut before the index; topics are then defined in the chunks only.
        let whole = bag(&ROS_1_TOPICS, &ros_1_messages(), compression, true);
        let first = records(&whole).into_iter().find(|record| record.op == CONNECTION).unwrap();
        let loss = reads_all(whole[..first.header.start - 4].to_vec(), compression);
        assert!(loss.starts_with("The file is truncated"), "{loss}");
    }
}

#[test]
fn topics_that_the_index_lacks_are_found_in_the_chunks() {
    for compression in COMPRESSIONS {
        let bytes = edited(compression, CONNECTION, |bytes, records| {
            // The name of a field is damaged: all records but the first have no message type.
            for record in &records[1..] {
                let data = &mut bytes[record.data.clone()];
                let at = data.windows(5).position(|window| window == b"type=").unwrap();
                data[at] = b'T';
            }
        });
        reads_all(bytes, compression);
    }
}

#[test]
fn a_bag_cut_inside_a_chunk_gives_the_messages_before() {
    for compression in ["none", "lz4"] {
        let whole = bag(&ROS_1_TOPICS, &ros_1_messages(), compression, true);
        let chunks: Vec<_> = records(&whole).into_iter().filter(|record| record.op == CHUNK).collect();
        let cut = whole[..chunks[5].data.end - 40].to_vec();
        let info = Reader::new("cut.bag", Cursor::new(cut)).unwrap().info(Span::from_seconds(0.5)).unwrap();
        assert!(info.loss.cut_short && info.loss.damaged_chunks == 1, "{}", info.loss);
        // Ten messages in each chunk. LZ4 decompresses blocks of 64 kB, more than this chunk has.
        let expected = if compression == "none" { 59 } else { 50 };
        assert_eq!(info.messages, expected, "{compression}");
    }
}

#[test]
fn a_message_with_a_wrong_length_hides_no_other_message() {
    let bytes = edited("none", CHUNK, |bytes, chunks| {
        // The second message of the first chunk claims 1000 bytes more.
        let chunk = chunks[0].data.clone();
        let field = b"\x04\0\0\0op=\x02";
        let found = bytes[chunk.clone()].windows(field.len()).enumerate().filter(|(_, window)| *window == field);
        let at = chunk.start + found.map(|(at, _)| at).nth(1).unwrap();
        // Header: op, conn, time: 8 + 13 + 17 bytes.
        let length = at + 38;
        put_u32(bytes, length, u32_at(bytes, length) + 1000);
    });
    let info = Reader::new("a.bag", Cursor::new(bytes)).unwrap().info(Span::from_seconds(0.5)).unwrap();
    assert_eq!((info.messages, info.loss.damaged_chunks), (121, 1), "{}", info.loss);
}
