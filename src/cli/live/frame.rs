//! Data of a run as the live page needs it: copies, thinned where the run produces them.

use std::time::{Duration, Instant};
use zsim_base::geometry::{Pose, Vector};
use zsim_base::measurement::LidarScan;
use zsim_base::time::{Span, Stamp};
use zsim_estimation::{EstimatedPose, Event, Evidence, Status, findings};
use zsim_report::CauseMetrics;
use zsim_report::page::LiveVerdict;
use zsim_run::{RunEvent, Stage, StageData};

/// Maximum number of returns that are copied from a scan.
const MAX_RETURNS: usize = 128;
/// Time between copied poses: points are projected with poses interpolated between them.
const POSE_PERIOD: Span = Span::from_nanos(10_000_000);
/// Wall-clock time between verdicts: to compute one takes longer, the longer the run is.
const VERDICT_PERIOD: Duration = Duration::from_millis(500);
/// Maximum number of events that are shown.
const MAX_EVENTS: usize = 100;

/// A return of a scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Return {
    pub stamp: Stamp,
    pub point_in_laser: Vector,
}

/// A copy of data of a run.
#[derive(Debug)]
pub(super) enum Frame {
    /// A stage with data starts.
    Start { stage: Stage, head_from_laser: Pose },
    /// Progress of a stage.
    Progress { stage: Stage, fraction: Option<f64>, done_s: f64 },
    /// A message for the user.
    Note(String),
    /// True poses `world_from_head` and `world_from_base`.
    Truth { stamp: Stamp, head: Pose, base: Pose },
    /// Returns of a scan, in order of time.
    Scan(Vec<Return>),
    /// Estimated poses `map_from_head`.
    Poses(Vec<(Stamp, Pose)>),
    /// The verdict so far, and the newest warnings.
    Verdict { verdict: LiveVerdict, warnings: Vec<Event> },
}

impl Frame {
    /// Whether the page is still right without this frame, though it shows less.
    pub(super) fn is_dispensable(&self) -> bool {
        matches!(self, Self::Truth { .. } | Self::Scan(_) | Self::Progress { .. })
    }
}

/// Makes frames of the events of a run.
#[derive(Debug, Default)]
pub(super) struct Framer {
    last_truth: Option<Stamp>,
    last_verdict: Option<Instant>,
}

impl Framer {
    /// The frame of an event; `None` if the page does not need it.
    pub(super) fn frame(&mut self, event: &RunEvent) -> Option<Frame> {
        let data = match event {
            RunEvent::Progress { stage, fraction, done_s } => {
                return Some(Frame::Progress { stage: *stage, fraction: *fraction, done_s: *done_s });
            }
            RunEvent::Note(text) => return Some(Frame::Note((*text).to_owned())),
            RunEvent::Data(data) => data,
        };
        match data {
            StageData::Start { stage, calibration } => {
                Some(Frame::Start { stage: *stage, head_from_laser: calibration.head_from_laser })
            }
            StageData::Truth(sample) => {
                let stamp = sample.lidar_stamp;
                let is_due = self.last_truth.is_none_or(|last| stamp - last >= POSE_PERIOD);
                is_due.then(|| {
                    self.last_truth = Some(stamp);
                    Frame::Truth { stamp, head: sample.head.world_from_body, base: sample.base.world_from_body }
                })
            }
            StageData::Scan(scan) => Some(Frame::Scan(thinned(scan))),
            StageData::Poses(poses) => Some(Frame::Poses(spaced(poses))),
            StageData::Evidence(evidence) => self.verdict(evidence),
        }
    }

    fn verdict(&mut self, evidence: &Evidence) -> Option<Frame> {
        if self.last_verdict.is_some_and(|last| last.elapsed() < VERDICT_PERIOD) {
            return None;
        }
        self.last_verdict = Some(Instant::now());
        let newest = evidence.warnings.len().saturating_sub(MAX_EVENTS);
        let verdict = verdict(&findings(evidence), evidence.recorded.0);
        Some(Frame::Verdict { verdict, warnings: evidence.warnings[newest..].to_vec() })
    }
}

/// Returns the verdict of the most severe cause; times are relative to `start`.
pub(crate) fn verdict(causes: &[Event], start: Stamp) -> LiveVerdict {
    let Some(worst) = causes.iter().max_by_key(|cause| cause.severity) else {
        return LiveVerdict { status: Status::default().name().to_owned(), reason: "no problem so far".to_owned() };
    };
    let cause = CauseMetrics::new(worst, start);
    LiveVerdict { reason: cause.line() + " (so far)", status: cause.status }
}

fn thinned(scan: &LidarScan) -> Vec<Return> {
    let stride = scan.returns.len().div_ceil(MAX_RETURNS).max(1);
    let copy = |each: &zsim_base::measurement::LidarReturn| Return {
        stamp: scan.stamp + each.offset,
        point_in_laser: each.point_in_laser.cast(),
    };
    scan.returns.iter().step_by(stride).map(copy).collect()
}

fn spaced(poses: &[EstimatedPose]) -> Vec<(Stamp, Pose)> {
    let mut kept: Vec<(Stamp, Pose)> = Vec::with_capacity(poses.len());
    for pose in poses {
        if kept.last().is_none_or(|(last, _)| pose.stamp - *last >= POSE_PERIOD) {
            kept.push((pose.stamp, pose.map_from_head));
        }
    }
    kept
}
