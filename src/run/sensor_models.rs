//! Sensor models for an estimate: noise and averaging, each value with its source.

use super::manifest::RecordedSensors;
use super::{Manifest, RunError};
use serde::{Deserialize, Serialize};
use std::fmt;
use zsim_base::measurement::{ImuAveraging, ImuNoise, LidarNoise};
use zsim_base::spec::{Kind, NamedSpec, SpecError, find};
use zsim_dynamics::PlacementSpec;
use zsim_report::{NoiseMetrics, SensorMetrics, noise_sources};
use zsim_sensors::{Imu, ImuSpec, Lidar, LidarSpec};

/// Noise of a simulated sensor that has none, because the estimator weights residuals by it: densities of gyroscope,
/// rad/s/sqrt(Hz), and accelerometer, m/s^2/sqrt(Hz), below those of tactical IMUs, and standard deviation of ranges, m.
const LEAST_GYRO_DENSITY: f64 = 1e-6;
const LEAST_ACCEL_DENSITY: f64 = 1e-5;
const LEAST_RANGE_SIGMA_M: f64 = 5e-4;

/// Where the value of a sensor model comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ValueSource {
    /// The calibration file of the user.
    Calibration,
    /// The manifest of the simulation in the recording.
    Manifest,
    /// The least noise, for a simulated sensor without any.
    Least,
    /// The default for unknown sensors.
    Assumed,
}

impl fmt::Display for ValueSource {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Calibration => "from --calibration",
            Self::Manifest => "from the recording's manifest",
            Self::Least => "the least that is used; it is 0 in the recording's manifest",
            Self::Assumed => "assumed",
        })
    }
}

/// Noise of an IMU as far as it is known; see [`ImuNoise`] for the quantities.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImuNoiseSpec {
    /// White noise density of the gyroscope, rad/s/sqrt(Hz).
    pub gyro_density_rad_per_s_per_sqrt_hz: Option<f64>,
    /// White noise density of the accelerometer, m/s^2/sqrt(Hz).
    pub accel_density_m_per_s2_per_sqrt_hz: Option<f64>,
    /// Random walk of the gyroscope bias, rad/s/sqrt(s).
    pub gyro_bias_walk_rad_per_s_per_sqrt_s: Option<f64>,
    /// Random walk of the accelerometer bias, m/s^2/sqrt(s).
    pub accel_bias_walk_m_per_s2_per_sqrt_s: Option<f64>,
    /// Standard deviation of the gyroscope bias at power-on, rad/s.
    pub gyro_turn_on_bias_rad_per_s: Option<f64>,
    /// Standard deviation of the accelerometer bias at power-on, m/s^2.
    pub accel_turn_on_bias_m_per_s2: Option<f64>,
    /// Standard deviation of the scale error of each axis of the gyroscope, as a fraction of the rate.
    pub gyro_scale_error: Option<f64>,
    /// Standard deviation of the misalignment of each axis of the gyroscope towards each other axis, rad.
    pub gyro_misalignment_rad: Option<f64>,
    /// Standard deviation of the scale error of each axis of the accelerometer, as a fraction of the specific force.
    pub accel_scale_error: Option<f64>,
    /// Standard deviation of the misalignment of each axis of the accelerometer towards each other axis, rad.
    pub accel_misalignment_rad: Option<f64>,
    /// Measuring range of the gyroscope per axis, rad/s.
    pub gyro_limit_rad_per_s: Option<f64>,
    /// Measuring range of the accelerometer per axis, m/s^2.
    pub accel_limit_m_per_s2: Option<f64>,
}

/// Range noise of a lidar as far as it is known; see [`LidarNoise`] for the quantities.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LidarNoiseSpec {
    /// Standard deviation of ranges up to `near_m`, m.
    pub near_sigma_m: Option<f64>,
    /// Range up to which `near_sigma_m` applies, m.
    pub near_m: Option<f64>,
    /// Standard deviation at `far_m`, m.
    pub far_sigma_m: Option<f64>,
    /// Range at which `far_sigma_m` applies, m.
    pub far_m: Option<f64>,
}

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
    pub imu: Option<ImuNoiseSpec>,
    /// How the IMU derives its samples from the motion.
    pub imu_averaging: Option<ImuAveraging>,
    /// The lidar's noise.
    pub lidar: Option<LidarNoiseSpec>,
}

/// Models of IMU and lidar, and the source of each value.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SensorModels {
    pub imu: ImuNoise,
    pub imu_averaging: ImuAveraging,
    pub lidar: LidarNoise,
    averaging_source: ValueSource,
    /// Key, value and source of each noise parameter.
    noise: Vec<(String, f64, ValueSource)>,
}

impl SensorModels {
    /// Given values, completed by those of the `recorded` sensors, else by those of unknown sensors.
    pub fn new(given: &CalibrationSpec, recorded: &RecordedSensors) -> Result<Self, RunError> {
        let manifest = Manifest::source("");
        let (imu, imu_source) = match &recorded.imu {
            Some(spec) => (Imu::new(spec, &manifest)?, ValueSource::Manifest),
            None => (unknown_imu()?, ValueSource::Assumed),
        };
        let (lidar, lidar_source) = match &recorded.lidar {
            Some(spec) => (Lidar::new(spec, &manifest)?, ValueSource::Manifest),
            None => (unknown_lidar()?, ValueSource::Assumed),
        };
        let mut values = Values { source: imu_source, noise: Vec::new() };
        let imu_noise = values.imu(given.imu.unwrap_or_default(), &imu.noise());
        values.source = lidar_source;
        Ok(Self {
            imu: imu_noise,
            lidar: values.lidar(given.lidar.unwrap_or_default(), &lidar.noise()),
            imu_averaging: given.imu_averaging.unwrap_or(imu.averaging()),
            averaging_source: given.imu_averaging.map_or(imu_source, |_| ValueSource::Calibration),
            noise: values.noise,
        })
    }

