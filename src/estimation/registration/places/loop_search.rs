//! Search for loop closures between nodes.

use super::alignment::{ALIGNED_LEVELS, Alignment, Fit, NodeSurfels, agreement, align};
use super::database::PlaceDatabase;
use super::scan_context::{self, Context};
use super::{LoopReport, MATCHING_REACH, RelativePose};
use crate::PlacesSpec;
use crate::correlation::{self, Region};
use crate::matching::Matcher;
use rayon::prelude::*;
use zsim_base::geometry::{Pose, Rotation, Vector};

/// Maximum distance of two views of one node, m: up to it the descriptors stay similar.
const MAX_VIEW_DISTANCE_M: f64 = 3.0;
/// Region of the start alignments: translations up to the distance of two views of one node and headings up to 9 degrees, more than
/// one sector of the descriptor, among the surfaces within the range of the descriptor; a few for each pair.
const START_ALIGNMENTS: Region = Region {
    grid_m: (20.0, f64::INFINITY),
    search_m: (MAX_VIEW_DISTANCE_M, 0.0),
    headings: (-2, 2),
    up: (1, 0),
    candidates: (3, 3),
};
/// Alignments that differ by less than this, m and rad, are equal.
const SAME_ALIGNMENT: (f64, f64) = (0.5, 0.1);
/// The best alignment is ambiguous if a different one has more than this fraction of the agreement.
const MAX_SECOND_RATIO: f64 = 0.8;
/// Minimum number of matches for a link between successive nodes.
const MIN_LINK_MATCHES: usize = 30;

/// Selects the loops to search for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LoopFilter {
    /// All loops, including those that the trajectory already satisfies.
    All,
    /// Only loops of nodes without any candidate that agrees at the current pose.
    OutOfReach,
}

/// Two nodes: indices into the database.
#[derive(Debug, Clone, Copy)]
struct NodePair {
    late: usize,
    early: usize,
}

/// A pair of similar nodes.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    nodes: NodePair,
    yaw: f64,
    distance: f64,
}

/// Result of the candidates of one node.
#[derive(Debug, Clone, Copy, Default)]
struct NodeSearch {
    /// Number of candidates that were registered.
    registered: usize,
    found: Option<RelativePose>,
}

/// Searches the node database for loop closures.
pub(super) struct LoopSearch<'a> {
    pub(super) database: PlaceDatabase<'a>,
    pub(super) matcher: &'a Matcher,
    pub(super) spec: &'a PlacesSpec,
}

