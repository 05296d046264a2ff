//! The gap between the coils of a bent spring.

use super::mounted_spring::MountedSpring;
use crate::elasticity::ElasticityError;
use crate::geometry::{Pose, Vector};

/// The smallest gap between the coils of a spring at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoilGap {
    /// Smallest gap between neighbouring coils, m; negative where they overlap.
    pub gap_m: f64,
    /// Angle between the axes of the two ends of the spring, rad.
    pub bend_rad: f64,
}

impl MountedSpring {
    /// The smallest gap between neighbouring coils with the head at a pose; `None` for a spring given by stiffness.
    ///
    /// From the force and moment at the ends of the segments, where the force law has the largest bend.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn coil_gap(&self, base_from_head: &Pose) -> Result<Option<CoilGap>, ElasticityError> {
        let Some(coil) = &self.coil else { return Ok(None) };
        let foot_from_top = self.ends.foot_from_top(base_from_head);
        let sections = self.spring.section_loads(&mut self.spring.state(), &foot_from_top)?;
        let gap_m = sections.iter().map(|load| coil.inner_gap_m(load)).fold(f64::INFINITY, f64::min);
        let bend_rad = Vector::z().angle(&(foot_from_top.rotation * Vector::z()));
        Ok(Some(CoilGap { gap_m, bend_rad }))
    }
}
