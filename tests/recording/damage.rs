//! Truncated, damaged and hostile recordings: intact parts are read, losses are reported, nothing panics.

use crate::recordings::{in_order, record, run};
use proptest::prelude::*;
use std::io::Cursor;
use std::sync::LazyLock;
use zsim::measurement::Measurement;
use zsim::recording::{Loss, Reader, RecordingError, TopicPreference};
use zsim::time::Span;

/// Three seconds: more than three chunks.
static RECORDING: LazyLock<(Vec<u8>, Vec<Measurement>)> = LazyLock::new(|| record(run(), 300));

/// All readable measurements, and the reported loss.
fn read(bytes: Vec<u8>) -> Result<(Vec<Measurement>, Loss), RecordingError> {
    let reader = Reader::new("memory", Cursor::new(bytes))?;
    let selection = reader.select(&TopicPreference::default())?;
    let mut measurements = reader.measurements(&selection);
    let read = measurements.by_ref().collect::<Result<Vec<_>, _>>()?;
    Ok((read, measurements.loss().clone()))
}

/// A chunk as the `mcap` crate reads it.
struct Chunk {
    /// Offsets of its start and end, bytes.
    bytes: std::ops::Range<u64>,
    /// Measurements on `/scan` and `/imu/data_raw`, in this chunk and all before it.
    measurements_so_far: usize,
    /// Messages in it on all topics.
    messages: u64,
}

fn chunks() -> Vec<Chunk> {
    let (bytes, _) = &*RECORDING;
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let mut measurements_so_far = 0;
    let chunk = |index: &mcap::records::ChunkIndex| {
        let topics = summary.stream_chunk(bytes, index).unwrap().map(|message| message.unwrap().channel.topic.clone());
        let topics: Vec<_> = topics.collect();
        measurements_so_far +=
            topics.iter().filter(|topic| ["/scan", "/imu/data_raw"].contains(&topic.as_str())).count();
        let bytes = index.chunk_start_offset..index.chunk_start_offset + index.chunk_length;
        Chunk { bytes, measurements_so_far, messages: topics.len() as u64 }
    };
    summary.chunk_indexes.iter().map(chunk).collect()
}

#[test]
fn a_file_truncated_anywhere_gives_all_complete_chunks() {
    let (bytes, written) = &*RECORDING;
    let chunks = chunks();
    assert!(chunks.len() > 3);
    let ends = chunks.iter().map(|chunk| chunk.bytes.end as usize).flat_map(|end| [end - 1, end, end + 1]);
    for cut in (0..bytes.len()).step_by(9973).chain(ends) {
        let whole = chunks.iter().rfind(|chunk| chunk.bytes.end <= cut as u64);
        let whole = whole.map_or(0, |chunk| chunk.measurements_so_far);
        match read(bytes[..cut].to_vec()) {
            Ok((read, loss)) => {
                assert_eq!(read, in_order(written[..whole].to_vec()), "cut at {cut}");
                assert!(loss.cut_short, "cut at {cut}: {loss}");
            }
            Err(RecordingError::NotRecording { .. }) => assert!(cut < 8),
            Err(RecordingError::NoSensor { .. }) => assert_eq!(whole, 0, "cut at {cut}"),
            Err(error) => panic!("cut at {cut}: {error}"),
        }
    }
}

#[test]
fn info_reports_a_file_without_summary() {
    let (bytes, _) = &*RECORDING;
    let end = chunks()[1].bytes.end as usize;
    let reader = Reader::new("killed", Cursor::new(bytes[..end + 100].to_vec())).unwrap();
    let info = reader.info(Span::from_seconds(0.5)).unwrap();
    assert!(info.loss.cut_short && info.loss.lost_bytes <= 100);
    assert!(info.loss.to_string().starts_with("The file is truncated"), "{}", info.loss);
    assert!(info.topics.iter().any(|topic| topic.topic == "/scan" && topic.messages > 30));
}

#[test]
fn a_damaged_chunk_is_skipped_and_counted() {
    let (bytes, written) = &*RECORDING;
    let chunks = chunks();
    let mut damaged = bytes.clone();
    damaged[(chunks[1].bytes.end - 5000) as usize] ^= 0x10;
    let (read, loss) = read(damaged).unwrap();
    let (from, to) = (chunks[0].measurements_so_far, chunks[1].measurements_so_far);
    assert_eq!(read, in_order([&written[..from], &written[to..]].concat()));
    assert_eq!((loss.damaged_chunks, loss.missing_messages), (1, chunks[1].messages));
    assert!(!loss.cut_short && !loss.damaged_summary);
}

#[test]
fn a_wrong_count_in_the_summary_is_no_loss_of_messages() {
    let (bytes, _) = &*RECORDING;
    let count = mcap::Summary::read(bytes).unwrap().unwrap().stats.unwrap().message_count;
    // Statistics: opcode, length, number of messages. The footer ends with the checksum, here none, and the magic bytes.
    let at = bytes.windows(8).rposition(|window| window == count.to_le_bytes()).unwrap();
    assert_eq!(bytes[at - 9], 0x0B);
    let end = bytes.len();
    for wrong in [count + 1000, u64::MAX] {
        let mut edited = bytes.clone();
        edited[at..at + 8].copy_from_slice(&wrong.to_le_bytes());
        edited[end - 12..end - 8].fill(0);
        assert!(read(edited.clone()).unwrap().1.is_none());
        // With a damaged chunk a credible count shows how many messages are missing.
        edited[(chunks()[1].bytes.end - 5000) as usize] ^= 0x10;
        let loss = read(edited).unwrap().1;
        let missing = if wrong == u64::MAX { 0 } else { chunks()[1].messages + 1000 };
        assert_eq!((loss.damaged_chunks, loss.missing_messages), (1, missing));
    }
}

