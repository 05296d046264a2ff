//! The files of a recording that is a folder, as rosbag2 makes them.

use crate::recording::RecordingError;
use serde::Deserialize;
use std::ffi::OsStr;
use std::io::{Error, Read};
use std::path::{Path, PathBuf};

/// Endings of files of recordings.
const ENDINGS: [&str; 3] = ["mcap", "db3", "bag"];

/// Ending of files that rosbag2 compressed as a whole.
const COMPRESSED: &str = "zstd";

/// What rosbag2 writes beside a recording.
const METADATA: &str = "metadata.yaml";

/// Greatest length of `metadata.yaml`, bytes: its quality of service takes most of it.
const LONGEST_METADATA: u64 = 16 << 20;

/// Most files of a recording.
const MOST_FILES: usize = 1 << 16;

#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Option<Information>,
}

#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    relative_file_paths: Vec<String>,
}

/// The files of the recording at `path`, in the order in which they were recorded: `path` itself where it is a file;
/// of a folder those that its `metadata.yaml` names, or else the only recording in it.
///
/// # Errors
/// When the folder cannot be read, a file is missing or compressed, or it is open which recording is meant.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let folder = |problem: String| RecordingError::Folder { path: path.to_owned(), problem };
    let named = named_by_metadata(path)?;
    let files = if named.is_empty() { found_in(path)? } else { named };
    if files.len() > MOST_FILES {
        return Err(folder(format!("names {} files, more than the {MOST_FILES} that are read", files.len())));
    }
    if let Some(compressed) = files.iter().find(|file| file.extension() == Some(OsStr::new(COMPRESSED))) {
        let name = compressed.display();
        return Err(folder(format!(
            "has {name}, a file compressed as a whole; decompress it with `zstd -d --rm {name}`"
        )));
    }
    Ok(files)
}

/// The files that `metadata.yaml` names; none where there is no such file, or it names none.
fn named_by_metadata(path: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let metadata = path.join(METADATA);
    let Ok(file) = std::fs::File::open(&metadata) else { return Ok(Vec::new()) };
    let mut text = String::new();
    let length = file
        .take(LONGEST_METADATA + 1)
        .read_to_string(&mut text)
        .map_err(|source| RecordingError::File { path: metadata.clone(), source })?;
    let broken = |problem: String| RecordingError::Folder {
        path: path.to_owned(),
        problem: format!(
            "has a {METADATA} that cannot be read ({problem}); write it anew with `ros2 bag reindex {}`",
            path.display()
        ),
    };
    if length as u64 > LONGEST_METADATA {
        return Err(broken("it is longer than 16 MiB".to_owned()));
    }
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    let parsed: Metadata =
        serde_saphyr::from_str(&text).map_err(|error| broken(error.without_snippet().to_string()))?;
    let names =
        parsed.rosbag2_bagfile_information.map(|information| information.relative_file_paths).unwrap_or_default();
    names.iter().map(|name| named_file(path, name)).collect()
}

/// The file that metadata call `name`: old versions name it with its folder, and a compressed one may have been
/// decompressed since.
fn named_file(folder: &Path, name: &str) -> Result<PathBuf, RecordingError> {
    let file = Path::new(name).file_name().map(|name| folder.join(name));
    let decompressed = file.as_ref().filter(|file| file.extension() == Some(OsStr::new(COMPRESSED)));
    let decompressed = decompressed.map(|file| file.with_extension(""));
    [decompressed, file].into_iter().flatten().find(|file| file.is_file()).ok_or_else(|| RecordingError::Folder {
        path: folder.to_owned(),
        problem: format!("has no file `{}`, which its {METADATA} names", crate::recording::topics::printable(name)),
    })
}

/// The recording in a folder without metadata: one file, or several of one name that are numbered.
fn found_in(path: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let at = |source: Error| RecordingError::File { path: path.to_owned(), source };
    let entries = std::fs::read_dir(path).map_err(at)?.collect::<Result<Vec<_>, _>>().map_err(at)?;
    let mut files: Vec<_> = entries.into_iter().map(|entry| entry.path()).filter(|file| is_recording(file)).collect();
    files.sort_by_key(|file| (numbered(file).map(|(stem, number, _)| (stem, number)), file.clone()));
    let problem = match files.len() {
        0 => format!("has no recording in it ({})", ENDINGS.map(|ending| format!(".{ending}")).join(", ")),
        1 => return Ok(files),
        _ if is_split(&files) => return Ok(files),
        count => {
            let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
            format!("has {count} recordings in it, name one of them: {}", names.join(", "))
        }
    };
    Err(RecordingError::Folder { path: path.to_owned(), problem })
}

fn is_recording(file: &Path) -> bool {
    let whole =
        if file.extension() == Some(OsStr::new(COMPRESSED)) { file.with_extension("") } else { file.to_owned() };
    whole.extension().and_then(OsStr::to_str).is_some_and(|ending| ENDINGS.contains(&ending)) && file.is_file()
}

/// The name of a split recording's file before its number, the number, and its ending.
fn numbered(file: &Path) -> Option<(String, u64, String)> {
    let ending = file.extension()?.to_str()?.to_owned();
    let (stem, number) = file.file_stem()?.to_str()?.rsplit_once('_')?;
    Some((stem.to_owned(), number.parse().ok()?, ending))
}

/// Whether sorted files are those of one recording: of one name and ending, and numbered.
fn is_split(files: &[PathBuf]) -> bool {
    let names: Option<Vec<_>> = files.iter().map(|file| numbered(file)).collect();
    names.is_some_and(|names| {
        names.windows(2).all(|pair| pair[0].0 == pair[1].0 && pair[0].2 == pair[1].2 && pair[0].1 < pair[1].1)
    })
}
