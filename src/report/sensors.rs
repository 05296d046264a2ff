//! Sensor models of an estimate and their sources, as in `metrics.json`.

use serde::{Deserialize, Serialize};

/// Models of IMU and lidar that the estimator used, each value with its source.
///
/// A source is `from --calibration`, `from the recording's manifest` or `assumed`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorMetrics {
    /// How the IMU derives its samples from the motion: `none`, `body_mean` or `coning_corrected`.
    pub imu_averaging: Option<String>,
    /// Source of `imu_averaging`.
    pub imu_averaging_source: Option<String>,
    /// Noise parameters of IMU and lidar.
    pub noise: Vec<NoiseMetrics>,
}

/// A noise parameter and its source.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseMetrics {
    /// Key as in the calibration file, with the sensor: `imu.gyro_density_rad_per_s_per_sqrt_hz`.
    pub key: String,
    /// Value, in the unit of the key.
    pub value: f64,
    /// Source of the value.
    pub source: String,
}

/// The sources of the parameters of a sensor, with their number if there are several; `None` without parameters.
pub fn noise_sources(noise: &[NoiseMetrics], sensor: &str) -> Option<String> {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for parameter in noise.iter().filter(|parameter| parameter.key.starts_with(sensor)) {
        match counts.iter_mut().find(|(source, _)| *source == parameter.source) {
            Some((_, count)) => *count += 1,
            None => counts.push((&parameter.source, 1)),
        }
    }
    match counts[..] {
        [] => None,
        [(source, _)] => Some(source.to_owned()),
        _ => Some(counts.iter().map(|(source, count)| format!("{count} {source}")).collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_counted_when_they_differ() {
        let parameter =
            |key: &str, source: &str| NoiseMetrics { key: key.to_owned(), value: 1.0, source: source.to_owned() };
        let noise = [
            parameter("imu.a", "from --calibration"),
            parameter("imu.b", "assumed"),
            parameter("imu.c", "assumed"),
            parameter("lidar.a", "assumed"),
        ];
        assert_eq!(noise_sources(&noise, "imu.").unwrap(), "1 from --calibration, 2 assumed");
        assert_eq!(noise_sources(&noise, "lidar.").unwrap(), "assumed");
        assert_eq!(noise_sources(&noise, "base."), None);
    }
}
