//! A cloud before and after its points' times are converted.

use zsim_base::measurement::{LidarReturn, LidarScan};
use zsim_base::time::Stamp;

/// Returns of a cloud with their times as the driver wrote them.
#[derive(Debug, Default)]
pub struct RawCloud {
    /// Stamp of the cloud.
    pub stamp: Stamp,
    /// Returns without times.
    pub returns: Vec<LidarReturn>,
    /// Time of each return; empty if the points have no times.
    pub times: Vec<f64>,
    /// Number of the name of the time field.
    pub source: usize,
    /// Whether the times are too short for times since 1970.
    pub is_short: bool,
}

/// Scan, and the number of returns that were dropped.
#[derive(Debug)]
pub struct TimedScan {
    /// The scan with the remaining returns.
    pub scan: LidarScan,
    /// Returns dropped because their time is impossible.
    pub impossible_times: u64,
}
