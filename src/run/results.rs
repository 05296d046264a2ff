//! The results of a run, of which the measures are figures.

use zsim_estimation::Status;
use zsim_head::coverage::Coverage;
use zsim_head::spring::DesignMetrics;
use zsim_report::Metrics;

/// What must be computed for a figure of the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// The closed form of the linearised head, or a gain measurement.
    Head,
    /// The simulated swing of the head without ray casting.
    Swing,
    /// The swing in a journey, else the closed form.
    SwingOrHead,
    /// The open loop, from a recording.
    OpenLoop,
    /// The open loop, with the clock offset over time as detail of the run.
    ClockCurve,
    /// The closed loop, from a recording.
    ClosedLoop,
    /// The closed loop, and the information bound of the recording.
    SlamBound,
    /// An estimate whose cloud is compared with the true surfaces.
    Cloud,
    /// The same, and a second estimate from the recording of a reference system.
    Reference,
    /// A run with timing errors.
    Timing,
    /// The computing time of the open loop.
    OpenLoopTime,
    /// The computing time of the closed loop.
    ClosedLoopTime,
    /// The computing time of the run.
    WallClock,
}

impl Needs {
    /// Whether it is a computing time, which differs from run to run.
    pub fn is_time(self) -> bool {
        matches!(self, Self::OpenLoopTime | Self::ClosedLoopTime | Self::WallClock)
    }

    /// Whether it needs loop closure.
    pub fn is_of_closed_loop(self) -> bool {
        matches!(self, Self::ClosedLoop | Self::SlamBound | Self::ClosedLoopTime)
    }

    /// Whether a head on its spring has it in closed form.
    pub fn has_closed_form(self) -> bool {
        matches!(self, Self::Head | Self::SwingOrHead)
    }

    /// Whether it needs an estimate from a recording.
    pub fn is_of_estimate(self) -> bool {
        !matches!(self, Self::Head | Self::Swing | Self::SwingOrHead | Self::WallClock)
    }
}

/// The results of a run, as far as the measures of its study need them.
#[derive(Debug, Clone, Default)]
pub struct Results {
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
pub struct ReferenceResults {
    /// Standard deviation of the distance along the normals.
    pub sigma_m: Option<f64>,
    /// Mean of the same distance.
    pub bias_m: Option<f64>,
    /// Position error of the reference system.
    pub rmse_m: Option<f64>,
}

/// The swing of the head without rays.
#[derive(Debug, Clone)]
pub struct Swing {
    /// Coverage of the lidar and use of the gyroscope's range.
    pub coverage: Coverage,
    /// Time in which coils touch, s.
    pub coil_contact_s: f64,
}

impl Results {
    /// The status as a number: 0 good, 1 degraded, 2 lost.
    pub fn status(&self) -> Option<f64> {
        let name = self.metrics.status.as_deref()?;
        let status = [Status::Good, Status::Degraded, Status::Lost].into_iter().find(|status| status.name() == name)?;
        Some(f64::from(status as u8))
    }
}
