//! Extrinsics and noise of the sensors of a recording.

use super::{Manifest, StudyError};
use crate::dynamics::PlacementSpec;
use crate::geometry::Pose;
use crate::measurement::{Calibration, ImuNoise, LidarNoise};
use crate::recording::{FoundCalibration, Reader, Selection};
use crate::sensors::{Imu, ImuSpec, Lidar, LidarSpec};
use crate::spec::{Kind, Source, SpecError, find, parse};
use serde::{Deserialize, Serialize};

/// Sensor calibration given by the user.
///
/// A missing entry is read from the recording; if the recording has none, it is that of the UTM-30LX or of a typical
/// IMU (`specs/imus/unknown.ron`).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalibrationSpec {
    /// Pose of the lidar in the head.
    pub head_from_laser: Option<PlacementSpec>,
    /// Pose of the IMU in the head.
    pub head_from_imu: Option<PlacementSpec>,
    /// The IMU's noise.
    pub imu: Option<ImuNoise>,
    /// The lidar's noise.
    pub lidar: Option<LidarNoise>,
}

/// The calibration for an estimate: from the user, else from the recording, else the defaults.
pub(super) fn calibration(
    reader: &Reader,
    selection: &Selection,
    given: &CalibrationSpec,
    body_frame: Option<&str>,
) -> Result<FoundCalibration, StudyError> {
    let pose_of = |placement: Option<PlacementSpec>| placement.map(|placement| placement.pose());
    let (head_from_laser, head_from_imu) = (pose_of(given.head_from_laser), pose_of(given.head_from_imu));
    let (imu, lidar) = noise(reader)?;
    let defaults = Calibration {
        head_from_laser: head_from_laser.unwrap_or_else(Pose::identity),
        head_from_imu: head_from_imu.unwrap_or_else(Pose::identity),
        imu: given.imu.unwrap_or(imu),
        lidar: given.lidar.unwrap_or(lidar),
    };
    if head_from_laser.is_some() && head_from_imu.is_some() {
        let body_frame = body_frame.unwrap_or("head").to_owned();
        return Ok(FoundCalibration { calibration: defaults, body_frame, from_recording: false });
    }
    let mut found = reader.calibration(selection, &defaults, body_frame)?;
    let calibration = &mut found.calibration;
    calibration.head_from_laser = head_from_laser.unwrap_or(calibration.head_from_laser);
    calibration.head_from_imu = head_from_imu.unwrap_or(calibration.head_from_imu);
    Ok(found)
}

/// Noise of the base IMU: from the manifest of a simulated recording, else that of a typical IMU.
pub(super) fn base_imu_noise(reader: &Reader) -> Result<ImuNoise, SpecError> {
    let run = Manifest::in_recording(reader).and_then(|manifest| manifest.run);
    let Some(imu) = run.and_then(|run| run.base_imu) else { return typical_imu_noise() };
    Ok(Imu::new(&imu.spec, &Source::in_memory("the recording's manifest", ""))?.noise())
}

/// Sensor noise: from the manifest of a simulated recording, else that of a typical IMU and of the paper's lidar.
fn noise(reader: &Reader) -> Result<(ImuNoise, LidarNoise), SpecError> {
    if let Some(run) = Manifest::in_recording(reader).and_then(|manifest| manifest.run) {
        let source = Source::in_memory("the recording's manifest", "");
        return Ok((Imu::new(&run.imu.spec, &source)?.noise(), Lidar::new(&run.lidar.spec, &source)?.noise()));
    }
    let lidar = find(Kind::Lidar, "utm30lx")?;
    let lidar_spec: LidarSpec = parse(&lidar)?;
    Ok((typical_imu_noise()?, Lidar::new(&lidar_spec, &lidar)?.noise()))
}

/// Noise of an IMU without a known specification.
pub(super) fn typical_imu_noise() -> Result<ImuNoise, SpecError> {
    let imu = find(Kind::Imu, "unknown")?;
    let spec: ImuSpec = parse(&imu)?;
    Ok(Imu::new(&spec, &imu)?.noise())
}
