//! The spring of a head: coil, wire and mounting.

use super::wire::{SpringMounting, Wire};
use crate::dynamics::{Body, DynamicsError, HeadModel, HeadSpec, HeadState, LinkageSpec};
use crate::elasticity::{Coil, SpringDesign};
use crate::geometry::{Kinematics, Pose};
use crate::study::StudyError;

/// Properties of the spring of a head.
pub(super) struct SpringModel {
    pub wire: Option<Wire>,
    pub mounting: Option<SpringMounting>,
    /// Whether the spring carries the head without a cable; the stress then follows from the motion of the head.
    pub has_no_cable: bool,
    /// The active coils.
    pub coil: Option<Coil>,
    /// Length of each rigid end, m.
    pub end_m: f64,
    pub mass_kg: Option<f64>,
}

impl SpringModel {
    pub fn of(spec: &HeadSpec, body: &Body) -> Result<Self, StudyError> {
        let mounting = SpringMounting::of(spec, body);
        let LinkageSpec::Spring { spring, cable, .. } = &spec.linkage else {
            return Ok(Self { mounting, ..Self::without_mounting() });
        };
        let coil = match spring.design().map_err(DynamicsError::from)? {
            SpringDesign::Coil(coil) => Some(coil),
            SpringDesign::Stiffness { .. } => None,
        };
        Ok(Self {
            wire: Wire::of(spring)?,
            mounting,
            has_no_cable: cable.is_none(),
            coil,
            end_m: spring.end_length_m()?,
            mass_kg: spring.wire_mass_kg().map_err(DynamicsError::from)?,
        })
    }

    /// A model without wire and mounting, for a head without a rest pose or a spring.
    pub fn without_mounting() -> Self {
        Self { wire: None, mounting: None, has_no_cable: false, coil: None, end_m: 0.0, mass_kg: None }
    }

    /// Whether the load on the spring follows from the motion of the head.
    pub fn carries_alone(&self) -> bool {
        self.mounting.is_some() && self.has_no_cable
    }

    /// Maximum stress in the wire in a state, Pa; `None` unless a single spring without a cable carries the head.
    pub fn stress_pa(&self, state: &HeadState) -> Option<f64> {
        let (wire, mounting) = self.wire.zip(self.mounting).filter(|_| self.carries_alone())?;
        Some(mounting.stress_pa(&wire, state))
    }

    /// Compression at rest: free length minus distance from foot to top, m; 0 if the free length is not known.
    pub fn sag_m(&self, head: &HeadModel) -> f64 {
        let (Some(mounting), Some(coil)) = (&self.mounting, &self.coil) else { return 0.0 };
        coil.free_length_m() - mounting.length_m(head.base_from_head_at_rest())
    }
}

/// The head at rest on an upright base.
pub(super) fn at_rest(head: &HeadModel) -> HeadState {
    HeadState {
        t_s: 0.0,
        head: Kinematics::at_rest(*head.base_from_head_at_rest()),
        base: Kinematics::at_rest(Pose::identity()),
    }
}
