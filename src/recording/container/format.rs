//! Detects the container format of a file from the first bytes, and advises on unsupported ones.

use super::budget::Budget;
use super::database::{self, SqliteDatabase};
use super::file_index::{BlockKind, Ending, FileIndex};
use super::loaded_block::LoadedBlock;
use super::recording_file::{RecordingFile, Store};
use super::source::{Input, Source};
use super::{bag, bag_indexer, mcap_indexer, record};
use crate::RecordingError;
use std::path::Path;
use zsim_base::files;

/// Number of first bytes that identify a format.
const MAGIC_BYTES: usize = 16;

/// Maximum size of a database that is read into memory, bytes; databases in files are not.
const MAX_IN_MEMORY_BYTES: u64 = 1 << 30;

/// Supported container format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Mcap,
    Bag,
    Database,
}

/// Unsupported formats: first bytes, description, and advice.
const UNSUPPORTED: [(&[u8], &str, &str); 19] = [
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
        "convert its topics to a bag with `ulog2rosbag` of pyulog; lidar topics are rarely included",
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
    /// Detects the format from the first bytes.
    fn detect(magic: &[u8], name: &str) -> Result<Self, RecordingError> {
        if magic.starts_with(&record::MAGIC) {
            return Ok(Self::Mcap);
        }
        if magic.starts_with(bag::MAGIC) {
            return Ok(Self::Bag);
        }
        if magic.starts_with(database::MAGIC) {
            return Ok(Self::Database);
        }
        let known = UNSUPPORTED.iter().find(|(first, _, _)| magic.starts_with(first));
        let (found, remedy) = match known {
            Some((_, found, remedy)) => (*found, *remedy),
            None if magic.is_empty() => ("an empty file", "the recorder was stopped before it wrote data"),
            None => ("a file of an unknown format", RECORD),
        };
        Err(RecordingError::NotRecording { name: name.to_owned(), found: found.to_owned(), remedy: remedy.to_owned() })
    }
}

impl RecordingFile {
    /// Opens the file at `path`, which has the given number among the files of the recording.
    ///
    /// # Errors
    /// When it cannot be opened or read, the format is not supported, or the recording exceeds `budget`.
    pub fn open(number: u16, path: &Path, budget: &mut Budget) -> Result<Self, RecordingError> {
        let name = path.display().to_string();
        let file = files::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        let source = Source::new(file)?;
        let format = detect_format(&source, &name)?;
        budget.add_file(&name, source.length());
        match format {
            Format::Database => Self::from_database(number, SqliteDatabase::open(path)?, budget),
            Format::Mcap | Format::Bag => Self::from_records(number, source, format, budget),
        }
    }

    /// Opens `input`, called `name` in messages.
    ///
    /// # Errors
    /// When it cannot be read, the format is not supported, or it exceeds the limits of a recording.
    pub fn from_input(name: &str, input: impl Input + 'static) -> Result<Self, RecordingError> {
        let source = Source::new(input)?;
        let format = detect_format(&source, name)?;
        let length = source.length();
        let mut budget = Budget::new(name, length);
        if format != Format::Database {
            return Self::from_records(0, source, format, &mut budget);
        }
        if length > MAX_IN_MEMORY_BYTES {
            let problem = "it exceeds the 1 GiB limit for a stream; save it as a file and give its path".to_owned();
            return Err(RecordingError::Database { name: name.to_owned(), problem });
        }
        let mut bytes = Vec::new();
        source.read_at(0, length as usize, &mut bytes)?;
        Self::from_database(0, SqliteDatabase::in_memory(&bytes)?, &mut budget)
    }

    fn from_database(number: u16, database: SqliteDatabase, budget: &mut Budget) -> Result<Self, RecordingError> {
        let index = database.build_index(budget)?;
        Ok(Self::new(number, Store::Database(database), index))
    }

    fn from_records(number: u16, source: Source, format: Format, budget: &mut Budget) -> Result<Self, RecordingError> {
        let mut index = match format {
            Format::Bag => bag_indexer::index_bag(&source, budget)?,
            _ => mcap_indexer::index_mcap(&source, budget)?,
        };
        let store = Store::Records(source);
        find_definitions(&store, &mut index, budget)?;
        Ok(Self::new(number, store, index))
    }
}

fn detect_format(source: &Source, name: &str) -> Result<Format, RecordingError> {
    let mut magic = Vec::new();
    source.read_at(0, MAGIC_BYTES.min(usize::try_from(source.length()).unwrap_or(usize::MAX)), &mut magic)?;
    Format::detect(&magic, name)
}

/// Reads the definitions inside chunks, if no summary repeats them.
fn find_definitions(store: &Store, index: &mut FileIndex, budget: &mut Budget) -> Result<(), RecordingError> {
    let in_all = index.ending != Ending::Complete || index.channels.is_empty();
    let (mut loaded, mut compressed) = (LoadedBlock::default(), Vec::new());
    for k in 0..index.blocks.len() {
        let block = &index.blocks[k];
        let is_chunk = matches!(block.kind, BlockKind::Chunk(_) | BlockKind::BagChunk(_));
        if is_chunk && (in_all || index.lacks_definitions_of(block)) {
            let kind = block.kind;
            // A damaged chunk of a bag is read as far as it is intact, another one not at all.
            let _ = loaded.load(store, block, &mut compressed, budget)?;
            loaded.add_definitions_to(index, kind, budget)?;
        }
    }
    Ok(())
}
