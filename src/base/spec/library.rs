//! Search for specs: as a path, in `scenes/` and `specs/` of the working directory, in the binary.

use super::{Source, SpecError};
use crate::similar::did_you_mean;
use include_dir::Dir;
use std::path::{Path, PathBuf};
use zsim_scenes::SCENES;
use zsim_specs::SPECS;

/// Maximum size of a spec, bytes. A larger file is not a spec.
pub const MAX_SPEC_BYTES: u64 = 16 << 20;

impl Source {
    /// Reads the file of a spec.
    ///
    /// # Errors
    /// If it cannot be read, is not UTF-8, or is too large.
    pub fn read(path: &Path) -> Result<Self, SpecError> {
        let name = path.display().to_string();
        let io = |error: std::io::Error| SpecError::plain(&name, format!("cannot be read: {error}"));
        let meta = std::fs::metadata(path).map_err(io)?;
        if !meta.is_file() {
            return Err(SpecError::plain(&name, "is not a file"));
        }
        if meta.len() > MAX_SPEC_BYTES {
            let message = format!("has {} bytes; a spec has at most {MAX_SPEC_BYTES}", meta.len());
            return Err(SpecError::plain(&name, message));
        }
        let bytes = std::fs::read(path).map_err(io)?;
        let mut text =
            String::from_utf8(bytes).map_err(|error| SpecError::plain(&name, format!("is not UTF-8 text: {error}")))?;
        // Some editors write a byte order mark before the text.
        if text.starts_with('\u{feff}') {
            text.drain(..'\u{feff}'.len_utf8());
        }
        Ok(Self { name, folder: path.parent().map(Path::to_path_buf), text })
    }
}

/// Defines the kinds of specs. Each has a key, for commands and for the inputs of a run, a noun for messages, and a folder.
macro_rules! kinds {
    ($($(#[$meaning:meta])* $kind:ident: $key:literal, $noun:literal, $folder:literal;)*) => {
        /// Kind of a spec; it determines the folder.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Kind {
            $($(#[$meaning])* $kind,)*
        }

        impl Kind {
            /// All kinds.
            pub const ALL: [Kind; [$($key),*].len()] = [$(Kind::$kind),*];

            /// Name of the kind in commands, and the last word of its keys in the inputs of a run.
            pub fn key(self) -> &'static str {
                match self { $(Kind::$kind => $key),* }
            }

            /// Name of the kind for messages.
            pub fn noun(self) -> &'static str {
                match self { $(Kind::$kind => $noun),* }
            }

            /// Folder of these specs, relative to the project root.
            pub fn folder(self) -> &'static str {
                match self { $(Kind::$kind => $folder),* }
            }
        }
    };
}

kinds! {
    /// A world.
    Scene: "scene", "scene", "scenes";
    /// A head and linkage.
    Head: "head", "head", "specs/heads";
    /// A spring.
    Spring: "spring", "spring", "specs/springs";
    /// A lidar.
    Lidar: "lidar", "lidar", "specs/lidars";
    /// An inertial measurement unit.
    Imu: "imu", "IMU", "specs/imus";
    /// The clocks of the sensors.
    Clock: "clock", "clock", "specs/clocks";
    /// Faults of the sensors and of their delivery.
    Faults: "faults", "faults", "specs/faults";
    /// How the base moves.
    Motion: "motion", "motion", "specs/motions";
    /// The estimator's settings.
    Estimator: "estimator", "estimator", "specs/estimators";
    /// A study.
    Study: "study", "study", "specs/studies";
    /// An experiment of the paper.
    Experiment: "experiment", "experiment", "specs/experiments";
}

impl Kind {
    /// The kind of the spec that an input of a run names: an IMU for the keys `imu` and `base_imu`.
    pub fn of_input(key: &str) -> Option<Self> {
        let last = key.rsplit('_').next();
        Self::ALL.into_iter().find(|kind| last == Some(kind.key()))
    }
}

/// Finds a spec: `name` as a path, then in the folder of the kind below the working directory, then in the binary.
///
/// # Errors
/// If there is no such spec (the error lists the known names), or the file cannot be read.
pub fn find(kind: Kind, name: &str) -> Result<Source, SpecError> {
    found(kind, name)?.ok_or_else(|| {
        let message = format!("no such {}: not a file, not in {}/, not built in", kind.noun(), kind.folder());
        SpecError::plain(name, message).with_help(help(kind, name))
    })
}

