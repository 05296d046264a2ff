use crate::time::Stamp;

/// A point of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Where it is, m, in the map.
    pub point_in_map: nalgebra::Vector3<f32>,
    /// Strength of the echo, in the sensor's unit.
    pub intensity: f32,
    /// When its beam was fired, on the lidar's clock.
    pub stamp: Stamp,
    /// Standard deviation of its place, m: the root of the mean square of its distance from its true place; NaN where
    /// that is not known.
    pub error_m: f32,
}
