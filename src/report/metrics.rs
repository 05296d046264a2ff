//! Metrics of a run: the contents of `metrics.json`.

use super::{EventMetrics, IntegrityMetrics};
use serde::{Deserialize, Serialize};

/// Metrics of a run.
///
/// All values are in SI units except angles, which are in degrees. A metric is `None` (`null` in the file) if it was not
/// computed, for example because the recording has no truth.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Metrics {
    /// Version of zsim.
    pub version: String,
    /// Name of the scene; `None` if the recording was not made by zsim.
    pub scene: Option<String>,
    /// Random seed of the simulation.
    pub seed: Option<u64>,
    /// Length of the recording, s.
    pub duration_s: f64,
    /// Status of the estimate: `good`, `degraded` or `lost`.
    pub status: Option<String>,
    /// Run time and counts of the simulation.
    pub simulation: SimulationMetrics,
    /// The open-loop estimate.
    pub open_loop: OpenLoopMetrics,
    /// The closed-loop estimate.
    pub closed_loop: ClosedLoopMetrics,
    /// The estimated clock offset between IMU and lidar.
    pub clock: ClockMetrics,
    /// Estimated corrections of the lidar calibration.
    pub lidar: LidarMetrics,
    /// Sensor models that the estimator used, and their sources.
    pub sensors: SensorMetrics,
    /// The registered cloud.
    pub cloud: CloudMetrics,
    /// Error bounds and causes of the status.
    pub integrity: IntegrityMetrics,
    /// Missing or unused measurements, and intervals without an estimate.
    pub losses: Vec<EventMetrics>,
    /// Other information for the user.
    pub notes: Vec<EventMetrics>,
    /// Peak resident memory of the process, MiB.
    pub peak_rss_mib: Option<f64>,
}

/// Run time and counts of the simulation.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimulationMetrics {
    /// Wall-clock time, including writing the recording, s.
    pub wall_s: Option<f64>,
    /// Emitted beams.
    pub beams: Option<u64>,
    /// Returns.
    pub returns: Option<u64>,
    /// Rays cast for these beams.
    pub rays: Option<u64>,
    /// Time of the physics thread, in parallel with the ray casting, s.
    pub physics_wall_s: Option<f64>,
    /// Time of the ray casting, in parallel with the physics, s.
    pub rays_wall_s: Option<f64>,
}

/// The open-loop estimate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpenLoopMetrics {
    /// Wall-clock time of the estimator, including reading the recording, s.
    pub wall_s: Option<f64>,
    /// Wall-clock time divided by the length of the recording.
    pub fraction_of_acquisition: Option<f64>,
    /// Number of fixed views (keyframes) in the estimator.
    pub fixed_views: Option<u64>,
    /// RMS position error after rigid alignment, m.
    pub position_rmse_m: Option<f64>,
    /// RMS rotation error after rigid alignment, degrees.
    pub rotation_rmse_deg: Option<f64>,
    /// Position drift, m/min.
    pub drift_m_per_min: Option<f64>,
    /// Yaw drift, degrees/min.
    pub yaw_drift_deg_per_min: Option<f64>,
    /// Position error at the end of the run, aligned at the start, m.
    pub end_error_m: Option<f64>,
    /// RMS relative position error over one minute, m.
    pub relative_error_per_minute_m: Option<f64>,
    /// Position drift of IMU dead reckoning without lidar, m/min.
    pub imu_only_drift_m_per_min: Option<f64>,
    /// Mean normalised estimation error squared of the position; 3 for a consistent covariance.
    pub position_nees: Option<f64>,
    /// Mean normalised estimation error squared of the attitude; 3 for a consistent covariance.
    pub attitude_nees: Option<f64>,
}

/// The closed-loop estimate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClosedLoopMetrics {
    /// Wall-clock time of the global registration, s.
    pub wall_s: Option<f64>,
    /// Wall-clock time divided by the length of the recording.
    pub fraction_of_acquisition: Option<f64>,
    /// RMS position error after rigid alignment, m.
    pub position_rmse_m: Option<f64>,
    /// RMS rotation error after rigid alignment, degrees.
    pub rotation_rmse_deg: Option<f64>,
    /// Cramer-Rao bound of the RMS position error after alignment, m.
    pub bound_rmse_m: Option<f64>,
    /// Mean normalised estimation error squared of the position; 3 for a consistent covariance.
    pub position_nees: Option<f64>,
    /// Mean normalised estimation error squared of the attitude; 3 for a consistent covariance.
    pub attitude_nees: Option<f64>,
    /// Loop closures.
    pub loops: LoopMetrics,
    /// Reason why the loop closure was not applied; `None` if it was.
    pub left: Option<String>,
}

/// Loop closures: revisited places that the open loop has beyond the matching distance.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopMetrics {
    /// Pairs of views proposed by place recognition.
    pub proposed: Option<u64>,
    /// Proposed pairs whose surfaces match.
    pub verified: Option<u64>,
    /// Verified pairs that constrain the trajectory.
    pub closed: Option<u64>,
}

/// The estimated clock offset: IMU stamp minus lidar stamp of the same time.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClockMetrics {
    /// Estimated offset at the end of the run, s.
    pub offset_end_s: Option<f64>,
    /// RMS error of the offset over the run, s.
    pub offset_rmse_s: Option<f64>,
    /// Estimated minus true offset at the end of the run, s.
    pub offset_end_error_s: Option<f64>,
    /// Absolute error of the offset 30 s after the first estimate, s.
    pub error_after_30s_s: Option<f64>,
    /// The same after 120 s.
    pub error_after_120s_s: Option<f64>,
}