/// Finds the spec of `kind` that the spec `referring` calls `name`: in the folder of `referring`, then as [`find`] does.
///
/// # Errors
/// If there is no such spec, with the position of the name in `referring`, or if the file cannot be read.
pub fn find_from(kind: Kind, referring: &Source, name: &str) -> Result<Source, SpecError> {
    found(kind, &name_from(referring, name))?.ok_or_else(|| {
        let folder = referring.folder.as_ref().map_or_else(String::new, |folder| match folder.to_str() {
            Some("") | None => "the folder of this file, ".to_owned(),
            Some(folder) => format!("{folder}/, "),
        });
        let message = format!("no such {}: \"{name}\" is not in {folder}{}/, not built in", kind.noun(), kind.folder());
        SpecError::about(referring, name, message).with_help(help(kind, name))
    })
}

/// The name by which [`find`] finds the spec that `referring` calls `name`: the path of a file in the folder of
/// `referring` if there is one, otherwise `name`.
pub fn name_from(referring: &Source, name: &str) -> String {
    let Some(folder) = &referring.folder else { return name.to_owned() };
    let candidates = [folder.join(name), folder.join(file_of(name))];
    candidates.iter().find(|path| path.is_file()).map_or_else(|| name.to_owned(), |path| path.display().to_string())
}

fn found(kind: Kind, name: &str) -> Result<Option<Source>, SpecError> {
    let file = file_of(name);
    let local = Path::new(kind.folder()).join(&file);
    let candidates = [PathBuf::from(name), PathBuf::from(&file), local];
    let is_spec = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "ron") && path.is_file();
    if let Some(path) = candidates.iter().find(is_spec) {
        return Source::read(path).map(Some);
    }
    let built_in = built_in(kind, &file);
    if built_in.is_none() && Path::new(name).is_file() {
        // A spec can name any file of the machine, and an error about a spec quotes a line of it.
        let message = format!("its name does not end in .ron, so it is not read as a {}", kind.noun());
        return Err(SpecError::plain(name, message));
    }
    Ok(built_in)
}

/// File name of the spec `name`.
fn file_of(name: &str) -> String {
    if name.ends_with(".ron") { name.to_owned() } else { format!("{name}.ron") }
}

fn help(kind: Kind, name: &str) -> String {
    let names = names(kind);
    let question = did_you_mean(name.trim_end_matches(".ron"), names.iter().map(String::as_str));
    let question = question.map_or_else(String::new, |question| question + " ");
    format!("{question}built in are: {}", names.join(", "))
}

/// The spec in the binary with the file name `file`, such as `default.ron`.
pub fn built_in(kind: Kind, file: &str) -> Option<Source> {
    let inside = folder_in_binary(kind)?.files().find(|entry| file_name(entry) == Some(file))?;
    let name = format!("{}/{file} (built in)", kind.folder());
    Some(Source::in_memory(name, inside.contents_utf8()?))
}

/// Finds the text file `name` to which a spec of `kind` refers: in the folder of the spec, or in the binary for a
/// built-in spec.
///
/// # Errors
/// If there is no such file, or it cannot be read.
pub fn text_file(kind: Kind, spec: &Source, name: &str) -> Result<Source, SpecError> {
    if let Some(folder) = &spec.folder {
        return Source::read(&folder.join(name));
    }
    if let Some(source) = built_in(kind, name) {
        return Ok(source);
    }
    Source::read(Path::new(name))
}

/// Names of the built-in specs of a kind, sorted.
pub fn names(kind: Kind) -> Vec<String> {
    let files = folder_in_binary(kind).into_iter().flat_map(Dir::files);
    let mut names: Vec<String> =
        files.filter_map(file_name).filter_map(|name| name.strip_suffix(".ron")).map(str::to_owned).collect();
    names.sort();
    names
}

pub(super) fn folder_in_binary(kind: Kind) -> Option<&'static Dir<'static>> {
    match kind.folder().strip_prefix("specs/") {
        None => Some(&SCENES),
        Some(sub) => SPECS.get_dir(sub),
    }
}

fn file_name<'a>(entry: &'a include_dir::File<'_>) -> Option<&'a str> {
    entry.path().file_name()?.to_str()
}
