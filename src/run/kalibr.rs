//! Reads calibrations in the YAML formats of Kalibr and allan_variance_ros: IMU noise and lidar-IMU extrinsics.

use super::RunError;
use super::sensor_models::{CalibrationSpec, ImuNoiseSpec};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::path::Path;
use zsim_base::geometry::{Pose, Rotation};
use zsim_dynamics::PlacementSpec;
use zsim_recording::parse_yaml;

/// Maximum deviation of a matrix element from a rigid transform: manually written files have 3 or 4 digits.
const RIGID_TOLERANCE: f64 = 1e-3;

/// Rows of a 4x4 matrix.
type Rows = Vec<Vec<f64>>;

/// A calibration file: IMU noise at the top level or under `imu0`; transforms there or under `cam0` or `lidar0`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct File {
    imu0: Option<Imu>,
    cam0: Option<Sensor>,
    lidar0: Option<Sensor>,
    accelerometer_noise_density: Option<f64>,
    accelerometer_random_walk: Option<f64>,
    gyroscope_noise_density: Option<f64>,
    gyroscope_random_walk: Option<f64>,
    update_rate: Option<f64>,
    rostopic: Option<IgnoredAny>,
    #[serde(rename = "T_imu_lidar")]
    imu_from_lidar: Option<Rows>,
    #[serde(rename = "T_lidar_imu")]
    lidar_from_imu: Option<Rows>,
    #[serde(rename = "T_cam_imu")]
    cam_from_imu: Option<Rows>,
}

/// An IMU in the format of Kalibr and allan_variance_ros; only the noise is used.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Imu {
    accelerometer_noise_density: Option<f64>,
    accelerometer_random_walk: Option<f64>,
    gyroscope_noise_density: Option<f64>,
    gyroscope_random_walk: Option<f64>,
    update_rate: Option<f64>,
    rostopic: Option<IgnoredAny>,
    model: Option<IgnoredAny>,
    time_offset: Option<IgnoredAny>,
    #[serde(rename = "T_i_b")]
    imu_from_body: Option<IgnoredAny>,
}

/// A key of a file, and its value.
type ImuKey = (&'static str, fn(&Imu) -> Option<f64>);

/// The keys of the noise of an IMU, and that of its rate.
const NOISE_KEYS: [ImuKey; 5] = [
    ("gyroscope_noise_density", |imu| imu.gyroscope_noise_density),
    ("accelerometer_noise_density", |imu| imu.accelerometer_noise_density),
    ("gyroscope_random_walk", |imu| imu.gyroscope_random_walk),
    ("accelerometer_random_walk", |imu| imu.accelerometer_random_walk),
    ("update_rate", |imu| imu.update_rate),
];

/// A sensor of Kalibr's chain, camera or lidar; only the transform is used.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Sensor {
    #[serde(rename = "T_imu_lidar")]
    imu_from_lidar: Option<Rows>,
    #[serde(rename = "T_lidar_imu")]
    lidar_from_imu: Option<Rows>,
    #[serde(rename = "T_cam_imu")]
    cam_from_imu: Option<Rows>,
    cam_overlaps: Option<IgnoredAny>,
    camera_model: Option<IgnoredAny>,
    distortion_coeffs: Option<IgnoredAny>,
    distortion_model: Option<IgnoredAny>,
    intrinsics: Option<IgnoredAny>,
    resolution: Option<IgnoredAny>,
    rostopic: Option<IgnoredAny>,
    timeshift_cam_imu: Option<IgnoredAny>,
}

impl CalibrationSpec {
    /// Reads a calibration file: RON, or YAML of Kalibr or allan_variance_ros (`.yaml`, `.yml`).
    ///
    /// # Errors
    /// When the file cannot be read, has an unknown key or an invalid value.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let source = zsim_base::spec::Source::read(path)?;
        let is_yaml = path.extension().is_some_and(|ending| ending == "yaml" || ending == "yml");
        if is_yaml {
            Self::from_kalibr(&source.text, &path.display().to_string())
        } else {
            Ok(zsim_base::spec::parse(&source)?)
        }
    }

    /// Parses the YAML of Kalibr or allan_variance_ros; `name` is the file name for messages.
    ///
    /// If the file has a transform, the head frame is the IMU frame.
    ///
    /// # Errors
    /// When the file has an unknown key or an invalid value, or neither noise nor a transform.
    pub fn from_kalibr(text: &str, name: &str) -> Result<Self, RunError> {
        let invalid = |problem: String| RunError::Calibration { name: name.to_owned(), problem };
        let file: File = parse_yaml(text).map_err(|error| invalid(error.to_string()))?;
        let transform = file.transform().map_err(invalid)?;
        let imu = file.noise(name)?;
        if transform.is_none() && imu.is_none() {
            return Err(invalid("the file has neither IMU noise (gyroscope_noise_density, ...) nor a transform (T_imu_lidar, T_lidar_imu or T_cam_imu)".to_owned()));
        }
        let head_from_imu = transform.map(|_| placement(&Pose::identity()));
        Ok(Self { head_from_laser: transform.as_ref().map(placement), head_from_imu, imu, ..Self::default() })
    }
}

