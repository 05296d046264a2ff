//! Tree of frames from the transforms of a recording.

use crate::message::transforms::ReadTransform;
use crate::topics::shortened;
use std::collections::BTreeMap;
use zsim_base::geometry::Pose;

/// Maximum number of frames in a tree: bounds the memory.
const MAX_FRAMES: usize = 10_000;

/// Maximum number of problems that are listed.
const MAX_LISTED: usize = 8;

/// Minimum change of a transform that moves, m or rad: more than rounding to 32 bits.
const MOVING: f64 = 1e-4;

/// Transform of a frame to its parent.
#[derive(Debug, Clone)]
enum Edge {
    Rigid(Pose),
    /// Not a rigid transform, with the reason.
    Broken(String),
    /// Changes during the recording.
    Moving,
}

/// Tree of frames, each with a parent and the pose in it.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameTree {
    parents: BTreeMap<String, BTreeMap<String, Edge>>,
}

/// The frames above a frame, from itself on, each with the pose of the frame in it.
///
/// A problem ends the list before the root.
struct Ancestors<'a> {
    frames: Vec<(&'a str, Pose)>,
    problem: Option<String>,
    is_circle: bool,
}

impl FrameTree {
    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    /// Whether a transform names this frame.
    pub fn contains(&self, frame: &str) -> bool {
        self.parents.iter().any(|(child, parents)| child == frame || parents.contains_key(frame))
    }

    /// Lists the transforms, for messages.
    pub fn names(&self) -> String {
        let edges = self.parents.iter().flat_map(|(child, parents)| parents.keys().map(move |parent| (parent, child)));
        let mut list: Vec<_> =
            edges.map(|(parent, child)| format!("{} -> {}", shortened(parent), shortened(child))).collect();
        if list.len() > 2 * MAX_LISTED {
            let more = list.split_off(2 * MAX_LISTED).len();
            list.push(format!("and {more} more"));
        }
        list.join(", ")
    }

    /// Adds a static transform; it replaces an earlier one of the same two frames.
    pub fn add_static(&mut self, transform: ReadTransform) {
        let edge = transform.parent_from_child.map_or_else(|error| Edge::Broken(error.to_string()), Edge::Rigid);
        self.insert(transform.parent, transform.child, |_| edge);
    }

    /// Adds a transform that is repeated during the recording.
    pub fn add_repeated(&mut self, transform: ReadTransform) {
        let edge = transform.parent_from_child.map_or_else(|error| Edge::Broken(error.to_string()), Edge::Rigid);
        self.insert(transform.parent, transform.child, |earlier| match (earlier, edge) {
            (Some(Edge::Rigid(before)), Edge::Rigid(now)) if is_same(before, &now) => Edge::Rigid(*before),
            (Some(Edge::Rigid(_)), Edge::Rigid(_)) | (Some(Edge::Moving), _) => Edge::Moving,
            (_, edge) => edge,
        });
    }

    fn insert(&mut self, parent: String, child: String, edge: impl FnOnce(Option<&Edge>) -> Edge) {
        if self.parents.len() >= MAX_FRAMES && !self.parents.contains_key(&child) {
            return;
        }
        let parents = self.parents.entry(child).or_default();
        if parents.len() < MAX_LISTED || parents.contains_key(&parent) {
            let edge = edge(parents.get(&parent));
            parents.insert(parent, edge);
        }
    }

    /// Adds the transforms of `other` of frames that have no parent here.
    pub fn extend(&mut self, other: &Self) {
        for (child, parents) in &other.parents {
            self.parents.entry(child.clone()).or_insert_with(|| parents.clone());
        }
    }

    /// Computes `target_from_source`; `None` if the frames are not connected.
    ///
    /// # Errors
    /// When a transform between them is not usable: which, and why.
    pub fn target_from_source(&self, target: &str, source: &str) -> Result<Option<Pose>, String> {
        let (above_target, above_source) = (self.ancestors(target), self.ancestors(source));
        let circle = [&above_source, &above_target].into_iter().find(|above| above.is_circle);
        if let Some(problem) = circle.and_then(|above| above.problem.clone()) {
            return Err(problem);
        }
        for (frame, frame_from_source) in &above_source.frames {
            let common = above_target.frames.iter().find(|(other, _)| other == frame);
            if let Some((_, frame_from_target)) = common {
                return Ok(Some(frame_from_target.inverse() * frame_from_source));
            }
        }
        above_source.problem.or(above_target.problem).map_or(Ok(None), Err)
    }

    fn ancestors<'a>(&'a self, frame: &'a str) -> Ancestors<'a> {
        let (mut current, mut current_from_frame) = (frame, Pose::identity());
        let (mut frames, mut problem, mut is_circle) = (Vec::new(), None, false);
        while problem.is_none() {
            frames.push((current, current_from_frame));
            let Some(parents) = self.parents.get(current) else { break };
            problem = problem_of(current, parents);
            if let (None, Some((parent, Edge::Rigid(parent_from_current)))) = (&problem, parents.first_key_value()) {
                (current, current_from_frame) = (parent, parent_from_current * current_from_frame);
                if frames.iter().any(|(known, _)| *known == current) {
                    (problem, is_circle) = (Some(format!("frame {} is above itself", shortened(current))), true);
                }
            }
        }
        Ancestors { frames, problem, is_circle }
    }

    /// Describes the frames with an unusable transform, one clause each.
    pub fn problems(&self) -> Vec<String> {
        let mut problems: Vec<_> =
            self.parents.iter().filter_map(|(child, parents)| problem_of(child, parents)).collect();
        if problems.len() > MAX_LISTED {
            let more = problems.split_off(MAX_LISTED).len();
            problems.push(format!("{more} more frames are not usable"));
        }
        problems
    }
}

/// Describes why the transform of `frame` is not usable, if it is not.
fn problem_of(frame: &str, parents: &BTreeMap<String, Edge>) -> Option<String> {
    let name = shortened(frame);
    let names: Vec<_> = parents.keys().map(|parent| shortened(parent)).collect();
    match parents.first_key_value() {
        _ if parents.len() > 1 => Some(format!("frame {name} has {} parents, {}", names.len(), names.join(" and "))),
        Some((parent, Edge::Broken(reason))) => {
            Some(format!("the transform of frame {name} in {} is not usable: {reason}", shortened(parent)))
        }
        Some((parent, Edge::Moving)) => Some(format!("frame {name} moves in {}", shortened(parent))),
        _ => None,
    }
}

fn is_same(a: &Pose, b: &Pose) -> bool {
    (a.translation.vector - b.translation.vector).norm() <= MOVING && a.rotation.angle_to(&b.rotation) <= MOVING
}
