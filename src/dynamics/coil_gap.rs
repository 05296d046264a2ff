//! The gap between the coils of a bent spring.

use super::head::HeadModel;
use super::mounted_spring::MountedSpring;
use zsim_base::geometry::{Pose, Vector};
use zsim_elasticity::{ElasticityError, SpringState};

/// The smallest gap between the coils of a spring at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoilGap {
    /// Smallest gap between neighbouring coils, m; negative where they overlap.
    pub gap_m: f64,
    /// Angle between the axes of the two ends of the spring, rad.
    pub bend_rad: f64,
}

/// The gaps between the coils of a head's springs, for one pose after the other.
pub struct CoilGaps<'a> {
    /// Each spring with the last solution for its inner nodes.
    springs: Vec<(&'a MountedSpring, SpringState)>,
}

impl<'a> CoilGaps<'a> {
    /// The gaps of `model`.
    pub fn of(model: &'a HeadModel) -> Self {
        Self { springs: model.springs_with_states() }
    }

    /// The smallest gap of each spring with the head at a pose; `None` as for [`smallest`](Self::smallest).
    pub fn of_each(&mut self, base_from_head: &Pose) -> Vec<Option<CoilGap>> {
        let gap = |(mounted, state): &mut (&MountedSpring, SpringState)| mounted.coil_gap(state, base_from_head);
        self.springs.iter_mut().map(|spring| gap(spring).ok().flatten()).collect()
    }

    /// The smallest gap between neighbouring coils of the springs with the head at a pose.
    ///
    /// `None` without a coil, or where a segmented spring has no equilibrium. Poses in sequence are faster than others.
    pub fn smallest(&mut self, base_from_head: &Pose) -> Option<CoilGap> {
        let gap = |(mounted, state): &mut (&MountedSpring, SpringState)| mounted.coil_gap(state, base_from_head);
        let gaps = self.springs.iter_mut().filter_map(|spring| gap(spring).ok().flatten());
        gaps.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
    }
}

impl MountedSpring {
    /// The smallest gap between neighbouring coils with the head at a pose; `None` for a spring given by stiffness.
    ///
    /// From the force and moment at the ends of the segments, where the force law has the largest bend.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    fn coil_gap(&self, state: &mut SpringState, base_from_head: &Pose) -> Result<Option<CoilGap>, ElasticityError> {
        let Some(coil) = &self.coil else { return Ok(None) };
        let foot_from_top = self.ends.foot_from_top(base_from_head);
        let sections = self.spring.section_loads(state, &foot_from_top)?;
        let gap_m = sections.iter().map(|load| coil.inner_gap_m(load)).fold(f64::INFINITY, f64::min);
        let bend_rad = Vector::z().angle(&(foot_from_top.rotation * Vector::z()));
        Ok(Some(CoilGap { gap_m, bend_rad }))
    }
}