    /// The values and sources for `metrics.json`.
    pub fn metrics(&self) -> SensorMetrics {
        let noise = self.noise.iter().map(|(key, value, source)| NoiseMetrics {
            key: key.clone(),
            value: *value,
            source: source.to_string(),
        });
        let averaging = match self.imu_averaging {
            ImuAveraging::None => "none",
            ImuAveraging::BodyMean => "body_mean",
            ImuAveraging::ConingCorrected => "coning_corrected",
        };
        SensorMetrics {
            imu_averaging: Some(averaging.to_owned()),
            imu_averaging_source: Some(self.averaging_source.to_string()),
            noise: noise.collect(),
        }
    }

    /// A note on the source of the noise of each sensor, and on the values that had to be assumed.
    pub fn note(&self) -> String {
        let noise = self.metrics().noise;
        let of = |sensor: &str| noise_sources(&noise, sensor).unwrap_or_default();
        let (imu, lidar) = (of("imu."), of("lidar."));
        let sources = if imu == lidar { imu.clone() } else { format!("IMU {imu}; lidar {lidar}") };
        let unknown: Vec<&str> = [
            (imu, "IMU noise of a typical IMU (specs/imus/unknown.ron)"),
            (lidar, "range noise of a UTM-30LX (10 mm up to 10 m, 30 mm at 30 m)"),
        ]
        .into_iter()
        .filter(|(sources, _)| sources.contains(&ValueSource::Assumed.to_string()))
        .map(|(_, what)| what)
        .collect();
        match unknown.join(" and ") {
            known if known.is_empty() => format!("noise: {sources}"),
            values => {
                format!("noise: {sources}; assumed are {values}: pass the values of the data sheet with --calibration")
            }
        }
    }
}

/// Collects the values with their sources.
struct Values {
    /// Source of the values that are not given.
    source: ValueSource,
    noise: Vec<(String, f64, ValueSource)>,
}

impl Values {
    fn value(&mut self, key: &str, given: Option<f64>, otherwise: f64) -> f64 {
        let (value, source) = given.map_or((otherwise, self.source), |value| (value, ValueSource::Calibration));
        self.noise.push((key.to_owned(), value, source));
        value
    }

    /// As [`value`](Self::value), for noise that the estimator needs: a simulated sensor may have none.
    fn noise(&mut self, key: &str, given: Option<f64>, otherwise: f64, least: f64) -> f64 {
        match given {
            None if otherwise == 0.0 => {
                self.noise.push((key.to_owned(), least, ValueSource::Least));
                least
            }
            given => self.value(key, given, otherwise),
        }
    }

    fn imu(&mut self, given: ImuNoiseSpec, otherwise: &ImuNoise) -> ImuNoise {
        macro_rules! value {
            ($key:ident) => {
                self.value(concat!("imu.", stringify!($key)), given.$key, otherwise.$key)
            };
            ($key:ident, at least $least:expr) => {
                self.noise(concat!("imu.", stringify!($key)), given.$key, otherwise.$key, $least)
            };
        }
        ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: value!(gyro_density_rad_per_s_per_sqrt_hz, at least LEAST_GYRO_DENSITY),
            accel_density_m_per_s2_per_sqrt_hz: value!(accel_density_m_per_s2_per_sqrt_hz, at least LEAST_ACCEL_DENSITY),
            gyro_bias_walk_rad_per_s_per_sqrt_s: value!(gyro_bias_walk_rad_per_s_per_sqrt_s),
            accel_bias_walk_m_per_s2_per_sqrt_s: value!(accel_bias_walk_m_per_s2_per_sqrt_s),
            gyro_turn_on_bias_rad_per_s: value!(gyro_turn_on_bias_rad_per_s),
            accel_turn_on_bias_m_per_s2: value!(accel_turn_on_bias_m_per_s2),
            gyro_scale_error: value!(gyro_scale_error),
            gyro_misalignment_rad: value!(gyro_misalignment_rad),
            accel_scale_error: value!(accel_scale_error),
            accel_misalignment_rad: value!(accel_misalignment_rad),
            gyro_limit_rad_per_s: value!(gyro_limit_rad_per_s),
            accel_limit_m_per_s2: value!(accel_limit_m_per_s2),
        }
    }

    fn lidar(&mut self, given: LidarNoiseSpec, otherwise: &LidarNoise) -> LidarNoise {
        LidarNoise {
            near_sigma_m: self.noise(
                "lidar.near_sigma_m",
                given.near_sigma_m,
                otherwise.near_sigma_m,
                LEAST_RANGE_SIGMA_M,
            ),
            near_m: self.value("lidar.near_m", given.near_m, otherwise.near_m),
            far_sigma_m: self.noise("lidar.far_sigma_m", given.far_sigma_m, otherwise.far_sigma_m, LEAST_RANGE_SIGMA_M),
            far_m: self.value("lidar.far_m", given.far_m, otherwise.far_m),
        }
    }
}

/// An IMU without a known specification.
pub(super) fn unknown_imu() -> Result<Imu, SpecError> {
    let source = find(Kind::Imu, "unknown")?;
    Imu::new(&ImuSpec::parse(&source)?, &source)
}

/// The lidar of the paper, for a lidar without a known specification.
fn unknown_lidar() -> Result<Lidar, SpecError> {
    let source = find(Kind::Lidar, "utm30lx")?;
    Lidar::new(&LidarSpec::parse(&source)?, &source)
}