fn placement(pose: &Pose) -> PlacementSpec {
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    PlacementSpec {
        position_m: pose.translation.vector.into(),
        roll_pitch_yaw_deg: [roll, pitch, yaw].map(f64::to_degrees),
    }
}

impl File {
    /// The transform `imu_from_lidar`, if the file has one.
    fn transform(&self) -> Result<Option<Pose>, String> {
        let top_level = Sensor {
            imu_from_lidar: self.imu_from_lidar.clone(),
            lidar_from_imu: self.lidar_from_imu.clone(),
            cam_from_imu: self.cam_from_imu.clone(),
            ..Sensor::default()
        };
        let mut found = Vec::new();
        for sensor in [Some(&top_level), self.cam0.as_ref(), self.lidar0.as_ref()].into_iter().flatten() {
            let given = [
                ("T_imu_lidar", &sensor.imu_from_lidar, false),
                ("T_lidar_imu", &sensor.lidar_from_imu, true),
                ("T_cam_imu", &sensor.cam_from_imu, true),
            ];
            for (key, rows, inverse) in given {
                if let Some(rows) = rows {
                    let pose = rigid(rows).map_err(|problem| format!("{key} {problem}"))?;
                    found.push(if inverse { pose.inverse() } else { pose });
                }
            }
        }
        match found.len() {
            0 | 1 => Ok(found.pop()),
            count => Err(format!("the file has {count} transforms between lidar and IMU; keep only one")),
        }
    }

    /// The IMU noise, if the file has it; it has neither turn-on biases nor limits.
    fn noise(&self, name: &str) -> Result<Option<ImuNoiseSpec>, RunError> {
        let invalid = |problem: String| RunError::Calibration { name: name.to_owned(), problem };
        let top_level = Imu {
            gyroscope_noise_density: self.gyroscope_noise_density,
            accelerometer_noise_density: self.accelerometer_noise_density,
            gyroscope_random_walk: self.gyroscope_random_walk,
            accelerometer_random_walk: self.accelerometer_random_walk,
            update_rate: self.update_rate,
            ..Imu::default()
        };
        let mut values = [None; 5];
        for ((key, of), value) in NOISE_KEYS.iter().zip(&mut values) {
            let (flat, nested) = (of(&top_level), self.imu0.as_ref().and_then(of));
            if flat.is_some() && nested.is_some() {
                return Err(invalid(format!("{key} is given twice, at the top level and under imu0")));
            }
            *value = flat.or(nested);
            if value.is_some_and(|value| !(value.is_finite() && value > 0.0)) {
                return Err(invalid(format!("{key} must be a positive number")));
            }
        }
        match values {
            [None, None, None, None, _] => Ok(None),
            [Some(gyro), Some(accel), Some(gyro_walk), Some(accel_walk), _] => Ok(Some(ImuNoiseSpec {
                gyro_density_rad_per_s_per_sqrt_hz: Some(gyro),
                accel_density_m_per_s2_per_sqrt_hz: Some(accel),
                gyro_bias_walk_rad_per_s_per_sqrt_s: Some(gyro_walk),
                accel_bias_walk_m_per_s2_per_sqrt_s: Some(accel_walk),
                ..ImuNoiseSpec::default()
            })),
            _ => {
                let noise = NOISE_KEYS[..4].iter().zip(values);
                let missing: Vec<_> = noise.filter(|(_, value)| value.is_none()).map(|((key, _), _)| *key).collect();
                Err(invalid(format!("the IMU noise has no {}", missing.join(" and no "))))
            }
        }
    }
}

