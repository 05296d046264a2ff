//! The data of the pages with a view.

use super::encode::TimedPose;
use super::fields;
use super::quantise::ViewPoint;
use crate::Metrics;
use serde::Serialize;
use serde_json::{Value, json};
use zsim_base::geometry::{Pose, Vector};
use zsim_estimation::{PartTime, Severity};

/// The data of the page of a run. Times are in s since the first measurement.
pub struct RunPage<'a> {
    /// The metrics, as in `metrics.json`.
    pub metrics: &'a Metrics,
    /// Text of the manifest.
    pub manifest: &'a str,
    /// Run time of each part of the estimator.
    pub parts: Vec<PartTime>,
    /// The three-dimensional view.
    pub view: View,
    /// The charts, in groups.
    pub charts: Vec<ChartGroup>,
    /// The timeline of events.
    pub timeline: Vec<TimelineRow>,
}

/// The three-dimensional view. Positions are in the world frame, or in the map frame without truth.
#[derive(Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct View {
    /// Points of the registered cloud, in order of time.
    #[serde(rename = "cloud", serialize_with = "fields::cloud")]
    pub points: Vec<ViewPoint>,
    /// Names of the materials that [`ViewPoint::material`] refers to.
    pub materials: Vec<String>,
    /// Estimated poses of the head.
    #[serde(serialize_with = "fields::path")]
    pub estimate: Vec<TimedPose>,
    /// True poses of the head; empty without truth.
    #[serde(serialize_with = "fields::path")]
    pub truth: Vec<TimedPose>,
    /// True poses of the base; empty without truth.
    #[serde(serialize_with = "fields::path")]
    pub base: Vec<TimedPose>,
    /// Corners of the triangles of the true surfaces; empty if the scene is not known.
    #[serde(serialize_with = "fields::triangles")]
    pub surfaces: Vec<[Vector; 3]>,
    /// Index of the material of each triangle, for a view of the surfaces themselves; empty where they are the background.
    pub surface_materials: Vec<usize>,
    /// Whether small triangles are missing in `surfaces`.
    pub surfaces_are_partial: bool,
    /// Springs and cords between base and head.
    pub links: Vec<Link>,
    /// Parts of the head: blocks parallel to its axes.
    pub parts: Vec<Block>,
}

impl View {
    /// The data of the view without charts and timeline.
    pub(crate) fn json(&self) -> Value {
        let mut data = json!(self);
        (data["charts"], data["timeline"]) = (json!([]), json!([]));
        data
    }
}

/// A block parallel to the axes of the head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Block {
    /// Centre in the head, m.
    #[serde(rename = "centre")]
    pub centre_in_head: Vector,
    /// Edge lengths, m.
    #[serde(rename = "size")]
    pub size_m: Vector,
}

/// An elastic element between base and head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Link {
    /// A helical spring.
    Spring(CoilLink),
    /// A straight line: a rope, a cable, or the link from a joint to the head.
    Straight {
        /// Attachment point in the base, m.
        #[serde(rename = "from")]
        point_in_base: Vector,
        /// Attachment point in the head, m.
        #[serde(rename = "to")]
        point_in_head: Vector,
    },
}

/// A helical spring between base and head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CoilLink {
    /// Pose of the foot in the base; z points along the spring.
    #[serde(rename = "foot", serialize_with = "fields::pose")]
    pub base_from_foot: Pose,
    /// Pose of the top in the head.
    #[serde(rename = "top", serialize_with = "fields::pose")]
    pub head_from_top: Pose,
    /// Mean radius of the coil, m.
    #[serde(rename = "radius")]
    pub coil_radius_m: f64,
    /// Diameter of the wire, m.
    #[serde(rename = "wire")]
    pub wire_diameter_m: f64,
    /// Number of active coils.
    pub coils: f64,
    /// Whether the spring is specified by its stiffness, so that its coils are assumed.
    #[serde(skip)]
    pub is_assumed: bool,
}

