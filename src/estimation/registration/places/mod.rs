//! Loop closure: place recognition and pose graph optimisation for drift beyond the matching distance.
//!
//! 1. The recording is divided into *nodes* of a few seconds. Gravity levels their surfels: the relative pose of two nodes
//!    is a heading and a translation.
//! 2. *Candidates* are pairs of nodes, separated in time, with similar Scan Context descriptors (`scan_context`) and a
//!    relative pose within the maximum drift of the open loop. A k-d tree returns a fixed number per node, so their number
//!    grows linearly with the recording.
//! 3. A pair that agrees at the open-loop pose needs no loop closure. This test is cheap, and all that runs without drift need.
//! 4. Other pairs are registered plane to plane from several starts (`crate::correlation`, `alignment`). A loop is *verified* if
//!    enough surfaces agree in every direction and no different alignment is nearly as good; this rejects repetitive surroundings.
//! 5. A pose graph (`pose_graph`) connects the verified loops with the relative poses of successive nodes. Loops that
//!    contradict these are removed as outliers. Drift also distorts the nodes, so the steps are repeated until convergence.
//!    The remaining loops that exceed the matching distance are *closed*; if there are too few, the open loop is kept.

mod alignment;
mod database;
mod loop_search;
mod pose_graph;
mod relative_pose;
mod scan_context;

pub use relative_pose::LoopReport;
use relative_pose::MATCHING_REACH;
pub(super) use relative_pose::RelativePose;

use super::corrected_trajectory::CorrectedTrajectory;
use super::trajectory_difference::largest_difference;
use crate::matching::Matcher;
use crate::observed::ObservedSurfels;
use crate::{EstimatorSpec, RegistrationSpec};
use database::PlaceDatabase;
use loop_search::{LoopFilter, LoopSearch};
use pose_graph::optimise;
use zsim_base::geometry::Trajectory;
use zsim_base::time::{Span, Stamp};

/// Open-loop drift that the pose graph assumes, a random walk in m/sqrt(s) and degrees/sqrt(s): large, so that the trajectory
/// can follow the loops.
const POSE_GRAPH_DRIFT: (f64, f64) = (0.1, 0.3);
/// Maximum number of passes of loop search and pose graph optimisation.
const MAX_PASSES: usize = 8;
/// The passes end when the trajectory moves by less than this, m.
const CONVERGED_M: f64 = 0.02;

/// A trajectory aligned to loop closures, within the convergence range of the matching.
pub(super) struct PreAligned {
    pub(super) trajectory: Trajectory,
    /// The observed surfels, moved with the trajectory.
    pub(super) observed: ObservedSurfels,
}

/// Detects loop closures and aligns the open-loop trajectory to them if it drifted beyond the matching distance.
///
/// Drift within a node distorts it and makes the measured drift too small; the alignment is repeated until convergence.
pub(super) fn close_loops(
    map_from_head: &Trajectory,
    observed: &ObservedSurfels,
    corrected: &CorrectedTrajectory,
    matcher: &Matcher,
    spec: &EstimatorSpec,
) -> (LoopReport, Option<PreAligned>) {
    let (nodes, length_s, spec) = (&spec.registration.places, spec.window_s, &spec.registration);
    if !nodes.recognised {
        return (LoopReport::default(), None);
    }
    let search = LoopSearch { database: PlaceDatabase::new(observed, corrected, length_s), matcher, spec: nodes };
    let (loops, report) = search.loops(LoopFilter::OutOfReach);
    if loops.len() < nodes.min_loops {
        return (report, None);
    }
    let (mut trajectory, mut observed) = (map_from_head.clone(), observed.clone());
    let mut closures = 0;
    for _ in 0..MAX_PASSES {
        let Some(corrected) =
            CorrectedTrajectory::new(&trajectory, &trajectory, &[], observed.origin, &with_pose_graph_drift(spec))
        else {
            break;
        };
        let mut corrected = corrected.with_gravity_from(map_from_head, &trajectory);
        let search = LoopSearch { database: PlaceDatabase::new(&observed, &corrected, length_s), matcher, spec: nodes };
        let ((loops, _), links) = (search.loops(LoopFilter::All), search.links());
        let level_sigma_rad = spec.level_sigma_deg.to_radians();
        let mut with_loops = corrected.clone();
        // Distorted nodes can make correct loops inconsistent: then optimise this pass without loops.
        let closed = match optimise(&mut with_loops, &loops, &links, level_sigma_rad) {
            Some(closed) => {
                corrected = with_loops;
                closed
            }
            None => match optimise(&mut corrected, &[], &links, level_sigma_rad) {
                Some(none) => none,
                None => return (report, None),
            },
        };
        let Ok(next) = corrected.into_trajectory(map_from_head.stamps()) else { return (report, None) };
        let (shift_m, _) = largest_difference(&trajectory, &next);
        (trajectory, observed) = (next.clone(), observed.along(&trajectory, &next));
        let was_out_of_reach = |(late_s, early_s): &&(f64, f64)| {
            is_out_of_reach(map_from_head, &trajectory, observed.origin, *late_s, *early_s)
        };
        closures = closed.iter().filter(was_out_of_reach).count();
        if shift_m < CONVERGED_M {
            break;
        }
    }
    if closures < nodes.min_loops {
        return (report, None);
    }
    (LoopReport { closed: closures, ..report }, Some(PreAligned { trajectory, observed }))
}

/// Whether the relative pose between two times, s from `origin`, differs by more than the matching distance.
fn is_out_of_reach(open_loop: &Trajectory, optimised: &Trajectory, origin: Stamp, late_s: f64, early_s: f64) -> bool {
    let between = |trajectory: &Trajectory| {
        let at = |tau_s: f64| trajectory.at(origin + Span::from_seconds(tau_s));
        Some(at(early_s)?.inverse() * at(late_s)?)
    };
    between(open_loop).zip(between(optimised)).is_some_and(|(before, now)| {
        let difference = now.translation.vector - before.translation.vector;
        difference.norm() > MATCHING_REACH.0 || before.rotation.angle_to(&now.rotation) > MATCHING_REACH.1
    })
}

/// Settings with the drift that the pose graph assumes.
fn with_pose_graph_drift(spec: &RegistrationSpec) -> RegistrationSpec {
    RegistrationSpec { drift_m_per_sqrt_s: POSE_GRAPH_DRIFT.0, turn_deg_per_sqrt_s: POSE_GRAPH_DRIFT.1, ..spec.clone() }
}
