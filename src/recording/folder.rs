//! Files of a recording that is a folder, as rosbag2 writes them.

use crate::RecordingError;
use crate::yaml::parse_yaml;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_base::printable::printable_name;

/// Extensions of recording files.
const EXTENSIONS: [&str; 3] = ["mcap", "db3", "bag"];

/// Extension of files that rosbag2 compressed as a whole.
const COMPRESSED_EXTENSION: &str = "zstd";

/// Metadata file that rosbag2 writes into the folder.
pub const METADATA_FILE: &str = "metadata.yaml";

/// Maximum length of `metadata.yaml`, bytes; quality-of-service settings dominate it.
const MAX_METADATA_BYTES: u64 = 16 << 20;

/// Maximum number of files of a recording.
const MAX_FILES: usize = 1 << 16;

#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Option<Information>,
}

#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    relative_file_paths: Vec<String>,
}

/// Lists the files of the recording at `path`, in the order in which they were recorded.
///
/// A file is returned as it is. For a folder these are the files in its `metadata.yaml`, or else the only recording in
/// it.
///
/// # Errors
/// When the folder cannot be read, a file is missing or compressed, or the folder contains several recordings.
pub fn list_files(path: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let folder_error = |problem: String| RecordingError::Folder { path: path.to_owned(), problem };
    let listed = files_in_metadata(path)?;
    let files = if listed.is_empty() { find_files(path)? } else { listed };
    if files.len() > MAX_FILES {
        return Err(folder_error(format!("lists {} files, but at most {MAX_FILES} are supported", files.len())));
    }
    if let Some(compressed) = files.iter().find(|file| file.extension() == Some(OsStr::new(COMPRESSED_EXTENSION))) {
        let name = compressed.display();
        return Err(folder_error(format!("has the compressed file {name}; decompress it with `zstd -d --rm {name}`")));
    }
    Ok(files)
}

/// Files listed in `metadata.yaml`; empty if there is no such file, or it lists none.
fn files_in_metadata(path: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let metadata = path.join(METADATA_FILE);
    let file = match files::open(&metadata) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        opened => opened.map_err(|source| RecordingError::File { path: metadata.clone(), source })?,
    };
    let mut text = String::new();
    let length = file
        .take(MAX_METADATA_BYTES + 1)
        .read_to_string(&mut text)
        .map_err(|source| RecordingError::File { path: metadata.clone(), source })?;
    let metadata_error = |problem: String| RecordingError::Folder {
        path: path.to_owned(),
        problem: format!(
            "has an unreadable {METADATA_FILE} ({problem}); regenerate it with `ros2 bag reindex {}`",
            path.display()
        ),
    };
    if length as u64 > MAX_METADATA_BYTES {
        return Err(metadata_error("it is longer than 16 MiB".to_owned()));
    }
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    let parsed: Metadata = parse_yaml(&text).map_err(|error| metadata_error(error.to_string()))?;
    let names =
        parsed.rosbag2_bagfile_information.map(|information| information.relative_file_paths).unwrap_or_default();
    let files = names.iter().map(|name| find_listed_file(path, name)).collect::<Result<Vec<_>, _>>()?;
    match files.iter().collect::<BTreeSet<_>>().len() {
        different if different < files.len() => Err(metadata_error("it lists a file twice".to_owned())),
        _ => Ok(files),
    }
}

/// Finds the file listed as `name`.
///
/// Old versions of rosbag2 include the folder in the name, and a compressed file may have been decompressed since.
fn find_listed_file(folder: &Path, name: &str) -> Result<PathBuf, RecordingError> {
    let file = Path::new(name).file_name().map(|name| folder.join(name));
    let decompressed = file.as_ref().filter(|file| file.extension() == Some(OsStr::new(COMPRESSED_EXTENSION)));
    let decompressed = decompressed.map(|file| file.with_extension(""));
    [decompressed, file].into_iter().flatten().find(|file| file.is_file()).ok_or_else(|| RecordingError::Folder {
        path: folder.to_owned(),
        problem: format!(
            "lacks the file `{}`, which its {METADATA_FILE} lists; restore it, or list the other files anew with `ros2 bag reindex {}`",
            printable_name(name),
            folder.display()
        ),
    })
}

/// Finds the recording in a folder without metadata: one file, or several numbered files of one name.
fn find_files(path: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let at = |source: Error| RecordingError::File { path: path.to_owned(), source };
    let entries = std::fs::read_dir(path).map_err(at)?.collect::<Result<Vec<_>, _>>().map_err(at)?;
    let mut files: Vec<_> = entries.into_iter().map(|entry| entry.path()).filter(|file| is_recording(file)).collect();
    files.sort_by_key(|file| (parse_split_name(file).map(|(stem, number, _)| (stem, number)), file.clone()));
    let problem = match files.len() {
        0 => format!("contains no recording ({})", EXTENSIONS.map(|ending| format!(".{ending}")).join(", ")),
        1 => return Ok(files),
        _ if is_split_recording(&files) => return Ok(files),
        count => {
            let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
            format!("contains {count} recordings; specify one of them: {}", names.join(", "))
        }
    };
    Err(RecordingError::Folder { path: path.to_owned(), problem })
}

fn is_recording(file: &Path) -> bool {
    let uncompressed = if file.extension() == Some(OsStr::new(COMPRESSED_EXTENSION)) {
        file.with_extension("")
    } else {
        file.to_owned()
    };
    uncompressed.extension().and_then(OsStr::to_str).is_some_and(|ending| EXTENSIONS.contains(&ending))
        && file.is_file()
}

/// Stem before the number, number and extension of a split recording's file.
fn parse_split_name(file: &Path) -> Option<(String, u64, String)> {
    let ending = file.extension()?.to_str()?.to_owned();
    let (stem, number) = file.file_stem()?.to_str()?.rsplit_once('_')?;
    Some((stem.to_owned(), number.parse().ok()?, ending))
}

/// Whether sorted files form one split recording: same stem and extension, increasing numbers.
fn is_split_recording(files: &[PathBuf]) -> bool {
    let names: Option<Vec<_>> = files.iter().map(|file| parse_split_name(file)).collect();
    names.is_some_and(|names| {
        names.windows(2).all(|pair| pair[0].0 == pair[1].0 && pair[0].2 == pair[1].2 && pair[0].1 < pair[1].1)
    })
}
