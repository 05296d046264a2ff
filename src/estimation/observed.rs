//! Surfaces observed by the open loop, the input of the global registration.

use super::surfel::Patch;
use nalgebra::Matrix6;
use rayon::prelude::*;
use zsim_base::geometry::{Pose, Trajectory};
use zsim_base::measurement::LidarCorrection;
use zsim_base::time::{Span, Stamp};

/// Surface patches observed by the open loop, in the map frame, each with its time.
///
/// [`super::Estimator::recording_surfels`] records it; [`super::register`] uses it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ObservedSurfels {
    /// Origin of the times in seconds.
    pub(super) origin: Stamp,
    /// The observed patches.
    pub(super) surfels: Vec<ObservedSurfel>,
    /// The lidar corrections with which the patches were built, in order of time.
    pub(super) lidars: Vec<LidarCorrectionPeriod>,
    /// How fixed views changed the motion of the open loop, in order of time.
    pub(super) by_views: Vec<MotionByViews>,
    /// Whether the range bias is unobservable and fixed, because the lidar looks in one direction only.
    pub(super) range_bias_is_fixed: bool,
    /// Run time of building the surfels, s.
    pub(super) elapsed_s: f64,
}

/// How fixed views changed the motion of the open loop from `from_s` to `until_s`, lidar time, s from the origin of the times.
///
/// With the poses `a` and `b` of the open loop, the motion without views is `a^-1 c b`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionByViews {
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    /// `c`, in the map frame.
    pub(super) change: Pose,
    /// Covariance of the motion without views per second: rotation (rad), then translation (m), map axes.
    pub(super) covariance_per_s: Matrix6<f64>,
}

/// The lidar correction during a part of the trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LidarCorrectionPeriod {
    pub(super) lidar: LidarCorrection,
    /// End of the part of the trajectory that became final with it, lidar time, s from the origin of the times.
    pub(super) until_s: f64,
}

/// A patch of a window at the mean time of its points, as [`ObservedSurfel`].
#[derive(Debug, Clone, Copy)]
pub(super) struct ObservedPatch {
    pub(super) tau_s: f64,
    pub(super) patch: Patch,
    pub(super) weakness: f64,
}

/// An observed patch at the mean time of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ObservedSurfel {
    /// Lidar time, s from the origin of the times.
    pub(super) tau_s: f64,
    pub(super) patch: Patch,
    /// Mean inverse square of the intensity of the returns, in the unit of the sensor; 0 without intensity.
    pub(super) weakness: f64,
    /// Index of the lidar correction with which the patch was built.
    pub(super) lidar: u32,
}

impl ObservedSurfels {
    /// Returns the number of patches.
    pub fn len(&self) -> usize {
        self.surfels.len()
    }

    /// Whether there are no patches, for example because none were requested.
    pub fn is_empty(&self) -> bool {
        self.surfels.is_empty()
    }

    /// Returns the run time of building the surfels, s.
    ///
    /// It differs between identical runs.
    pub fn elapsed_s(&self) -> f64 {
        self.elapsed_s
    }

    /// Moves each patch from the trajectory `from` to the trajectory `to`.
    ///
    /// Both are `map_from_head`.
    pub fn along(&self, from: &Trajectory, to: &Trajectory) -> Self {
        let within = |stamp: Stamp, trajectory: &Trajectory| {
            let (first, last) = trajectory.span()?;
            trajectory.at(stamp.clamp(first, last))
        };
        let moved = |surfel: &ObservedSurfel| {
            let stamp = self.origin + Span::from_seconds(surfel.tau_s);
            let there_from_here = within(stamp, to)? * within(stamp, from)?.inverse();
            Some(ObservedSurfel { patch: surfel.patch.moved_by(&there_from_here), ..*surfel })
        };
        Self { surfels: self.surfels.par_iter().filter_map(moved).collect(), ..self.clone() }
    }

    /// The lidar correction with which the trajectory at `stamp` became final; after the end, the last one.
    pub(super) fn lidar_at(&self, stamp: Stamp) -> Option<&LidarCorrection> {
        let tau_s = stamp.seconds_since(self.origin);
        let known = self.lidars.partition_point(|known| known.until_s < tau_s);
        self.lidars.get(known).or(self.lidars.last()).map(|known| &known.lidar)
    }

    /// Adds patches up to `until_s` (s from `origin`), built with the correction `lidar`.
    pub(super) fn extend(
        &mut self,
        origin: Stamp,
        patches: impl Iterator<Item = ObservedPatch>,
        lidar: LidarCorrection,
        until_s: f64,
    ) {
        self.origin = origin;
        match self.lidars.last_mut().filter(|last| last.lidar == lidar) {
            Some(last) => last.until_s = until_s,
            None => self.lidars.push(LidarCorrectionPeriod { lidar, until_s }),
        }
        let lidar = (self.lidars.len() - 1) as u32;
        self.surfels.extend(patches.map(|ObservedPatch { tau_s, patch, weakness }| ObservedSurfel {
            tau_s,
            patch,
            weakness,
            lidar,
        }));
    }
}
