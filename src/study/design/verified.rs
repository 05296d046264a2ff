//! Designs after their simulation.

use super::evaluation::Candidate;
use super::spec::CoilDesign;
use crate::sweep::Measure;
use serde::Serialize;
use std::collections::BTreeMap;
use zsim_head::spring::DesignMetrics;

/// A design of the Pareto set that a full simulation has verified: it is within all limits there too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerifiedDesign {
    /// The design.
    #[serde(flatten)]
    pub candidate: Candidate,
    /// Metrics by simulation.
    pub simulated: DesignMetrics,
    /// Metrics of the journeys, means over the seeds; empty without a journey.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub journey: BTreeMap<Measure, f64>,
    /// Limits that cannot be checked: the strength of the wire is not known, or a cable carries a part of the load.
    pub unchecked: Vec<&'static str>,
    /// Fraction of the sphere that the lidar covered.
    pub fraction_seen: f64,
    /// Fraction of the time in which the gyroscope was saturated.
    pub saturated: f64,
}

impl VerifiedDesign {
    /// The figure for goals: in closed form, or of the journeys; infinite if it is not known.
    pub fn cost_figure(&self, measure: Measure) -> f64 {
        self.journey.get(&measure).copied().unwrap_or_else(|| measure.cost_of_head(&self.candidate.figures))
    }
}

/// A design that is not within the limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rejection {
    /// The coil.
    pub coil: CoilDesign,
    /// Whether the simulation rejected it; otherwise the closed form did.
    pub simulated: bool,
    /// The limit with the largest violation, or another reason.
    pub limit: String,
    /// The value that violates the limit, if it is known.
    pub value: Option<f64>,
}

/// The result of simulations.
pub(super) struct Outcomes {
    /// The Pareto set of all goals, evenly distributed designs of it.
    pub candidates: Vec<VerifiedDesign>,
    /// Number of designs in the Pareto set.
    pub pareto: usize,
    pub rejections: Vec<Rejection>,
    /// Figures of the first two goals for each design within all limits.
    pub cloud: Vec<(f64, f64)>,
}
