use crate::time::{Span, Stamp};

/// The beams of one turn (or frame) of a lidar that came back.
#[derive(Debug, Clone, PartialEq)]
pub struct LidarScan {
    /// When the first beam was fired, on the lidar's clock.
    pub stamp: Stamp,
    /// How much later than that the sensor's own stamp is, which comes at an even pace where the first beam that came
    /// back does not: zero of a sensor that stamps the start.
    pub stamped_after: Span,
    /// The beams that came back, in the order in which they were fired.
    pub returns: Vec<LidarReturn>,
    /// The scan in polar form, with the beams that did not come back, for a lidar that scans a plane.
    pub planar: Option<PlanarScan>,
}

/// A beam that came back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarReturn {
    /// When it was fired, after the scan's stamp.
    pub offset: Span,
    /// Where it hit, in the lidar's frame, m.
    pub point_in_laser: nalgebra::Vector3<f32>,
    /// Strength of the echo, in the sensor's own unit; 0 where the sensor does not say.
    pub intensity: f32,
}

/// One sweep in a plane, as `sensor_msgs/LaserScan` has it (REP-103, REP-117): beam `k` at `angle_min + k increment`,
/// counter-clockwise about z of the lidar's frame, fired at `stamp + k time_increment`.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarScan {
    /// Angle of beam 0 from x, rad.
    pub angle_min_rad: f64,
    /// Angle between beams, rad.
    pub angle_increment_rad: f64,
    /// Time between beams, s.
    pub time_increment_s: f64,
    /// Time between scans, s.
    pub scan_time_s: f64,
    /// Least range the sensor reports, m.
    pub range_min_m: f32,
    /// Greatest range the sensor reports, m.
    pub range_max_m: f32,
    /// A range a beam, m; `+inf` where nothing came back, `-inf` where it was too near.
    pub ranges_m: Vec<f32>,
    /// An intensity a beam, or empty.
    pub intensities: Vec<f32>,
}
