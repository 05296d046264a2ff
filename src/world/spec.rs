//! Data of a scene file. [`World::build`](super::World::build) checks and builds it.

use super::{Placement, ShapeSpec};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use zsim_base::spec::checked;

/// A scene: materials, static items, movers, and routes to walk. Lengths in metres, z up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Name of the scene; that of the file by default.
    #[serde(default)]
    pub name: String,
    /// Other scenes to include, by path or name. All their parts become part of this scene.
    #[serde(default)]
    pub include: Vec<String>,
    /// The materials, by name.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Groups of items that are placed together, each in its own frame, by name.
    #[serde(default)]
    pub templates: BTreeMap<String, Vec<ItemSpec>>,
    /// Static items.
    #[serde(default)]
    pub items: Vec<ItemSpec>,
    /// Movers: templates that move along waypoints.
    #[serde(default)]
    pub movers: Vec<MoverSpec>,
    /// Plants that sway in the wind.
    #[serde(default)]
    pub swaying: Vec<SwaySpec>,
    /// Canopies: volumes of leaves or blades that are finer than a laser beam.
    #[serde(default)]
    pub canopies: Vec<CanopySpec>,
    /// Routes to walk, by name.
    #[serde(default)]
    pub routes: BTreeMap<String, RouteSpec>,
    /// The route that a run follows by default; a scene with one route does not need it.
    #[serde(default)]
    pub default_route: Option<String>,
}

/// Optical properties of a material at the laser wavelength.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Fraction of light scattered back, 0 to 1. A lower value reduces the maximum range.
    #[serde(with = "checked::Fraction")]
    pub reflectance: f64,
    /// Whether the material transmits light. Default: opaque.
    #[serde(default)]
    pub kind: MaterialKind,
}

/// Whether a material transmits light.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum MaterialKind {
    /// No transmission.
    #[default]
    Opaque,
    /// Part of the light passes straight through.
    Glass {
        /// Fraction transmitted, 0 to 1.
        #[serde(with = "checked::Fraction")]
        transmission: f64,
    },
}

/// An item of a scene, at one or several poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ItemSpec {
    /// A shape of one material.
    Solid {
        /// The shape.
        shape: ShapeSpec,
        /// Name of the material.
        material: String,
        /// Poses. Default: the origin.
        #[serde(default = "Placement::at_origin")]
        at_m_deg: Vec<Placement>,
    },
    /// A template at one or several poses.
    Place {
        /// Name of the template.
        template: String,
        /// Poses. Default: the origin.
        #[serde(default = "Placement::at_origin")]
        at_m_deg: Vec<Placement>,
    },
    /// A template at many random poses.
    Scatter(ScatterSpec),
}

/// Many copies of a template at random poses in a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScatterSpec {
    /// Name of the template.
    pub template: String,
    /// Random seed of the poses. It belongs to the scene, so all runs have the same poses.
    #[serde(default = "crate::usual::seed")]
    pub seed: u64,
    /// Number of copies.
    pub count: usize,
    /// Two opposite corners of the region for the origins of the copies, m.
    pub region_m: ([f64; 3], [f64; 3]),
    /// Minimum distance between the origins of two copies, m.
    #[serde(default, with = "checked::NonNegative")]
    pub min_spacing_m: f64,
    /// Minimum horizontal distance of an origin from any route, m. Default: 0.
    #[serde(default, with = "checked::NonNegative")]
    pub keep_from_routes_m: f64,
    /// Random rotation of the copies.
    #[serde(default)]
    pub turn: Turn,
}

/// Random rotation of scattered copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Turn {
    /// No rotation.
    Fixed,
    /// About z by a random angle.
    #[default]
    Upright,
    /// Any rotation, uniformly distributed.
    Any,
}

/// A template that moves along timed waypoints: a walking person, a swinging door.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MoverSpec {
    /// Name of the template.
    pub template: String,
    /// Waypoints in order of time. The mover is interpolated linearly between them and rotates through the smaller
    /// angle.
    pub waypoints: Vec<WaypointSpec>,
    /// If true, the waypoints repeat; if false, the mover stays at the last one.
    #[serde(default = "crate::usual::repeats")]
    pub repeats: bool,
}

/// Pose of a mover at a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaypointSpec {
    /// Time since the start of the run, s.
    #[serde(with = "checked::Finite")]
    pub time_s: f64,
    /// Pose at that time.
    pub at_m_deg: Placement,
}

/// Scattered copies of a template that sway about their feet.
///
/// A copy is rigid. At time t it is tilted towards the wind's direction by
/// `lean_deg + amplitude_deg sin(2 pi frequency_hz (t - s / gust_speed_m_per_s))`, with s the position of its foot along the
/// wind: waves travel over a meadow with the gusts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SwaySpec {
    /// Poses at rest.
    pub scatter: ScatterSpec,
    /// Direction in which the wind blows, from x towards y, degrees.
    #[serde(with = "checked::Finite")]
    pub wind_deg: f64,
    /// Mean tilt, degrees.
    #[serde(with = "checked::NonNegative")]
    pub lean_deg: f64,
    /// Amplitude of the sway, degrees.
    #[serde(with = "checked::NonNegative")]
    pub amplitude_deg: f64,
    /// Frequency of the sway, Hz.
    #[serde(with = "checked::Positive")]
    pub frequency_hz: f64,
    /// Speed at which gusts travel over the plants, m/s.
    #[serde(with = "checked::Positive")]
    pub gust_speed_m_per_s: f64,
}

/// A box filled with leaves or blades that are finer than a laser beam.
///
/// A ray is stopped in it at a random depth: it passes a length d with probability exp(-k d) (Beer and Lambert). The leaves
/// have no preferred direction. With the errors of a lidar switched off, beams pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanopySpec {
    /// Extents along x, y, z, m; the box is centred on the origin in x and y, from z = 0 upward.
    #[serde(with = "checked::LengthArray::<3>")]
    pub size_m: [f64; 3],
    /// Extinction coefficient k, 1/m: half the leaf area per volume, for leaves without preferred direction.
    #[serde(with = "checked::Positive")]
    pub extinction_per_m: f64,
    /// Name of the material.
    pub material: String,
    /// Poses. Default: the origin.
    #[serde(default = "Placement::at_origin")]
    pub at_m_deg: Vec<Placement>,
}

/// A route to walk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RouteSpec {
    /// Whether the last point is connected to the first.
    #[serde(default)]
    pub closed: bool,
    /// Points on the floor: x, y, z, m.
    pub points_m: Vec<[f64; 3]>,
}
