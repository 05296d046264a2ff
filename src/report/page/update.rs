//! Updates of the page of a run that is not complete, as JSON.

use super::encode::{TimedPose, path};
use super::html;
use super::quantise::{positions, times};
use crate::{Metrics, rows};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::{Value, json};
use zsim_base::geometry::{Pose, Vector};

/// Half the edge of the volume around the first pose if the scene is not known, m: coordinates have steps of 10 mm.
const HALF_EDGE_M: f64 = 327.675;
/// Margin around a known scene for points of an estimate that has drifted, m.
const MARGIN_M: f64 = 10.0;
/// Time step of the codes, s: 16 bits are 43 minutes, and later points have the last code.
const TIME_STEP_S: f64 = 0.04;

/// The volume whose points the page can show: coordinates are quantised in it to 16 bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// Lower corner, m.
    pub lower: Vector,
    /// Upper corner, m.
    pub upper: Vector,
}

impl Default for Volume {
    fn default() -> Self {
        let half_edge = Vector::repeat(HALF_EDGE_M);
        Self { lower: -half_edge, upper: half_edge }
    }
}

impl Volume {
    /// The volume around a scene with these bounds, m.
    pub fn around(lower: Vector, upper: Vector) -> Self {
        Self { lower: lower.add_scalar(-MARGIN_M), upper: upper.add_scalar(MARGIN_M) }
    }

    /// Whether a point is in the volume; a point that is not finite is not.
    pub fn contains(&self, point: &Vector) -> bool {
        (0..3).all(|k| (self.lower[k]..=self.upper[k]).contains(&point[k]))
    }

    /// Duration that the codes of times cover, s.
    pub(super) fn duration_s() -> f64 {
        TIME_STEP_S * f64::from(u16::MAX)
    }
}

/// A point of the map so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LivePoint {
    /// Position in the frame of the view, m.
    pub position: Vector,
    /// Time since the first measurement, s.
    pub t_s: f64,
}

/// True poses of head and base at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruePoses {
    /// Time since the first measurement, s.
    pub t_s: f64,
    /// Pose `world_from_head`.
    pub head: Pose,
    /// Pose `world_from_base`.
    pub base: Pose,
}

/// The points of one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveScan {
    /// Time since the first measurement, s.
    pub t_s: f64,
    /// Positions in the frame of the view, m.
    pub points: Vec<Vector>,
}

/// Items of a sequence that grows on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Increment<'a, T> {
    /// Number of the sequence: one with another number replaces that on the page.
    pub restart: u64,
    /// Index of the first item in the sequence.
    pub first: usize,
    /// The items.
    pub items: &'a [T],
}

/// The verdict, so far or final.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveVerdict {
    /// Status: `good`, `degraded` or `lost`.
    pub status: String,
    /// The reason.
    pub reason: String,
}

impl LiveVerdict {
    /// The final verdict of a run; `None` without an estimate.
    pub fn of(metrics: &Metrics) -> Option<Self> {
        let (verdict, status) = (rows::verdict(metrics)?, metrics.status.clone()?);
        let reason = html::reason(&verdict, &status).to_owned();
        Some(Self { status, reason })
    }
}

/// The end of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveEnd {
    /// What happened.
    pub sentence: String,
    /// Path of the report on this machine, as text; `None` if there is none.
    pub report: Option<String>,
}

/// What has changed since the last request of a page.
pub struct LiveUpdate<'a> {
    /// Version of the state that the page has after this update.
    pub version: u64,
    /// Name of the stage.
    pub stage: &'a str,
    /// Completed fraction of the stage; `None` if it is not known.
    pub fraction: Option<f64>,
    /// Processed data, s.
    pub done_s: f64,
    /// Points of the map.
    pub points: Increment<'a, LivePoint>,
    /// Estimated poses.
    pub estimate: Increment<'a, TimedPose>,
    /// True poses.
    pub truth: Increment<'a, TruePoses>,
    /// Scans since the last request; old ones may be missing.
    pub scans: Vec<&'a LiveScan>,
    /// Number of the scan after these.
    pub next_scan: u64,
    /// The verdict; `None` before the estimate.
    pub verdict: Option<&'a LiveVerdict>,
    /// Events and notes, the newest last.
    pub events: &'a [String],
    /// The end of the run; `None` while it runs.
    pub end: Option<&'a LiveEnd>,
}

impl LiveUpdate<'_> {
    /// The update as JSON, with binary arrays in base64; points and scans are quantised in `volume`.
    ///
    /// # Errors
    /// When a value cannot be written as JSON.
    pub fn json(&self, volume: &Volume) -> Result<String, serde_json::Error> {
        let poses = |of: fn(&TruePoses) -> Pose| {
            path(&self.truth.items.iter().map(|each| TimedPose { t_s: each.t_s, pose: of(each) }).collect::<Vec<_>>())
        };
        serde_json::to_string(&json!({
            "version": self.version,
            "stage": self.stage,
            "fraction": self.fraction,
            "done": self.done_s,
            "points": self.points.json(points(self.points.items, volume)),
            "estimate": self.estimate.json(json!({ "path": path(self.estimate.items) })),
            "truth": self.truth.json(json!({ "head": poses(|each| each.head), "base": poses(|each| each.base) })),
            "scans": self.scans.iter().map(|scan| scan.json(volume)).collect::<Vec<_>>(),
            "nextScan": self.next_scan,
            "verdict": self.verdict,
            "events": self.events,
            "end": self.end,
        }))
    }
}

impl<T> Increment<'_, T> {
    /// The increment with its arrays, an object.
    fn json(&self, mut arrays: Value) -> Value {
        arrays["restart"] = json!(self.restart);
        arrays["first"] = json!(self.first);
        arrays["count"] = json!(self.items.len());
        arrays
    }
}

impl LiveScan {
    fn json(&self, volume: &Volume) -> Value {
        let position = positions(self.points.iter().copied(), volume.lower, volume.upper);
        json!({ "t": self.t_s, "position": STANDARD.encode(&position) })
    }
}

fn points(points: &[LivePoint], volume: &Volume) -> Value {
    let position = positions(points.iter().map(|point| point.position), volume.lower, volume.upper);
    let time = times(points.iter().map(|point| point.t_s), Volume::duration_s());
    json!({ "position": STANDARD.encode(&position), "time": STANDARD.encode(&time) })
}