/// Converts the rows of a 4x4 matrix to a rigid transform.
fn rigid(rows: &Rows) -> Result<Pose, String> {
    let is_4_by_4 = rows.len() == 4 && rows.iter().all(|row| row.len() == 4);
    if !is_4_by_4 || !rows.iter().flatten().all(|x| x.is_finite()) {
        return Err("must be four rows of four numbers".to_owned());
    }
    let turn = Matrix3::from_fn(|row, column| rows[row][column]);
    let deviation = (turn * turn.transpose() - Matrix3::identity()).abs().max();
    let last = rows[3].iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(x, expected)| (x - expected).abs() < RIGID_TOLERANCE);
    if deviation > RIGID_TOLERANCE || turn.determinant() < 0.0 || !last {
        return Err(
            "is not a rigid transform: a rotation, a translation in metres and the last row 0, 0, 0, 1".to_owned()
        );
    }
    let rotation = Rotation::from_rotation_matrix(&Rotation3::from_matrix(&turn));
    Ok(Pose::from_parts(Vector3::new(rows[0][3], rows[1][3], rows[2][3]).into(), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn read(text: &str) -> Result<CalibrationSpec, String> {
        CalibrationSpec::from_kalibr(text, "imu.yaml").map_err(|error| error.to_string())
    }

    const NOISE: &str = "accelerometer_noise_density: 1.86e-03\naccelerometer_random_walk: 4.33e-04\n\
                         gyroscope_noise_density: 1.87e-04\ngyroscope_random_walk: 2.66e-05\n";

    #[test]
    fn noise_of_kalibr_and_allan_variance_ros_is_read() {
        let flat = read(&format!("#Accelerometers\n{NOISE}rostopic: '/imu'\nupdate_rate: 400.0\n")).unwrap();
        let nested =
            format!("imu0:\n  {}  model: calibrated\n  time_offset: 0.0\n", NOISE.replace('\n', "\n  ").trim_end());
        let nested = read(&nested.replace("-05  model", "-05\n  model")).unwrap();
        assert_eq!(flat, nested);
        let imu = flat.imu.unwrap();
        assert_eq!(imu.gyro_density_rad_per_s_per_sqrt_hz, Some(1.87e-4));
        assert_eq!(imu.accel_density_m_per_s2_per_sqrt_hz, Some(1.86e-3));
        assert_eq!(imu.gyro_bias_walk_rad_per_s_per_sqrt_s, Some(2.66e-5));
        assert_eq!(imu.accel_bias_walk_m_per_s2_per_sqrt_s, Some(4.33e-4));
        assert!(flat.head_from_laser.is_none() && flat.head_from_imu.is_none());
    }

    #[test]
    fn transforms_are_read_in_both_directions() {
        // The lidar is 0.3 m in front of the IMU and yawed by 90 degrees to the left: lidar x is IMU y.
        let imu_from_lidar =
            "- [0.0, -1.0, 0.0, 0.3]\n- [1.0, 0.0, 0.0, 0.0]\n- [0.0, 0.0, 1.0, 0.0]\n- [0.0, 0.0, 0.0, 1.0]\n";
        // The inverse, computed by hand: x_lidar = y_imu, y_lidar = 0.3 - x_imu.
        let inverse = "[[0, 1, 0, 0], [-1, 0, 0, 0.3], [0, 0, 1, 0], [0, 0, 0, 1]]";
        let files = [
            format!("T_imu_lidar:\n{imu_from_lidar}"),
            format!("T_lidar_imu: {inverse}\n"),
            format!("cam0:\n  T_cam_imu: {inverse}\n  camera_model: pinhole\n  timeshift_cam_imu: 0.01\n"),
        ];
        for file in files {
            let spec = read(&file).unwrap();
            let found = spec.head_from_laser.unwrap();
            assert_relative_eq!(found.position_m[..], [0.3, 0.0, 0.0][..], epsilon = 1e-12);
            assert_relative_eq!(found.roll_pitch_yaw_deg[..], [0.0, 0.0, 90.0][..], epsilon = 1e-9);
            assert_eq!(spec.head_from_imu.unwrap().pose(), Pose::identity());
            assert!(spec.imu.is_none());
        }
    }

    #[test]
    fn invalid_files_are_rejected() {
        let error = |text: &str| read(text).unwrap_err();
        let unknown = error("accelerometer_noise: 1.0\n");
        assert!(unknown.contains("imu.yaml: ") && unknown.contains("accelerometer_noise_density"), "{unknown}");
        assert!(error("gyroscope_noise_density: 1e-3\n").contains("has no accelerometer_noise_density and no"));
        assert!(error(&NOISE.replace("1.86e-03", "-1.0")).contains("accelerometer_noise_density must be a positive"));
        assert!(error(&NOISE.replace("1.86e-03", ".nan")).contains("must be a positive number"));
        assert!(error("T_imu_lidar: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n").contains("four rows of four numbers"));
        let scaled = "T_imu_lidar: [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]\n";
        assert!(error(scaled).contains("is not a rigid transform"));
        assert!(error("update_rate: 100\n").contains("neither IMU noise"));
        // Nested aliases that expand to 10^9 numbers.
        let mut bomb = "a: &a [0,0,0,0,0,0,0,0,0,0]\n".to_owned();
        for (target, name) in "abcdefgh".chars().zip("bcdefghi".chars()) {
            bomb.push_str(&format!("{name}: &{name} [{}]\n", vec![format!("*{target}"); 10].join(",")));
        }
        bomb.push_str("T_imu_lidar: *i\n");
        assert!(error(&bomb).starts_with("imu.yaml: "));
        let nested_in_a_key = format!(
            "rostopic: [{}]\n{NOISE}",
            bomb.replace("T_imu_lidar", "x").replace('\n', "}, {").trim_end_matches(", {")
        );
        assert!(read(&nested_in_a_key).is_err());
    }
}
