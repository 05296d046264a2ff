use serde::{Deserialize, Serialize};

/// How places are recognised where the open loop has drifted out of the matches' reach.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlacesSpec {
    /// Whether they are.
    pub recognised: bool,
    /// Length of the trajectory in a place, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub length_s: f64,
    /// Places are compared that are at least so far apart in time, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub min_apart_s: f64,
    /// So many of a place's nearest by key are compared with it by their whole context.
    pub candidates: usize,
    /// Of those, so many of the most alike are laid upon it.
    pub tries: usize,
    /// Greatest distance of two contexts, 0..1.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub max_distance: f64,
    /// What the open loop may have drifted at any time, m, and further in every minute, m/min.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub max_drift_m: f64,
    /// m/min.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub max_drift_m_per_min: f64,
    /// Likewise of its heading, degrees.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub max_turn_deg: f64,
    /// Degrees/min.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub max_turn_deg_per_min: f64,
    /// Least share of a place's surfaces that lie on the other's, of those that face any one direction, 0..1.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub min_agreement: f64,
    /// Within this along their normals, m.
    #[serde(with = "crate::spec::checked::Positive")]
    pub max_plane_distance_m: f64,
    /// Fewest loops that are believed, together.
    pub min_loops: usize,
}
