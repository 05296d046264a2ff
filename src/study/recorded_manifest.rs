//! The manifest in a recording, as far as this version of zsim can read it.

use super::Manifest;
use super::sensor_models::RecordedSensors;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use zsim_base::spec::{self, Named, NamedSpec, SpecError};
use zsim_recording::Reader;
use zsim_sensors::{ImuSpec, LidarSpec};

/// The manifest in a recording; of one that another version wrote with other keys, the sensors that can be read.
pub(super) struct RecordedManifest {
    /// The manifest; without simulation if it is missing or cannot be read completely.
    pub manifest: Manifest,
    /// Sensors of a manifest that cannot be read completely.
    partial: PartialSensors,
    /// A message to the user on a manifest that cannot be read completely.
    pub note: Option<String>,
}

/// The sensors that could be read.
#[derive(Default)]
struct PartialSensors {
    imu: Option<ImuSpec>,
    lidar: Option<LidarSpec>,
}

/// The parts of a manifest that are read one by one; other keys are ignored.
#[derive(Deserialize)]
struct LooseManifest {
    #[serde(default)]
    version: Option<String>,
    #[serde(default)]
    run: Option<LooseSensors>,
    /// The key of `run` in manifests before 0.1.0.
    #[serde(default)]
    specs: Option<LooseSensors>,
}

/// Texts of the sensors.
#[derive(Deserialize)]
struct LooseSensors {
    #[serde(default)]
    imu: Option<Box<ron::value::RawValue>>,
    #[serde(default)]
    lidar: Option<Box<ron::value::RawValue>>,
}

impl RecordedManifest {
    /// Reads the manifest in the recording of `reader`.
    pub(super) fn read(reader: &Reader) -> Self {
        let complete = |manifest| Self { manifest, partial: PartialSensors::default(), note: None };
        match Manifest::in_recording(reader) {
            Ok(manifest) => complete(manifest.unwrap_or_else(Manifest::without_simulation)),
            Err(error) => Self::read_partially(reader.manifest().unwrap_or_default(), &error),
        }
    }

    /// Reads the sensors of a manifest that cannot be read completely because of `error`.
    fn read_partially(text: &str, error: &SpecError) -> Self {
        let loose = parsed::<LooseManifest>(text);
        let version = loose.as_ref().and_then(|loose| loose.version.clone());
        let run = loose.and_then(|loose| loose.run.or(loose.specs));
        let (imu, lidar) = run.map_or((None, None), |run| (sensor(run.imu), sensor(run.lidar)));
        let read = match (&imu, &lidar) {
            (Some(_), Some(_)) => "the models of IMU and lidar are from it",
            (Some(_), None) => "the model of the IMU is from it, that of the lidar is not",
            (None, Some(_)) => "the model of the lidar is from it, that of the IMU is not",
            (None, None) => "no sensor models are from it",
        };
        let writer = version.map(|version| format!(", written by zsim {version},")).unwrap_or_default();
        let line = error.line_and_column().map(|(line, _)| format!("line {line}: ")).unwrap_or_default();
        let note = format!(
            "the manifest in the recording{writer} cannot be read by zsim {} ({line}{}): {read}, and the cloud is not evaluated; \
             if another version wrote it, use that version, or pass the sensor models with --calibration",
            env!("CARGO_PKG_VERSION"),
            error.message()
        );
        Self { manifest: Manifest::without_simulation(), partial: PartialSensors { imu, lidar }, note: Some(note) }
    }

    /// The sensors that could be read.
    pub(super) fn sensors(&self) -> RecordedSensors<'_> {
        match &self.manifest.run {
            Some(run) => RecordedSensors::of(run),
            None => RecordedSensors { imu: self.partial.imu.as_ref(), lidar: self.partial.lidar.as_ref() },
        }
    }
}

/// The value of `text`, if this version can read it.
fn parsed<T: DeserializeOwned>(text: &str) -> Option<T> {
    spec::parse(&Manifest::source(text)).ok()
}

/// A sensor with or without its name.
fn sensor<T: NamedSpec>(text: Option<Box<ron::value::RawValue>>) -> Option<T> {
    let text = text?;
    parsed::<Named<T>>(text.get_ron()).map(|named| named.spec).or_else(|| parsed::<T>(text.get_ron()))
}
