//! Divides the recording into nodes, submaps for place recognition.

use crate::observed::ObservedSurfels;
use crate::registration::corrected_trajectory::CorrectedTrajectory;
use crate::registration::submaps::divide;
use crate::surfel::Patch;
use std::ops::Range;
use zsim_base::geometry::Vector;

/// Quantile of the surfel heights that defines the height of the ground: a few surfels are lower, on floors below
/// stairwells or from outliers.
const GROUND_QUANTILE: f64 = 0.02;

/// A submap of a few seconds.
#[derive(Debug, Clone)]
pub(super) struct Node {
    /// Middle time, s.
    pub(super) tau_s: f64,
    /// Position of the head at that time in the map, m.
    pub(super) head: Vector,
    /// Height of the ground relative to the head, m (negative).
    pub(super) ground_m: f64,
    /// Range of the surfels in time order.
    members: Range<usize>,
}

/// All nodes and their surfels.
#[derive(Debug)]
pub(super) struct PlaceDatabase<'a> {
    observed: &'a ObservedSurfels,
    /// Indices of the observed surfels in time order.
    order: Vec<u32>,
    /// Duration of a node, s.
    pub(super) length_s: f64,
    pub(super) nodes: Vec<Node>,
}

impl<'a> PlaceDatabase<'a> {
    /// Divides the surfels of `observed` within the time of `corrected` into nodes of `length_s`.
    pub(super) fn new(observed: &'a ObservedSurfels, corrected: &CorrectedTrajectory, length_s: f64) -> Self {
        let (start_s, end_s) = corrected.span_s();
        let tau_s = |k: &u32| observed.surfels[*k as usize].tau_s;
        let mut order: Vec<u32> =
            (0..observed.len() as u32).filter(|k| (start_s..=end_s).contains(&tau_s(k))).collect();
        order.sort_by(|a, b| tau_s(a).total_cmp(&tau_s(b)));
        let times_s: Vec<f64> = order.iter().map(tau_s).collect();
        let node = |members: Range<usize>| {
            let tau_s = 0.5 * (times_s[members.start] + times_s[members.end - 1]);
            let head = corrected.pose_at(tau_s).translation.vector;
            let mut heights: Vec<f64> = order[members.clone()]
                .iter()
                .map(|k| &observed.surfels[*k as usize].patch)
                .filter(|patch| patch.level == 0)
                .map(|patch| patch.centre.z - head.z)
                .collect();
            heights.sort_by(f64::total_cmp);
            let ground_m = heights.get((heights.len() as f64 * GROUND_QUANTILE) as usize).copied().unwrap_or(0.0);
            Node { tau_s, head, ground_m, members }
        };
        let nodes = divide(&times_s, length_s).into_iter().map(node).collect();
        Self { observed, order, length_s, nodes }
    }

    /// Surfels of `level` of a node, relative to the head, in map axes.
    pub(super) fn patches(&self, node: usize, level: usize) -> impl Iterator<Item = Patch> + '_ {
        let Node { head, members, .. } = self.nodes[node].clone();
        let patches = self.order[members].iter().map(|k| self.observed.surfels[*k as usize].patch);
        patches
            .filter(move |patch| patch.level == level)
            .map(move |patch| Patch { centre: patch.centre - head, ..patch })
    }
}
