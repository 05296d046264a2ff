use zsim_base::time::Stamp;

/// Point of a point cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Position in the map, m.
    pub point_in_map: nalgebra::Vector3<f32>,
    /// Echo intensity, in the sensor's unit.
    pub intensity: f32,
    /// Firing time of the beam, on the lidar's clock.
    pub stamp: Stamp,
    /// Standard deviation of the position, m: root mean square distance from the true position; NaN if unknown.
    pub error_m: f32,
}
