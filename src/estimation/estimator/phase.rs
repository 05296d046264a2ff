//! The phases of the estimator: without and with a window.

use super::sensed::SensedMotion;
use crate::coasting::Coasting;
use crate::consider::Sensitivity;
use crate::initial::StateBeforeGap;
use crate::intake::Segment;
use crate::localisation::GapRelocalisation;
use crate::strapdown::Interval;
use crate::surfel::TimedReturn;
use crate::window::Window;
use std::collections::VecDeque;
use zsim_base::time::Stamp;

/// The phase of the estimator; an IMU gap or a long lidar gap leads from tracking back to gathering.
#[derive(Debug)]
pub(super) enum Phase {
    /// No window: collects segments until they suffice to distinguish rest from motion.
    Gathering(Gathering),
    /// A window that each segment extends.
    Tracking(Box<Tracking>),
}

/// The segments received before the first window, at the start or after a gap.
#[derive(Debug, Default)]
pub(super) struct Gathering {
    pub(super) segments: Vec<Segment>,
    /// What is known from before the gap; none at the start.
    pub(super) recovery: Option<Box<GapRecovery>>,
}

/// The window, with what refers to it only.
#[derive(Debug)]
pub(super) struct Tracking {
    pub(super) window: Window,
    /// Segments that the window does not contain yet.
    pub(super) waiting: VecDeque<Segment>,
    /// What is known from before a gap, until the window is full.
    pub(super) recovery: Option<Box<GapRecovery>>,
    /// Sensitivity of the end of the window to the errors at its start.
    pub(super) at_end: Option<Sensitivity>,
    /// The motion without views, for the registration.
    pub(super) sensed: SensedMotion,
    /// Stamp of the next pose; none before the first pose of the window.
    pub(super) next_pose: Option<Stamp>,
    /// Whether the start of the window was wrong, so that the window is discarded.
    pub(super) is_rejected: bool,
}

/// What is known from before a gap.
#[derive(Debug)]
pub(super) struct GapRecovery {
    /// The state at the start of the gap.
    pub(super) before: StateBeforeGap,
    /// Pending relocalisation in the surfaces seen before the gap; none in a given map.
    pub(super) relocalisation: Option<GapRelocalisation>,
    /// The IMU data of a lidar gap; none after a gap of the IMU.
    pub(super) coasting: Option<Coasting>,
    /// The segments since the gap, with which the window can start again, later.
    pub(super) segments: Vec<Segment>,
    /// Number of windows up to the gap.
    pub(super) windows: usize,
    /// How often the window started again.
    pub(super) restarts: usize,
}

impl GapRecovery {
    /// Recovery from a gap after `windows` windows.
    pub(super) fn new(before: StateBeforeGap, relocalisation: Option<GapRelocalisation>, windows: usize) -> Self {
        Self { before, relocalisation, coasting: None, segments: Vec::new(), windows, restarts: 0 }
    }
}

impl Default for Phase {
    fn default() -> Self {
        Self::Gathering(Gathering::default())
    }
}

impl Phase {
    /// What is known from before a gap, if anything.
    pub(super) fn recovery(&self) -> Option<&GapRecovery> {
        match self {
            Self::Gathering(gathering) => gathering.recovery.as_deref(),
            Self::Tracking(tracking) => tracking.recovery.as_deref(),
        }
    }

    /// Whether a relocalisation in the surfaces seen before a gap is pending.
    pub(super) fn awaits_relocalisation(&self) -> bool {
        self.recovery().is_some_and(|recovery| recovery.relocalisation.is_some())
    }

    /// Adds a segment that is processed with the window, as soon as it exists.
    pub(super) fn queue(&mut self, segment: Segment) {
        match self {
            Self::Gathering(gathering) => gathering.segments.push(segment),
            Self::Tracking(tracking) => tracking.waiting.push_back(segment),
        }
    }
}

impl Gathering {
    /// The IMU intervals of all segments.
    pub(super) fn intervals(&self) -> Vec<Interval> {
        self.segments.iter().flat_map(|segment| &segment.intervals).map(|(_, interval)| *interval).collect()
    }

    /// The beams of all segments, in order of time.
    pub(super) fn returns(&self) -> Vec<TimedReturn> {
        self.segments.iter().flat_map(|segment| &segment.returns).copied().collect()
    }

    /// Start of the first IMU interval, IMU time, s.
    pub(super) fn start_s(&self) -> Option<f64> {
        self.segments.first()?.intervals.first().map(|(start_s, _)| *start_s)
    }
}
