//! The manifest in a recording, as far as this version of zsim can read it.

use super::Manifest;
use super::manifest::RecordedSensors;
use zsim_base::spec::{Named, NamedSpec, SpecError, Subtree, Tree};
use zsim_recording::Reader;

/// The manifest in a recording; of one that another version wrote with other keys, the sensors that can be read.
pub(super) struct RecordedManifest {
    /// The manifest; without simulation if it is missing or cannot be read completely.
    pub manifest: Manifest,
    /// The sensors of its simulation, also of a manifest that cannot be read completely.
    pub sensors: RecordedSensors,
    /// A message to the user on a manifest that cannot be read completely.
    pub note: Option<String>,
}

impl RecordedManifest {
    /// Reads the manifest in the recording of `reader`.
    pub(super) fn read(reader: &Reader) -> Self {
        match Manifest::in_recording(reader) {
            Ok(manifest) => {
                let manifest = manifest.unwrap_or_else(Manifest::without_simulation);
                Self { sensors: manifest.sensors(), manifest, note: None }
            }
            Err(error) => Self::read_partially(reader.manifest().unwrap_or_default(), &error),
        }
    }

    /// Reads the sensors of a manifest that cannot be read completely because of `error`.
    fn read_partially(text: &str, error: &SpecError) -> Self {
        let tree = Tree::read(&Manifest::source(text)).ok();
        let part = |path: &[&str]| tree.as_ref()?.get(path);
        let version = part(&["version"]).and_then(|version| version.to::<Option<String>>().ok()?);
        // The key of `run` is `specs` in manifests before 0.1.0.
        let run = part(&["run"]).or_else(|| part(&["specs"]));
        let imu = run.and_then(|run| sensor(run.get(&["imu"])?));
        let lidar = run.and_then(|run| sensor(run.get(&["lidar"])?));
        let read = match (&imu, &lidar) {
            (Some(_), Some(_)) => "its models of IMU and lidar are used",
            (Some(_), None) => "its model of the IMU is used, that of the lidar is unknown",
            (None, Some(_)) => "its model of the lidar is used, that of the IMU is unknown",
            (None, None) => "the models of the sensors are unknown",
        };
        let writer = version.map(|version| format!(", written by zsim {version},")).unwrap_or_default();
        let line = error.line_and_column().map(|(line, _)| format!("line {line}: ")).unwrap_or_default();
        let note = format!(
            "the manifest in the recording{writer} cannot be read by zsim {} ({line}{}): {read}, and the cloud is not evaluated; \
             if another version wrote it, use that version, or pass the sensor models with --calibration",
            env!("CARGO_PKG_VERSION"),
            error.message()
        );
        Self { manifest: Manifest::without_simulation(), sensors: RecordedSensors { imu, lidar }, note: Some(note) }
    }
}

/// A sensor with or without its name, if this version can read it.
fn sensor<T: NamedSpec>(part: Subtree<'_>) -> Option<T> {
    let named = part.to::<Option<Named<T>>>().map(|named| named.map(|named| named.spec));
    named.or_else(|_| part.to::<Option<T>>()).ok()?
}