/// Estimated corrections of the lidar calibration at the end of the run, along the IMU axes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LidarMetrics {
    /// Estimated range correction, added to each range, m; `None` if it was not estimated.
    pub range_correction_m: Option<f64>,
    /// Estimated rotation of the lidar about its origin, rotation vector, degrees; `None` if it was not estimated.
    pub rotation_correction_deg: Option<[f64; 3]>,
    /// Estimated translation of the lidar, m; `None` if it was not estimated.
    pub translation_correction_m: Option<[f64; 3]>,
}

/// The registered cloud and its distances to the true surfaces.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CloudMetrics {
    /// Projected returns, including those that the filter removed.
    pub points: Option<u64>,
    /// Description of the returns that the distances include.
    pub judged: Option<String>,
    /// Mean signed distance to the true surfaces, positive on the side of the lidar, m.
    pub bias_m: Option<f64>,
    /// Standard deviation of the signed distance, m.
    pub sigma_m: Option<f64>,
    /// 95th percentile of the distance, m.
    pub p95_m: Option<f64>,
    /// Fraction of points more than 1 m from any surface; the distances exclude them.
    pub far_fraction: Option<f64>,
    /// Fraction of beams that hit the carrier of the lidar; the distances exclude them, the cloud includes them.
    pub on_carrier_fraction: Option<f64>,
    /// Fraction of beams that hit moving objects of the scene; the distances exclude them.
    pub on_movers_fraction: Option<f64>,
    /// Standard deviation of the signed distance with the beams projected by the true trajectory, m.
    pub sigma_by_truth_m: Option<f64>,
    /// Result of the outlier filter.
    pub filter: FilterMetrics,
}

/// Result of the outlier filter of the cloud; `None` throughout if the filter is off.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilterMetrics {
    /// Points in the cloud files.
    pub kept: Option<u64>,
    /// Removed mixed pixels: returns from two surfaces in one beam.
    pub dropped_mixed: Option<u64>,
    /// Removed isolated points: returns with few neighbours.
    pub dropped_isolated: Option<u64>,
    /// Removed returns from moving objects.
    pub dropped_moving: Option<u64>,
    /// Standard deviation of the signed distance of the points in the cloud files that are on static surfaces, m: those of
    /// `sigma_m` that the filter keeps.
    pub kept_static_sigma_m: Option<f64>,
    /// The same of all points in the cloud files, also of those on the carrier and on moving objects that the filter keeps, m.
    pub kept_all_sigma_m: Option<f64>,
    /// Fraction of the returns from static surfaces that the filter removed by mistake.
    pub standing_dropped_fraction: Option<f64>,
    /// Fraction of the returns from moving objects that the filter removed.
    pub movers_dropped_fraction: Option<f64>,
}

impl Metrics {
    /// Returns the text of `metrics.json`.
    ///
    /// # Errors
    /// When a metric cannot be written as JSON.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

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

    /// Keys in the order of the file; each group precedes its keys.
    const KEYS: &[&str] = &[
        "version",
        "scene",
        "seed",
        "duration_s",
        "status",
        "simulation",
        "wall_s",
        "beams",
        "returns",
        "rays",
        "physics_wall_s",
        "rays_wall_s",
        "open_loop",
        "wall_s",
        "fraction_of_acquisition",
        "fixed_views",
        "position_rmse_m",
        "rotation_rmse_deg",
        "drift_m_per_min",
        "yaw_drift_deg_per_min",
        "end_error_m",
        "imu_only_drift_m_per_min",
        "position_nees",
        "attitude_nees",
        "closed_loop",
        "wall_s",
        "fraction_of_acquisition",
        "position_rmse_m",
        "rotation_rmse_deg",
        "bound_rmse_m",
        "position_nees",
        "attitude_nees",
        "loops",
        "proposed",
        "verified",
        "closed",
        "left",
        "clock",
        "offset_end_s",
        "offset_rmse_s",
        "offset_end_error_s",
        "lidar",
        "range_correction_m",
        "rotation_correction_deg",
        "translation_correction_m",
        "sensors",
        "imu_averaging",
        "imu_averaging_source",
        "noise",
        "cloud",
        "points",
        "judged",
        "bias_m",
        "sigma_m",
        "p95_m",
        "on_carrier_fraction",
        "on_movers_fraction",
        "sigma_by_truth_m",
        "filter",
        "kept",
        "dropped_mixed",
        "dropped_isolated",
        "dropped_moving",
        "kept_static_sigma_m",
        "kept_all_sigma_m",
        "standing_dropped_fraction",
        "movers_dropped_fraction",
        "integrity",
        "bound_m_99",
        "largest_bound_m",
        "since_s",
        "causes",
        "losses",
        "notes",
        "peak_rss_mib",
    ];

    #[test]
    fn the_file_has_all_keys_in_order() {
        let json = Metrics { scene: Some("office".to_owned()), seed: Some(1), ..Metrics::default() }.to_json().unwrap();
        let mut rest = json.as_str();
        for key in KEYS {
            let at = rest.find(&format!("\"{key}\":")).unwrap_or_else(|| panic!("{key} is missing in:\n{json}"));
            rest = &rest[at + key.len()..];
        }
        assert!(json.contains("\"bound_rmse_m\": null"));
        assert_eq!(serde_json::from_str::<Metrics>(&json).unwrap().seed, Some(1));
    }

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
