//! The trajectory that an estimate results in.

use super::comparison::Comparison;
use zsim_base::geometry::{PoseCovariance, Trajectory};
use zsim_base::measurement::LidarCorrection;
use zsim_base::time::Stamp;

/// The estimate for cloud, result and plots: the closed loop if it was computed, else the open loop.
pub(super) struct BestEstimate<'a> {
    pub map_from_head: &'a Trajectory,
    /// Covariances at some of its stamps.
    pub covariances: &'a [(Stamp, PoseCovariance)],
    /// The open-loop trajectory in which the surfels were observed.
    pub observed_trajectory: &'a Trajectory,
    /// Estimated correction of the lidar calibration.
    pub lidar: &'a LidarCorrection,
    /// Comparison with the truth, if it is known.
    pub comparison: Option<&'a Comparison>,
}
