//! The results of a run, of which the measures are figures.

use crate::coverage::Coverage;
use crate::spring::DesignMetrics;
use zsim_estimation::Status;
use zsim_report::Metrics;

/// The results of a run, as far as the measures of its study need them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Results {
    /// The results of an estimate, as in its `metrics.json`.
    pub metrics: Metrics,
    /// Position error of the base computed with the rigid link, m.
    pub rigid_link_rmse_m: Option<f64>,
    /// Information bound with an unknown map, m.
    pub slam_bound_m: Option<f64>,
    /// Comparison of the cloud with that of the reference system.
    pub reference: ReferenceResults,
    /// The swing of the head without rays.
    pub swing: Option<Swing>,
    /// The closed form of the head.
    pub head: Option<DesignMetrics>,
    /// Peak gain of a gain measurement.
    pub peak_gain: Option<f64>,
}

/// Comparison of a cloud with that of the reference system; m.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ReferenceResults {
    /// Standard deviation of the distance along the normals.
    pub sigma_m: Option<f64>,
    /// Mean of the same distance.
    pub bias_m: Option<f64>,
    /// Position error of the reference system.
    pub rmse_m: Option<f64>,
}

/// The swing of the head without rays.
#[derive(Debug, Clone)]
pub(crate) struct Swing {
    /// Coverage of the lidar and use of the gyroscope's range.
    pub coverage: Coverage,
    /// Time in which coils touch, s.
    pub coil_contact_s: f64,
}

impl Results {
    /// The status as a number: 0 good, 1 degraded, 2 lost.
    pub(super) fn status(&self) -> Option<f64> {
        let name = self.metrics.status.as_deref()?;
        let status = [Status::Good, Status::Degraded, Status::Lost].into_iter().find(|status| status.name() == name)?;
        Some(f64::from(status as u8))
    }
}
