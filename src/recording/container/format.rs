//! What container a file is, by its first bytes, and what to do with one that is not read.

use super::chunk::Loaded;
use super::directory::{BlockKind, Directory, Ending};
use super::part::{Part, Store};
use super::rows::{self, Rows};
use super::source::{Input, Source};
use super::{bag, record, walk};
use crate::recording::RecordingError;
use std::path::Path;

/// First bytes that tell formats apart.
const LONGEST_MAGIC: usize = 16;

/// Greatest database that is read into memory, bytes: those in files are not.
const LARGEST_IN_MEMORY: u64 = 1 << 30;

/// A container that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Mcap,
    Bag,
    Database,
}

/// Formats that are not read: first bytes, what they are, and what to do.
const OTHERS: [(&[u8], &str, &str); 19] = [
    (b"#ROSBAG V1", "a ROS 1 bag of format 1.x", "convert it with `rosbag fix old.bag new.bag` of ROS 1"),
    (&[0xD4, 0xC3, 0xB2, 0xA1], PCAP, REPLAY),
    (&[0xA1, 0xB2, 0xC3, 0xD4], PCAP, REPLAY),
    (&[0x4D, 0x3C, 0xB2, 0xA1], PCAP, REPLAY),
    (&[0xA1, 0xB2, 0x3C, 0x4D], PCAP, REPLAY),
    (&[0x0A, 0x0D, 0x0D, 0x0A], "a pcapng capture of network packets", REPLAY),
    (&[0x28, 0xB5, 0x2F, 0xFD], "a file compressed by zstd", "decompress it with `zstd -d FILE`"),
    (b"BZh", "a file compressed by bzip2", "decompress it with `bunzip2 FILE`"),
    (&[0x1F, 0x8B], "a file compressed by gzip", "decompress it with `gunzip FILE`"),
    (&[0xFD, b'7', b'z', b'X', b'Z'], "a file compressed by xz", "decompress it with `unxz FILE`"),
    (&[0x04, 0x22, 0x4D, 0x18], "a file compressed by lz4", "decompress it with `lz4 -d FILE`"),
    (b"PK\x03\x04", "a zip archive", "unpack it with `unzip FILE`"),
    (b"LASF", "a LAS point cloud", CLOUD),
    (b"ply\n", "a PLY point cloud or mesh", CLOUD),
    (b"# .PCD", "a PCD point cloud", CLOUD),
    (b"ASTM-E57", "an E57 point cloud", CLOUD),
    (b"RRF", "a rerun recording", "record the topics of lidar and IMU as MCAP with `ros2 bag record -s mcap`"),
    (
        b"ULog",
        "a PX4 log",
        "convert its topics to a bag with `ulog2rosbag`, part of pyulog; a lidar's are rarely in it",
    ),
    (b"PAR1", "a Parquet table", "write its scans and samples as MCAP, see docs/guide/recordings.md"),
];

const PCAP: &str = "a pcap capture of network packets";
const REPLAY: &str =
    "replay it through the lidar's ROS driver, and record the topics of lidar and IMU with `ros2 bag record -s mcap`";
const CLOUD: &str = "an estimate needs the scans and IMU samples over time; record them with `ros2 bag record -s mcap`";
const RECORD: &str =
    "record the topics of lidar and IMU with `ros2 bag record -s mcap`, or see docs/guide/recordings.md";

impl Format {
    /// The format that begins with `magic`.
    fn of(magic: &[u8], name: &str) -> Result<Self, RecordingError> {
        if magic.starts_with(&record::MAGIC) {
            return Ok(Self::Mcap);
        }
        if magic.starts_with(bag::MAGIC) {
            return Ok(Self::Bag);
        }
        if magic.starts_with(rows::MAGIC) {
            return Ok(Self::Database);
        }
        let known = OTHERS.iter().find(|(first, _, _)| magic.starts_with(first));
        let (found, remedy) = match known {
            Some((_, found, remedy)) => (*found, *remedy),
            None if magic.is_empty() => ("an empty file", "its recorder was stopped before it wrote anything"),
            None => ("a file of an unknown format", RECORD),
        };
        Err(RecordingError::NotRecording { name: name.to_owned(), found: found.to_owned(), remedy: remedy.to_owned() })
    }
}

impl Part {
    /// Opens the file at `path`, at `place` among those of a recording.
    ///
    /// # Errors
    /// When it cannot be opened or read, or is of no format that is read.
    pub fn open(place: u16, path: &Path) -> Result<Self, RecordingError> {
        let name = path.display().to_string();
        let file =
            std::fs::File::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        let source = Source::new(file)?;
        let format = format_of(&source, &name)?;
        match format {
            Format::Database => Self::of_rows(place, Rows::open(path)?, &name),
            Format::Mcap | Format::Bag => Self::of_records(place, source, format, &name),
        }
    }

    /// Opens `input`, which messages call `name`.
    ///
    /// # Errors
    /// When it cannot be read, or is of no format that is read.
    pub fn new_input(name: &str, input: impl Input + 'static) -> Result<Self, RecordingError> {
        let source = Source::new(input)?;
        let format = format_of(&source, name)?;
        if format != Format::Database {
            return Self::of_records(0, source, format, name);
        }
        let length = source.length();
        if length > LARGEST_IN_MEMORY {
            let problem = "it is larger than the 1 GiB that is read from a stream".to_owned();
            return Err(RecordingError::Database { name: name.to_owned(), problem });
        }
        let mut bytes = Vec::new();
        source.read_at(0, length as usize, &mut bytes)?;
        Self::of_rows(0, Rows::in_memory(&bytes)?, name)
    }

    fn of_rows(place: u16, rows: Rows, name: &str) -> Result<Self, RecordingError> {
        let directory = rows.directory(name)?;
        Ok(Self::new(place, Store::Rows(rows), directory))
    }

    fn of_records(place: u16, source: Source, format: Format, name: &str) -> Result<Self, RecordingError> {
        let mut directory = match format {
            Format::Bag => bag::walk(&source, name)?,
            _ => walk::walk(&source)?,
        };
        let store = Store::Records(source);
        if directory.ending != Ending::Complete || directory.channels.is_empty() {
            find_definitions(&store, &mut directory)?;
        }
        Ok(Self::new(place, store, directory))
    }
}

fn format_of(source: &Source, name: &str) -> Result<Format, RecordingError> {
    let mut magic = Vec::new();
    source.read_at(0, LONGEST_MAGIC.min(usize::try_from(source.length()).unwrap_or(usize::MAX)), &mut magic)?;
    Format::of(&magic, name)
}

/// Reads the definitions that stand in chunks, where no summary repeats them.
fn find_definitions(store: &Store, directory: &mut Directory) -> Result<(), RecordingError> {
    let mut loaded = Loaded::default();
    for k in 0..directory.blocks.len() {
        let block = &directory.blocks[k];
        let may_define = matches!(block.kind, BlockKind::Chunk(_) | BlockKind::BagChunk(_));
        if may_define && loaded.load(store, block)?.is_ok() {
            loaded.define_in(directory);
        }
    }
    Ok(())
}