#[test]
fn an_incorrect_record_length_loses_at_most_its_chunk() {
    let (bytes, written) = &*RECORDING;
    let chunks = chunks();
    let at = chunks[1].bytes.start as usize;
    let kept = written.len() - (chunks[1].measurements_so_far - chunks[0].measurements_so_far);
    // Changes of opcode (not a chunk, end of file, unknown) and of length (too large, too small).
    for (byte, value) in [(0, 0x07), (0, 0x02), (0, 0), (0, 0x55), (8, 0xFF), (3, 0xFF), (2, 0)] {
        let mut damaged = bytes.clone();
        damaged[at + byte] = value;
        let (read, loss) = read(damaged).unwrap();
        assert_eq!(read.len(), kept, "byte {byte} is {value}");
        assert!(loss.missing_messages == chunks[1].messages && loss.lost_bytes > 0, "byte {byte} is {value}: {loss}");
    }
}

proptest! {
    #![proptest_config(super::property_test())]

    #[test]
    fn flipped_bits_never_panic_and_never_invent_a_measurement(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..8), 1..4),
    ) {
        let (bytes, written) = &*RECORDING;
        let mut damaged = bytes.clone();
        for (at, bit) in flips {
            damaged[at.index(bytes.len())] ^= 1 << bit;
        }
        if let Ok((read, loss)) = read(damaged) {
            let stamp = |m: &Measurement| match m {
                Measurement::Imu(sample) => sample.stamp,
                Measurement::Lidar(scan) => scan.stamp,
            };
            for measurement in &read {
                let same = |m: &&Measurement| stamp(m) == stamp(measurement) && *m == measurement;
                prop_assert!(written.iter().any(|m| same(&m)), "{measurement:?} was never written");
            }
            prop_assert!(read.len() == written.len() || !loss.is_none(), "{} of {}", read.len(), written.len());
        }
    }

    #[test]
    fn flipped_bits_near_the_ends_of_chunks_and_in_the_summary_never_panic(
        place in 0_usize..6, offset in -400_i64..400, bit in 0_u8..8,
    ) {
        let (bytes, written) = &*RECORDING;
        let places: Vec<_> = chunks().iter().map(|chunk| chunk.bytes.end as i64).chain([bytes.len() as i64]).collect();
        let at = (places[place % places.len()] + offset).clamp(0, bytes.len() as i64 - 1) as usize;
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << bit;
        let (read, loss) = read(damaged).unwrap();
        prop_assert!(read.len() == written.len() || !loss.is_none(), "{} of {}", read.len(), written.len());
    }
}

/// An MCAP file of one chunk that declares an uncompressed size of `claimed` bytes.
pub fn file_with_chunk(packed: &[u8], compression: &str, claimed: u64) -> Vec<u8> {
    let mut file = b"\x89MCAP0\r\n".to_vec();
    let mut chunk = [0_u64.to_le_bytes(), 0_u64.to_le_bytes(), claimed.to_le_bytes()].concat();
    chunk.extend(0_u32.to_le_bytes());
    chunk.extend((compression.len() as u32).to_le_bytes());
    chunk.extend(compression.as_bytes());
    chunk.extend((packed.len() as u64).to_le_bytes());
    chunk.extend(packed);
    file.push(6);
    file.extend((chunk.len() as u64).to_le_bytes());
    file.extend(chunk);
    file
}

#[test]
fn a_decompression_bomb_is_not_decompressed() {
    // 64 MiB of zeros compress to a few kilobytes; the chunk declares 1000 bytes, or 1 TB.
    let zeros = zstd::encode_all([0_u8; 1 << 16].repeat(1024).as_slice(), 1).unwrap();
    for claimed in [1000, 1 << 40, u64::MAX] {
        let reader = Reader::new("bomb", Cursor::new(file_with_chunk(&zeros, "zstd", claimed))).unwrap();
        assert_eq!(reader.info(Span::from_seconds(1.0)).unwrap().loss.damaged_chunks, 1);
    }
}

#[test]
fn other_file_formats_are_refused_by_name() {
    let cases: [(&[u8], &str); 8] = [
        (b"", "an empty file"),
        (b"\x89MCAP", "a file of an unknown format"),
        (&[0; 100], "a file of an unknown format"),
        (b"#ROSBAG V1.2\n", "`rosbag fix old.bag new.bag`"),
        (&[0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0], "a pcap capture"),
        (&[0x0A, 0x0D, 0x0D, 0x0A, 0, 0, 0, 0], "a pcapng capture"),
        (b"LASF\0\0\0\0", "a LAS point cloud"),
        (b"SQLite format 3\0", "not a readable rosbag2 database"),
    ];
    for (bytes, found) in cases {
        let error = Reader::new("a.bag", Cursor::new(bytes.to_vec())).map(|_| ()).unwrap_err().to_string();
        assert!(error.starts_with("a.bag: ") && error.contains(found), "{error}");
    }
    let error = Reader::open(std::path::Path::new("/nowhere/run.mcap")).map(|_| ()).unwrap_err();
    assert!(error.to_string().starts_with("/nowhere/run.mcap: "), "{error}");
}
