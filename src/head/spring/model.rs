//! The spring of a head: coil, wire and mounting.

use super::wire::{SpringMounting, Wire};
use crate::HeadError;
use zsim_base::geometry::{Kinematics, Pose};
use zsim_dynamics::{Body, DynamicsError, ElementSpec, HeadModel, HeadSpec, HeadState, LinkageSpec};
use zsim_elasticity::{Coil, SpringDesign, SpringSpec};

/// A coil of a head with its wire; each is `None` for a spring given by its stiffness.
#[derive(Debug, Clone, Copy)]
pub(super) struct WoundSpring {
    pub wire: Option<Wire>,
    /// The active coils.
    pub coil: Option<Coil>,
}

impl WoundSpring {
    fn of(spring: &SpringSpec) -> Result<Self, HeadError> {
        let coil = match spring.design().map_err(DynamicsError::from)? {
            SpringDesign::Coil(coil) => Some(coil),
            SpringDesign::Stiffness { .. } => None,
        };
        Ok(Self { wire: Wire::of(spring)?, coil })
    }
}

/// Properties of the spring of a head, or of the springs of a suspension; by default without wire and mounting, for a head
/// without a rest pose or a spring.
#[derive(Default)]
pub(super) struct SpringModel {
    /// The springs of a suspension, in the order of the spec.
    pub suspension: Vec<WoundSpring>,
    pub wire: Option<Wire>,
    pub mounting: Option<SpringMounting>,
    /// Whether the spring carries the head without a cable; the stress then follows from the motion of the head.
    pub has_no_cable: bool,
    /// The active coils.
    pub coil: Option<Coil>,
    /// Length of each rigid end, m.
    pub end_m: f64,
    /// Mass of the wire, or of the wires of a suspension.
    pub mass_kg: Option<f64>,
}

impl SpringModel {
    pub fn of(spec: &HeadSpec, body: &Body) -> Result<Self, HeadError> {
        let mounting = SpringMounting::of(spec, body);
        let (spring, cable) = match &spec.linkage {
            LinkageSpec::Spring { spring, cable, .. } => (spring, cable),
            LinkageSpec::Suspension { elements, .. } => return Self::of_suspension(elements),
            LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } => return Ok(Self::default()),
        };
        let WoundSpring { wire, coil } = WoundSpring::of(spring)?;
        Ok(Self {
            suspension: Vec::new(),
            wire,
            mounting,
            has_no_cable: cable.is_none(),
            coil,
            end_m: spring.end_length_m()?,
            mass_kg: spring.wire_mass_kg().map_err(DynamicsError::from)?,
        })
    }

    fn of_suspension(elements: &[ElementSpec]) -> Result<Self, HeadError> {
        let springs = elements.iter().filter_map(|element| match element {
            ElementSpec::Spring(mounted) => Some(&mounted.spring),
            ElementSpec::Cord(_) | ElementSpec::Float(_) | ElementSpec::UniversalJoint(_) => None,
        });
        let springs: Vec<&SpringSpec> = springs.collect();
        let masses = springs.iter().map(|spring| spring.wire_mass_kg().map_err(DynamicsError::from));
        let masses: Option<Vec<f64>> = masses.collect::<Result<_, _>>()?;
        Ok(Self {
            suspension: springs.into_iter().map(WoundSpring::of).collect::<Result<_, _>>()?,
            mass_kg: masses.filter(|masses| !masses.is_empty()).map(|masses| masses.iter().sum()),
            ..Self::default()
        })
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

    /// Compression of a single spring at rest: free length minus distance from foot to top, m; `None` if the free length is not
    /// known.
    pub fn sag_m(&self, head: &HeadModel) -> Option<f64> {
        let (mounting, coil) = self.mounting.zip(self.coil)?;
        Some(coil.free_length_m() - mounting.length_m(head.base_from_head_at_rest()))
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
