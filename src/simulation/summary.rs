use serde::Serialize;
use zsim_dynamics::CoilContact;

/// Statistics of a simulation. Wall times are for information and are not part of the data.
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
    /// Rays cast for the beams. A ray that continues behind glass counts once.
    pub rays: u64,
    /// Samples of the IMU.
    pub imu_samples: u64,
    /// Samples of the IMU with a saturated axis.
    pub imu_samples_at_limit: u64,
    /// Contact of the coils of a spring; `None` if they did not touch.
    pub coil_contact: Option<CoilContact>,
    /// Wall time of the physics, s; in parallel with the rest.
    pub physics_wall_s: f64,
    /// Wall time of ray casting and echoes, s; in parallel with the rest.
    pub rays_wall_s: f64,
    /// Total wall time, s.
    pub wall_s: f64,
}
