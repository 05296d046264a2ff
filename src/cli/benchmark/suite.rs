//! The list of the recordings of a benchmark: `suite.json`.

use anyhow::{Context, bail, ensure};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_study::sweep::{Plan, SuiteRecording};

/// Name of the list in the folder of the benchmark.
pub(super) const SUITE: &str = "suite.json";

/// The recordings of a benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Suite {
    /// Name of the study.
    pub(super) suite: String,
    /// Version of zsim that simulated it.
    pub(super) version: String,
    pub(super) recordings: Vec<Item>,
}

/// A recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Item {
    pub(super) name: String,
    /// Paths relative to the folder of the benchmark.
    pub(super) recording: PathBuf,
    pub(super) truth: PathBuf,
    pub(super) seed: u64,
    /// Hash of everything that determines the recording.
    pub(super) identity: String,
    /// Value of each axis of the study.
    pub(super) settings: Map<String, Value>,
}

impl Suite {
    pub(super) fn of(plan: &Plan, recordings: &[SuiteRecording]) -> anyhow::Result<Self> {
        let item = |recording: &SuiteRecording| {
            let settings =
                recording.settings.iter().map(|(axis, value)| Ok((axis.clone(), serde_json::to_value(value)?)));
            Ok(Item {
                name: recording.name.clone(),
                recording: Path::new("recordings").join(format!("{}.mcap", recording.name)),
                truth: Path::new("truth").join(format!("{}.tum", recording.name)),
                seed: recording.seed,
                identity: recording.identity.clone(),
                settings: settings.collect::<anyhow::Result<_>>()?,
            })
        };
        Ok(Self {
            suite: plan.name().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            recordings: recordings.iter().map(item).collect::<anyhow::Result<_>>()?,
        })
    }

    /// Reads the list in `folder`; `None` if there is none.
    ///
    /// # Errors
    /// If it cannot be read, or if a name in it is not the name of a file.
    pub(super) fn read(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join(SUITE);
        let text = match files::open(&path).and_then(std::io::read_to_string) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            text => text.with_context(|| format!("{} cannot be read", path.display()))?,
        };
        let suite: Self = serde_json::from_str(&text).with_context(|| format!("{} is not a suite", path.display()))?;
        for item in &suite.recordings {
            let is_name = Path::new(&item.name).file_name().is_some_and(|name| name == item.name.as_str());
            let is_inside = |path: &Path| path.is_relative() && !path.components().any(|part| part.as_os_str() == "..");
            if !(is_name && is_inside(&item.recording) && is_inside(&item.truth)) {
                bail!("{}: {:?} is not the name of a recording in this folder", path.display(), item.name);
            }
        }
        ensure!(!suite.recordings.is_empty(), "{}: the suite has no recording", path.display());
        Ok(Some(suite))
    }
}
