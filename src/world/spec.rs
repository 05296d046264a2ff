//! What a scene's file says. Data alone: [`World::build`](super::World::build) checks it as a whole and builds from it.

use super::{Placement, ShapeSpec};
use crate::spec::checked;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scene: what there is, what it is made of, what moves in it, and where one can walk. Lengths in metres, z up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// What to call it.
    pub name: String,
    /// Other scenes, by path or name, all of which is a part of this one.
    #[serde(default)]
    pub include: Vec<String>,
    /// The materials, by name.
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Groups of items that are placed as one, each in a frame of its own, by name.
    #[serde(default)]
    pub templates: BTreeMap<String, Vec<ItemSpec>>,
    /// What stands still.
    pub items: Vec<ItemSpec>,
    /// What moves.
    #[serde(default)]
    pub movers: Vec<MoverSpec>,
    /// Ways to walk, by name.
    #[serde(default)]
    pub routes: BTreeMap<String, RouteSpec>,
    /// The route that is walked unless another is asked for.
    #[serde(default)]
    pub default_route: Option<String>,
}

/// What a surface does with a laser's light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Fraction scattered back, 0 to 1.
    #[serde(with = "checked::Fraction")]
    pub reflectance: f64,
    /// Whether light goes through.
    #[serde(default)]
    pub kind: MaterialKind,
}

/// Whether light goes through a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum MaterialKind {
    /// Nothing goes through.
    #[default]
    Opaque,
    /// A part goes straight through.
    Glass {
        /// That part, 0 to 1.
        #[serde(with = "checked::Fraction")]
        transmission: f64,
    },
}

/// Something in a scene, once or at several places.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ItemSpec {
    /// A shape of one material.
    Solid {
        /// The shape.
        shape: ShapeSpec,
        /// The name of its material.
        material: String,
        /// Where it stands; at the origin unless told.
        #[serde(default = "Placement::at_origin")]
        at_m_deg: Vec<Placement>,
    },
    /// A template.
    Place {
        /// Its name.
        template: String,
        /// Where it stands; at the origin unless told.
        #[serde(default = "Placement::at_origin")]
        at_m_deg: Vec<Placement>,
    },
    /// A template at many places, drawn from a seed.
    Scatter(ScatterSpec),
}

/// Many copies of a template, thrown into a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScatterSpec {
    /// The template's name.
    pub template: String,
    /// The seed from which places and turns are drawn. It belongs to the scene: every run sees the same one.
    pub seed: u64,
    /// How many copies.
    pub count: usize,
    /// Two opposite corners of the region, m: the templates' origins lie between them.
    pub region_m: ([f64; 3], [f64; 3]),
    /// Smallest distance between two origins, m.
    #[serde(with = "checked::NonNegative")]
    pub min_spacing_m: f64,
    /// Smallest horizontal distance from an origin to any route, m.
    #[serde(default, with = "checked::NonNegative")]
    pub keep_from_routes_m: f64,
    /// How the copies are turned.
    pub turn: Turn,
}

/// How scattered copies are turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Turn {
    /// As the template stands.
    Fixed,
    /// By any angle about z.
    Upright,
    /// By any rotation.
    Any,
}

/// A template that moves along timed waypoints: a walking person, a swinging door.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MoverSpec {
    /// The template's name.
    pub template: String,
    /// Where it is and when, in order of time. Between two waypoints it moves steadily, turning the shorter way.
    pub waypoints: Vec<WaypointSpec>,
    /// Whether it starts again after the last waypoint; if not it stays there.
    pub repeats: bool,
}

/// Where a mover is at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaypointSpec {
    /// Time since the run's start, s.
    #[serde(with = "checked::Finite")]
    pub time_s: f64,
    /// Its pose then.
    pub at_m_deg: Placement,
}

/// A way to walk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RouteSpec {
    /// Whether it goes round, from the last point to the first.
    pub closed: bool,
    /// Its corners on the floor: x, y, z, m.
    pub points_m: Vec<[f64; 3]>,
}
