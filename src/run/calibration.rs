//! Extrinsics and sensor models of a recording.

use super::manifest::RecordedSensors;
use super::recorded_manifest::RecordedManifest;
use super::sensor_models::{CalibrationSpec, SensorModels, unknown_imu};
use super::{Manifest, RunError};
use zsim_base::geometry::Pose;
use zsim_base::measurement::{Calibration, ImuAveraging, ImuNoise};
use zsim_base::spec::SpecError;
use zsim_dynamics::PlacementSpec;
use zsim_recording::{FoundCalibration, Reader, Selection};
use zsim_sensors::Imu;

/// The calibration of a recording's sensors: from `given`, else from the recording, else that of unknown sensors.
///
/// # Errors
/// When the recording cannot be read, or `/tf_static` does not connect the sensors.
pub fn recording_calibration(
    reader: &Reader,
    selection: &Selection,
    given: &CalibrationSpec,
) -> Result<FoundCalibration, RunError> {
    Ok(calibration(reader, selection, given, &RecordedManifest::read(reader).sensors, None)?.0)
}

/// The calibration for an estimate: from the user, else from the recording, else the defaults.
///
/// Noise and averaging of the recording are those of the `recorded` sensors.
pub(super) fn calibration(
    reader: &Reader,
    selection: &Selection,
    given: &CalibrationSpec,
    recorded: &RecordedSensors,
    body_frame: Option<&str>,
) -> Result<(FoundCalibration, SensorModels), RunError> {
    let pose_of = |placement: Option<PlacementSpec>| placement.map(|placement| placement.pose());
    let (head_from_laser, head_from_imu) = (pose_of(given.head_from_laser), pose_of(given.head_from_imu));
    let models = SensorModels::new(given, recorded)?;
    let defaults = Calibration {
        head_from_laser: head_from_laser.unwrap_or_else(Pose::identity),
        head_from_imu: head_from_imu.unwrap_or_else(Pose::identity),
        imu: models.imu,
        imu_averaging: models.imu_averaging,
        lidar: models.lidar,
    };
    if head_from_laser.is_some() && head_from_imu.is_some() {
        let body_frame = body_frame.unwrap_or("head").to_owned();
        let (from_recording, notes) = (false, Vec::new());
        return Ok((FoundCalibration { calibration: defaults, body_frame, from_recording, notes }, models));
    }
    let mut found = reader.calibration(selection, &defaults, body_frame)?;
    let calibration = &mut found.calibration;
    calibration.head_from_laser = head_from_laser.unwrap_or(calibration.head_from_laser);
    calibration.head_from_imu = head_from_imu.unwrap_or(calibration.head_from_imu);
    Ok((found, models))
}

/// Noise and averaging of the base IMU: from the manifest of a simulated recording, else those of a typical IMU.
pub(super) fn base_imu(reader: &Reader) -> Result<(ImuNoise, ImuAveraging), SpecError> {
    let run = Manifest::in_recording(reader)?.and_then(|manifest| manifest.run);
    let imu = match run.and_then(|run| run.base_imu) {
        Some(imu) => Imu::new(&imu.spec, &Manifest::source(""))?,
        None => unknown_imu()?,
    };
    Ok((imu.noise(), imu.averaging()))
}