impl LoopSearch<'_> {
    /// Verified loops in time order, with statistics.
    pub(super) fn loops(&self, filter: LoopFilter) -> (Vec<RelativePose>, LoopReport) {
        let outcomes: Vec<NodeSearch> =
            self.candidates().into_par_iter().map(|of_node| self.test_candidates(&of_node, filter)).collect();
        let loops: Vec<RelativePose> = outcomes.iter().filter_map(|outcome| outcome.found).collect();
        let proposed = outcomes.iter().map(|outcome| outcome.registered).sum();
        let report = LoopReport { proposed, verified: loops.len(), closed: 0 };
        (loops, report)
    }

    /// For each node the most similar earlier nodes, most similar first.
    fn candidates(&self) -> Vec<Vec<Candidate>> {
        let nodes = &self.database.nodes;
        let context = |node: usize| Context::from_patches(self.database.patches(node, 0), nodes[node].ground_m);
        let contexts: Vec<Context> = (0..nodes.len()).into_par_iter().map(context).collect();
        // Neighbours in time are similar, too, and excluded below: request as many more.
        let in_time = 2 * (self.spec.min_apart_s / self.database.length_s).ceil() as usize;
        let near = scan_context::nearest_by_key(&contexts, self.spec.candidates + in_time);
        let of_node = |late: usize| {
            let to_candidate = |early: &usize| {
                let similarity = contexts[late].compare(&contexts[*early])?;
                let nodes = NodePair { late, early: *early };
                let candidate = Candidate { nodes, yaw: similarity.yaw, distance: similarity.distance };
                Some(candidate).filter(|candidate| self.is_possible(candidate))
            };
            let earlier = near[late].iter().filter(|early| **early < late);
            let mut candidates: Vec<Candidate> = earlier.filter_map(to_candidate).collect();
            candidates.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            candidates.truncate(self.spec.tries);
            candidates
        };
        (0..nodes.len()).into_par_iter().map(of_node).collect()
    }

    /// Whether similarity, time difference and drift of a candidate are within the limits.
    fn is_possible(&self, candidate: &Candidate) -> bool {
        let NodePair { late, early } = candidate.nodes;
        let (late, early) = (&self.database.nodes[late], &self.database.nodes[early]);
        let (max_drift_m, max_heading_error) = self.max_drift(candidate.nodes);
        late.tau_s - early.tau_s >= self.spec.min_apart_s
            && candidate.distance < self.spec.max_distance
            && (late.head - early.head).norm() < MAX_VIEW_DISTANCE_M + max_drift_m
            && candidate.yaw.abs() < max_heading_error
    }

    /// Maximum drift of the open loop between two times, m and rad.
    fn max_drift(&self, NodePair { late, early }: NodePair) -> (f64, f64) {
        let minutes = (self.database.nodes[late].tau_s - self.database.nodes[early].tau_s) / 60.0;
        let spec = self.spec;
        let turn_deg = spec.max_turn_deg + spec.max_turn_deg_per_min * minutes;
        (spec.max_drift_m + spec.max_drift_m_per_min * minutes, turn_deg.to_radians())
    }

    /// Registers the candidates of one node; returns the first verified loop.
    ///
    /// With `OutOfReach` it returns no loop if any candidate already agrees at the current pose.
    fn test_candidates(&self, candidates: &[Candidate], filter: LoopFilter) -> NodeSearch {
        let mut outcome = NodeSearch::default();
        let Some(first) = candidates.first() else { return outcome };
        let late = self.surfels(first.nodes.late);
        for Candidate { nodes, yaw, .. } in candidates {
            let early = self.surfels(nodes.early);
            let now = self.current_alignment(*nodes);
            let agrees = self.agreement(&late, &early, &now).is_some_and(|ratio| ratio >= self.spec.min_agreement);
            if agrees && filter == LoopFilter::OutOfReach {
                return NodeSearch { found: None, ..outcome };
            }
            outcome.registered += 1;
            let Some(fit) = self.verify(&late, &early, *nodes, *yaw) else { continue };
            let (shift_m, turn) = fit.alignment.difference(&now);
            if shift_m < MATCHING_REACH.0 && turn < MATCHING_REACH.1 && filter == LoopFilter::OutOfReach {
                return NodeSearch { found: None, ..outcome };
            }
            let (max_drift_m, max_heading_error) = self.max_drift(*nodes);
            if shift_m < max_drift_m && turn < max_heading_error {
                outcome.found = outcome.found.or(Some(self.relative_pose(*nodes, &fit)));
            }
        }
        outcome
    }

    /// Registers two nodes; `None` if the agreement is insufficient or ambiguous.
    fn verify(&self, late: &NodeSurfels, early: &NodeSurfels, nodes: NodePair, yaw: f64) -> Option<Fit> {
        let ground_m = |node: usize| self.database.nodes[node].ground_m;
        let up = Vector::z() * (ground_m(nodes.early) - ground_m(nodes.late));
        let here = Pose::from_parts(up.into(), Rotation::from_scaled_axis(Vector::z() * yaw));
        let (early_surfaces, late_surfaces) = (early.finest(), late.finest());
        let found = correlation::candidates(early_surfaces, late_surfaces, &Vector::zeros(), &here, START_ALIGNMENTS);
        let mut starts: Vec<Alignment> =
            found.into_iter().map(|by| Alignment { yaw: yaw + by.yaw, shift: up + by.shift }).collect();
        starts.push(self.current_alignment(nodes));
        let register = |start: &Alignment| {
            let fit = align(late, early, start, self.matcher)?;
            Some((self.agreement(late, early, &fit.alignment)?, fit))
        };
        let fits: Vec<(f64, Fit)> = starts.iter().filter_map(register).collect();
        let (best, fit) = *fits.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let is_other = |other: &Fit| {
            let (shift_m, turn) = other.alignment.difference(&fit.alignment);
            shift_m > SAME_ALIGNMENT.0 || turn > SAME_ALIGNMENT.1
        };
        let next = fits.iter().filter(|(_, other)| is_other(other)).map(|(ratio, _)| *ratio).fold(0.0, f64::max);
        (best >= self.spec.min_agreement && next < MAX_SECOND_RATIO * best).then_some(fit)
    }

    /// Relative poses of successive nodes with enough common surfaces.
    ///
    /// Along a weak direction the pose of the trajectory remains: along a corridor the registered one slips from door to door.
    pub(super) fn links(&self) -> Vec<RelativePose> {
        let link = |early: usize| {
            let nodes = NodePair { late: early + 1, early };
            let alignment = self.current_alignment(nodes);
            let fit = align(&self.surfels(nodes.late), &self.surfels(nodes.early), &alignment, self.matcher)?;
            (fit.matches >= MIN_LINK_MATCHES)
                .then(|| self.relative_pose(nodes, &fit.held_along_weak_directions(&alignment)))
        };
        (0..self.database.nodes.len().saturating_sub(1)).into_par_iter().filter_map(link).collect()
    }

    fn relative_pose(&self, NodePair { late, early }: NodePair, fit: &Fit) -> RelativePose {
        let time_s = |node: usize| self.database.nodes[node].tau_s;
        let times_s = (time_s(late), time_s(early));
        RelativePose { times_s, alignment: fit.alignment, information: fit.information }
    }

    fn surfels(&self, node: usize) -> NodeSurfels {
        let levels = 0..ALIGNED_LEVELS.min(self.matcher.levels);
        NodeSurfels::new(levels.map(|level| self.database.patches(node, level).collect()).collect(), self.matcher)
    }

    fn current_alignment(&self, NodePair { late, early }: NodePair) -> Alignment {
        let head = |node: usize| self.database.nodes[node].head;
        Alignment { yaw: 0.0, shift: head(late) - head(early) }
    }

    fn agreement(&self, late: &NodeSurfels, early: &NodeSurfels, alignment: &Alignment) -> Option<f64> {
        agreement(late, early, alignment, self.matcher)
    }
}
