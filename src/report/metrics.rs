//! The figures of a run: `metrics.json`.

use super::{EventMetrics, IntegrityMetrics};
use serde::{Deserialize, Serialize};

/// All figures of a run, in SI units but for angles, in degrees. `None` (`null` in the file) is what is not known:
/// there was no truth, or the capability is not there.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Metrics {
    /// Version of zsim.
    pub version: String,
    /// Name of the scene; of a recording by others none.
    pub scene: Option<String>,
    /// Seed of the run.
    pub seed: Option<u64>,
    /// Length of the recording, s.
    pub duration_s: f64,
    /// The verdict on the estimate: `good`, `degraded`, `lost`.
    pub status: Option<String>,
    /// The simulation.
    pub simulation: SimulationMetrics,
    /// The open loop.
    pub open_loop: OpenLoopMetrics,
    /// The closed loop.
    pub closed_loop: ClosedLoopMetrics,
    /// The clock offset.
    pub clock: ClockMetrics,
    /// What was learnt of the lidar.
    pub lidar: LidarMetrics,
    /// The cloud.
    pub cloud: CloudMetrics,
    /// What the verdict rests on.
    pub integrity: IntegrityMetrics,
    /// What of the recording is missing or was not used, and stretches without an estimate.
    pub losses: Vec<EventMetrics>,
    /// What a user should know besides.
    pub notes: Vec<EventMetrics>,
    /// Most memory that the process ever had, MiB.
    pub peak_rss_mib: Option<f64>,
}

/// What the simulation took.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimulationMetrics {
    /// Time it took, recording included, s.
    pub wall_s: Option<f64>,
    /// Beams fired.
    pub beams: Option<u64>,
    /// Echoes reported.
    pub returns: Option<u64>,
    /// Rays cast for the beams.
    pub rays: Option<u64>,
    /// Time on physics, in parallel to the rest, s.
    pub physics_wall_s: Option<f64>,
    /// Time on rays, in parallel to the rest, s.
    pub rays_wall_s: Option<f64>,
}

/// The open-loop estimate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpenLoopMetrics {
    /// Time the estimator took, reading included, s.
    pub wall_s: Option<f64>,
    /// That time over the recording's length.
    pub fraction_of_acquisition: Option<f64>,
    /// How many fixed views it kept.
    pub fixed_views: Option<u64>,
    /// Position error after rigid alignment, root mean square, m.
    pub position_rmse_m: Option<f64>,
    /// Angle of the rotation error after rigid alignment, root mean square, degrees.
    pub rotation_rmse_deg: Option<f64>,
    /// Drift of the position, m/min.
    pub drift_m_per_min: Option<f64>,
    /// Drift about the vertical, degrees/min.
    pub yaw_drift_deg_per_min: Option<f64>,
    /// Position error at the end, with the start aligned, m.
    pub end_error_m: Option<f64>,
    /// Error of the way made within a minute, root mean square, m.
    pub relative_error_per_minute_m: Option<f64>,
    /// Drift of the raw IMU integrated alone, m/min.
    pub imu_only_drift_m_per_min: Option<f64>,
    /// Error of the position squared, over its covariance: 3 on average where the covariance is right.
    pub position_nees: Option<f64>,
    /// The same of the attitude.
    pub attitude_nees: Option<f64>,
}

/// The closed-loop estimate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClosedLoopMetrics {
    /// Time the global registration took, s.
    pub wall_s: Option<f64>,
    /// That time over the recording's length.
    pub fraction_of_acquisition: Option<f64>,
    /// Position error after rigid alignment, root mean square, m.
    pub position_rmse_m: Option<f64>,
    /// Angle of the rotation error after rigid alignment, root mean square, degrees.
    pub rotation_rmse_deg: Option<f64>,
    /// The information bound on the position error, m.
    pub bound_rmse_m: Option<f64>,
    /// Places recognised.
    pub loops: LoopMetrics,
    /// Why the open loop is told as the closed one, where the registration was not believed.
    pub left: Option<String>,
}

