use crate::time::{Span, Stamp};

/// Returns of one revolution (or frame) of a lidar.
#[derive(Debug, Clone, PartialEq)]
pub struct LidarScan {
    /// Time at which the first beam with a return was fired, on the lidar's clock.
    pub stamp: Stamp,
    /// Sensor's own stamp minus `stamp`; zero if the sensor stamps the start.
    ///
    /// The sensor's own stamps are evenly spaced; the first beam with a return is not.
    pub stamped_after: Span,
    /// Returns in firing order.
    pub returns: Vec<LidarReturn>,
    /// The scan in polar form, beams without a return included; only for a planar lidar.
    pub planar: Option<PlanarScan>,
}

/// A lidar return.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarReturn {
    /// Firing time after the scan's stamp.
    pub offset: Span,
    /// Point hit, in the lidar's frame, m.
    pub point_in_laser: nalgebra::Vector3<f32>,
    /// Echo intensity in the sensor's own unit; 0 if the sensor does not report it.
    pub intensity: f32,
}

/// One planar sweep in the conventions of `sensor_msgs/LaserScan` (REP-103, REP-117).
///
/// Beam `k` points at `angle_min + k increment`, counter-clockwise about z of the lidar's frame, and is fired at `stamp
/// + k time_increment`.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarScan {
    /// Angle of beam 0 from the x axis, rad.
    pub angle_min_rad: f64,
    /// Angle between beams, rad.
    pub angle_increment_rad: f64,
    /// Time between beams, s.
    pub time_increment_s: f64,
    /// Time between scans, s.
    pub scan_time_s: f64,
    /// Minimum range that the sensor reports, m.
    pub range_min_m: f32,
    /// Maximum range that the sensor reports, m.
    pub range_max_m: f32,
    /// Range of each beam, m; `+inf` without a return, `-inf` below the minimum range.
    pub ranges_m: Vec<f32>,
    /// Intensity of each beam, or empty.
    pub intensities: Vec<f32>,
}
