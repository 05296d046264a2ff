//! What the open loop saw, for the registration of the whole.

use super::surfel::Patch;
use crate::geometry::Trajectory;
use crate::measurement::LidarCorrection;
use crate::time::{Span, Stamp};
use rayon::prelude::*;

/// Patches of surface that the open loop saw, where its trajectory puts them in the map, each at its time. Made by
/// [`super::Estimator::surveying`], taken by [`super::register`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Survey {
    /// From when the sightings' seconds count.
    pub(super) origin: Stamp,
    pub(super) sightings: Vec<Sighting>,
    /// What was known of the lidar when sightings were made, in the order of time.
    pub(super) lidars: Vec<KnownLidar>,
    /// Whether the lidar looks one way, so that nothing tells an offset of its ranges.
    pub(super) ranges_are_held: bool,
    /// Time that making it took, s.
    pub(super) took_s: f64,
}

/// What was known of the lidar for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct KnownLidar {
    pub(super) lidar: LidarCorrection,
    /// Until when the trajectory became final with it, lidar time, s from the survey's origin.
    pub(super) until_s: f64,
}

/// A patch at the mean time of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    /// Lidar time, s from the survey's origin.
    pub(super) tau_s: f64,
    pub(super) patch: Patch,
    /// By which of the survey's corrections of the lidar it was made.
    pub(super) lidar: u32,
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
            Some(Sighting { patch: sighting.patch.moved_by(&there_from_here), ..*sighting })
        };
        Self { sightings: self.sightings.par_iter().filter_map(moved).collect(), ..self.clone() }
    }

    /// What was known of the lidar when the trajectory at `stamp` became final; behind the end, at the end.
    pub(super) fn lidar_at(&self, stamp: Stamp) -> Option<&LidarCorrection> {
        let tau_s = stamp.seconds_since(self.origin);
        let known = self.lidars.partition_point(|known| known.until_s < tau_s);
        self.lidars.get(known).or(self.lidars.last()).map(|known| &known.lidar)
    }

    /// Adds what was seen further up to `until_s`, its seconds counting from `origin`, made by `lidar`.
    pub(super) fn extend(
        &mut self,
        origin: Stamp,
        patches: impl Iterator<Item = (f64, Patch)>,
        lidar: LidarCorrection,
        until_s: f64,
    ) {
        self.origin = origin;
        match self.lidars.last_mut().filter(|last| last.lidar == lidar) {
            Some(last) => last.until_s = until_s,
            None => self.lidars.push(KnownLidar { lidar, until_s }),
        }
        let lidar = (self.lidars.len() - 1) as u32;
        self.sightings.extend(patches.map(|(tau_s, patch)| Sighting { tau_s, patch, lidar }));
    }
}