/// Places that were seen twice, where the open loop had them out of the matches' reach.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopMetrics {
    /// Pairs that look alike.
    pub proposed: Option<u64>,
    /// Of those, verified by their surfaces.
    pub verified: Option<u64>,
    /// Pairs that the trajectory was bent to.
    pub closed: Option<u64>,
}

/// The estimated offset between the clocks.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClockMetrics {
    /// By how much the IMU stamps an instant later than the lidar at the end, as estimated, s.
    pub offset_end_s: Option<f64>,
    /// Error over the whole run, root mean square, s.
    pub offset_rmse_s: Option<f64>,
    /// Estimated minus true offset at the end, s.
    pub offset_end_error_s: Option<f64>,
}

/// By how much the lidar is not what its calibration says, along the IMU's axes, as the estimator has it at the end.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LidarMetrics {
    /// To be added to every range, m.
    pub range_correction_m: Option<f64>,
    /// Turn of the lidar about its own place, as a rotation vector, degrees; nothing where it was not estimated.
    pub rotation_correction_deg: Option<[f64; 3]>,
    /// Shift of its place, m.
    pub translation_correction_m: Option<[f64; 3]>,
}

/// The registered cloud.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CloudMetrics {
    /// Echoes that were projected, those included that the filter dropped.
    pub points: Option<u64>,
    /// Of which of them the figures of distance are, in words.
    pub judged: Option<String>,
    /// Mean signed distance to the true surfaces, positive in front of them, m.
    pub bias_m: Option<f64>,
    /// Standard deviation of the signed distance, m.
    pub sigma_m: Option<f64>,
    /// 95 % of the points are no farther from a surface, m.
    pub p95_m: Option<f64>,
    /// Share of the points more than a metre from any surface, which are in none of the figures of distance.
    pub far_fraction: Option<f64>,
    /// Share of the beams that truly ended on what carries the lidar. They are in the cloud, and in none of the figures
    /// of distance, as none of them is of a surface that stands.
    pub on_carrier_fraction: Option<f64>,
    /// Share of the beams that truly ended on what moves through the scene; left out likewise.
    pub on_movers_fraction: Option<f64>,
    /// Standard deviation for the same beams, projected by the true trajectory, m.
    pub sigma_by_truth_m: Option<f64>,
    /// What was kept of them.
    pub filter: FilterMetrics,
}

/// What the filter made of the cloud; nothing where it was not asked.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilterMetrics {
    /// Points in the cloud's files.
    pub kept: Option<u64>,
    /// Echoes of two surfaces at once, left out.
    pub dropped_mixed: Option<u64>,
    /// Echoes with next to nothing beside them, left out.
    pub dropped_isolated: Option<u64>,
    /// Echoes of what moved, left out.
    pub dropped_moving: Option<u64>,
    /// As `sigma_m` of the cloud, of those echoes of what stands that were kept, m.
    pub kept_sigma_m: Option<f64>,
    /// Share of the echoes of what stands that were left out.
    pub standing_dropped_fraction: Option<f64>,
    /// Share of the echoes of what moves that were left out.
    pub movers_dropped_fraction: Option<f64>,
}

impl Metrics {
    /// As the text of `metrics.json`.
    ///
    /// # Errors
    /// When a figure cannot be written as JSON.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In the file's order; groups before their keys.
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
        "kept_sigma_m",
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
    fn the_file_has_the_keys_that_scripts_read_in_their_order() {
        let json = Metrics { scene: Some("office".to_owned()), seed: Some(1), ..Metrics::default() }.to_json().unwrap();
        let mut rest = json.as_str();
        for key in KEYS {
            let at = rest.find(&format!("\"{key}\":")).unwrap_or_else(|| panic!("{key} is missing in:\n{json}"));
            rest = &rest[at + key.len()..];
        }
        assert!(json.contains("\"bound_rmse_m\": null"));
        assert_eq!(serde_json::from_str::<Metrics>(&json).unwrap().seed, Some(1));
    }
}