/// Head and linkage to scale, with the modes.
#[derive(Serialize)]
pub struct SpringView {
    /// Parts of the head.
    pub parts: Vec<Block>,
    /// Springs and cords between base and head.
    pub links: Vec<Link>,
    /// Pose of the head in the base.
    #[serde(rename = "rest", serialize_with = "fields::pose")]
    pub base_from_head: Pose,
    /// Centre of mass in the base, m: the modes displace it, and rotate the head about it.
    #[serde(rename = "centre")]
    pub centre_in_base: Vector,
    /// What the pose is, and what the drawing assumes.
    #[serde(skip)]
    pub note: String,
    /// The modes, slowest first; empty without a rest pose.
    pub modes: Vec<ShownMode>,
    /// The shake of the base with which the amplitudes are compared, in words.
    #[serde(skip)]
    pub shake: String,
}

/// A mode of the view.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShownMode {
    /// Name, such as "rocking about y".
    #[serde(skip)]
    pub name: String,
    /// Undamped frequency, Hz.
    #[serde(rename = "frequency")]
    pub frequency_hz: f64,
    /// Frequency and damping in words.
    #[serde(skip)]
    pub details: String,
    /// Displacement of the centre of mass (m) and rotation (rad) at the amplitude 1, in the axes of the base.
    pub shape: [f64; 6],
    /// Amplitude in the response to the shake.
    pub shaken: f64,
}

/// Section of the page that a chart belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Section {
    /// Errors and their bounds.
    Errors,
    /// Offset between the clocks.
    Clock,
    /// Matches and conditioning.
    Matching,
    /// Run time of the estimator.
    Timing,
    /// Motion of the head.
    Motion,
    /// Gain, phase and coherence of the axis with this name.
    #[serde(untagged)]
    Axis(&'static str),
}

/// Charts of which the page shows one at a time.
#[derive(Serialize)]
pub struct ChartGroup {
    /// Section of the page.
    pub section: Section,
    /// The charts; the reader chooses between them if there are several.
    pub charts: Vec<Chart>,
}

/// A chart over time or frequency.
#[derive(Serialize)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Quantity and unit of the ordinate.
    pub label: String,
    /// Quantity of the abscissa.
    pub abscissa: Abscissa,
    /// Scale of the ordinate.
    pub ordinate: Ordinate,
    /// Abscissae in increasing order, s or Hz; frequencies are positive.
    #[serde(serialize_with = "fields::numbers")]
    pub x: Vec<f64>,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// Quantity of an abscissa.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Abscissa {
    /// Time, s.
    Time,
    /// Frequency, Hz, on a logarithmic scale.
    Frequency,
}

/// Scale of an ordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Ordinate {
    /// Linear.
    Linear,
    /// Logarithmic; only positive values are shown.
    Logarithmic,
    /// Linear, with ticks at parts of a turn.
    Degrees,
}

/// A curve of a chart.
#[derive(Serialize)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Appearance.
    pub style: CurveStyle,
    /// A value for each abscissa of the chart; not finite where there is none.
    #[serde(rename = "y", serialize_with = "fields::numbers")]
    pub values: Vec<f64>,
}

/// Appearance of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurveStyle {
    /// The estimate.
    Estimate,
    /// The truth, dashed.
    Truth,
    /// A second quantity.
    Second,
    /// An upper bound: the area below it is shaded.
    Bound,
    /// Upper edge of a band; the next curve is the lower edge.
    BandTop,
    /// Lower edge of a band.
    BandBottom,
    /// A theoretical limit, dotted.
    Limit,
    /// Measured points, as dots.
    Measured,
    /// A model of the measured points, in another colour.
    Model,
}

/// Events of one kind on the timeline.
pub struct TimelineRow {
    /// Kind of the events, in words.
    pub name: String,
    /// Severity of the events.
    pub severity: Severity,
    /// The events.
    pub events: Vec<Interval>,
}

impl TimelineRow {
    pub(super) fn json(&self) -> Value {
        let events = self.events.iter().map(|event| json!([event.from_s, event.to_s, event.sentence]));
        json!({ "name": self.name, "level": self.severity.name(), "events": events.collect::<Vec<_>>() })
    }
}

/// An event.
pub struct Interval {
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Message.
    pub sentence: String,
}
