use serde::Serialize;

/// What a simulation did. Wall times are for people: they enter no data.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct SimulationSummary {
    /// Simulated time, s.
    pub duration_s: f64,
    /// Scans of the lidar.
    pub scans: u64,
    /// Beams fired.
    pub beams: u64,
    /// Echoes reported.
    pub returns: u64,
    /// Rays that stood for the beams; those that went on behind glass count once.
    pub rays: u64,
    /// Samples of the IMU.
    pub imu_samples: u64,
    /// Those of them with an axis at its limit.
    pub imu_samples_at_limit: u64,
    /// Time spent on physics, s; in parallel to the rest.
    pub physics_wall_s: f64,
    /// Time spent on rays and their echoes, s; in parallel to the rest.
    pub rays_wall_s: f64,
    /// Time the whole took, s.
    pub wall_s: f64,
}
