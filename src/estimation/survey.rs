//! What the open loop saw, for the registration of the whole.

use super::surfel::Patch;
use crate::geometry::Trajectory;
use crate::time::{Span, Stamp};
use rayon::prelude::*;

/// Patches of surface that the open loop saw, where its trajectory puts them in the map, each at its time. Made by
/// [`super::Estimator::surveying`], taken by [`super::register`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Survey {
    /// From when the sightings' seconds count.
    pub(super) origin: Stamp,
    pub(super) sightings: Vec<Sighting>,
    /// Time that making it took, s.
    pub(super) took_s: f64,
}

/// A patch at the mean time of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    /// Lidar time, s from the survey's origin.
    pub(super) tau_s: f64,
    pub(super) patch: Patch,
}

impl Survey {
    /// How many patches.
    pub fn len(&self) -> usize {
        self.sightings.len()
    }

    /// Whether nothing was seen, or nobody asked.
    pub fn is_empty(&self) -> bool {
        self.sightings.is_empty()
    }

    /// Time that making it took, s: like every wall of time it differs from run to run.
    pub fn took_s(&self) -> f64 {
        self.took_s
    }

    /// What was seen along the trajectory `from`, where `to` puts it, both `map_from_head`.
    pub fn along(&self, from: &Trajectory, to: &Trajectory) -> Self {
        let within = |stamp: Stamp, trajectory: &Trajectory| {
            let (first, last) = trajectory.span()?;
            trajectory.at(stamp.clamp(first, last))
        };
        let moved = |sighting: &Sighting| {
            let stamp = self.origin + Span::from_seconds(sighting.tau_s);
            let there_from_here = within(stamp, to)? * within(stamp, from)?.inverse();
            let turn = there_from_here.rotation.to_rotation_matrix().into_inner();
            let patch = &sighting.patch;
            let centre = turn * patch.centre + there_from_here.translation.vector;
            let covariance = turn * patch.covariance * turn.transpose();
            Some(Sighting { patch: Patch { centre, normal: turn * patch.normal, covariance, ..*patch }, ..*sighting })
        };
        Self { sightings: self.sightings.par_iter().filter_map(moved).collect(), ..*self }
    }

    /// Adds what was seen further, its seconds counting from `origin`.
    pub(super) fn extend(&mut self, origin: Stamp, sightings: Vec<Sighting>) {
        self.origin = origin;
        self.sightings.extend(sightings);
    }
}
