//! The data of the pages with a view.

use crate::Metrics;
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
#[derive(Default)]
pub struct View {
    /// Points of the registered cloud, in order of time.
    pub points: Vec<ViewPoint>,
    /// Names of the materials that [`ViewPoint::material`] refers to.
    pub materials: Vec<String>,
    /// Estimated poses of the head.
    pub estimate: Vec<TimedPose>,
    /// True poses of the head; empty without truth.
    pub truth: Vec<TimedPose>,
    /// True poses of the base; empty without truth.
    pub base: Vec<TimedPose>,
    /// Corners of the triangles of the true surfaces; empty if the scene is not known.
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

/// A block parallel to the axes of the head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Centre in the head, m.
    pub centre_in_head: Vector,
    /// Edge lengths, m.
    pub size_m: Vector,
}

/// A point of the cloud with the quantities that can colour it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewPoint {
    /// Position, m.
    pub position: Vector,
    /// Time, s.
    pub t_s: f64,
    /// Intensity of the return, in the unit of the lidar.
    pub intensity: f64,
    /// Angular velocity of the head, degrees/s.
    pub turn_rate_deg_per_s: f64,
    /// Estimated standard deviation of the position, m; NaN if it is not known.
    pub sigma_m: f64,
    /// Signed distance from the nearest true surface, positive towards the lidar, m; NaN if it is not known.
    pub error_m: f64,
    /// Index of the material of the nearest true surface.
    pub material: Option<usize>,
}

/// A pose with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPose {
    /// Time, s.
    pub t_s: f64,
    /// The pose in the frame of the view.
    pub pose: Pose,
}

/// An elastic element between base and head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Link {
    /// A helical spring.
    Spring {
        /// Pose of the foot in the base; z points along the spring.
        base_from_foot: Pose,
        /// Pose of the top in the head.
        head_from_top: Pose,
        /// Mean radius of the coil, m.
        coil_radius_m: f64,
        /// Diameter of the wire, m.
        wire_diameter_m: f64,
        /// Number of coils.
        coils: f64,
    },
    /// A straight line: a rope, a cable, or the link from a joint to the head.
    Straight {
        /// Attachment point in the base, m.
        point_in_base: Vector,
        /// Attachment point in the head, m.
        point_in_head: Vector,
    },
}

/// Head and linkage to scale, with the modes.
pub struct SpringView {
    /// Parts of the head.
    pub parts: Vec<Block>,
    /// Springs and cords between base and head.
    pub links: Vec<Link>,
    /// Pose of the head in the base.
    pub base_from_head: Pose,
    /// Centre of mass in the base, m: the modes displace it, and rotate the head about it.
    pub centre_in_base: Vector,
    /// What the pose is, and what the drawing assumes.
    pub note: String,
    /// The modes, slowest first; empty without a rest pose.
    pub modes: Vec<ShownMode>,
    /// The shake of the base with which the amplitudes are compared, in words.
    pub shake: String,
}

/// A mode of the view.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownMode {
    /// Name, such as "rocking about y".
    pub name: String,
    /// Undamped frequency, Hz.
    pub frequency_hz: f64,
    /// Frequency and damping in words.
    pub details: String,
    /// Displacement of the centre of mass (m) and rotation (rad) at the amplitude 1, in the axes of the base.
    pub shape: [f64; 6],
    /// Amplitude in the response to the shake.
    pub shaken: f64,
}

/// Section of the page that a chart belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// Gain, phase and coherence of the axis with this name.
    Axis(&'static str),
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
}

/// Charts of which the page shows one at a time.
pub struct ChartGroup {
    /// Section of the page.
    pub section: Section,
    /// The charts; the reader chooses between them if there are several.
    pub charts: Vec<Chart>,
}

/// A chart over time or frequency.
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
    pub x: Vec<f64>,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// Quantity of an abscissa.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    /// Time, s.
    Time,
    /// Frequency, Hz, on a logarithmic scale.
    Frequency,
}

/// Scale of an ordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordinate {
    /// Linear.
    Linear,
    /// Logarithmic; only positive values are shown.
    Logarithmic,
    /// Linear, with ticks at parts of a turn.
    Degrees,
}

/// A curve of a chart.
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Appearance.
    pub style: CurveStyle,
    /// A value for each abscissa of the chart; not finite where there is none.
    pub values: Vec<f64>,
}

/// Appearance of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

/// An event.
pub struct Interval {
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Message.
    pub sentence: String,
}
