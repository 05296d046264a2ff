use serde::{Deserialize, Serialize};

/// Loop closure by place recognition, for drift beyond the matching distance: nodes of the length of a window are compared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(default)]
pub struct PlacesSpec {
    /// Enables loop closure.
    pub recognised: bool,
    /// Minimum time between two nodes of a loop closure, s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub min_apart_s: f64,
    /// Number of nearest neighbours by ring key that are compared by their full Scan Context descriptor, per node.
    pub candidates: usize,
    /// Number of most similar candidates that are registered, per node.
    pub tries: usize,
    /// Maximum Scan Context distance of a candidate, 0 (equal) to 1.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub max_distance: f64,
    /// Maximum drift of the open-loop position independent of time, m; larger loop closures are rejected.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub max_drift_m: f64,
    /// Additional maximum drift of the position per minute, m/min.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub max_drift_m_per_min: f64,
    /// Maximum drift of the open-loop heading independent of time, degrees.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub max_turn_deg: f64,
    /// Additional maximum drift of the heading per minute, degrees/min.
    #[serde(with = "zsim_base::spec::checked::NonNegative")]
    pub max_turn_deg_per_min: f64,
    /// Minimum fraction of the surfaces facing each direction that agree with the other node, 0..1.
    #[serde(with = "zsim_base::spec::checked::Fraction")]
    pub min_agreement: f64,
    /// Minimum number of consistent loop closures; with fewer, none is applied.
    pub min_loops: usize,
}
