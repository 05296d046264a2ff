//! Dynamics of the head: linkage, equilibrium, modes, frequency response and simulation.
//!
//! A [`HeadSpec`] describes the parts of a head and the linkage to the base: rigid, actuated, one spring, or several
//! springs, cords, floats and a joint. A [`HeadModel`] is the validated head in equilibrium with its modes. A
//! [`HeadSimulation`] computes the motion of the head on a moving base. The forces of a linkage are the sum over its
//! elements. Spring mechanics are in [`zsim_elasticity`]; rapier integrates the rigid body (see `engine`), and no
//! other module uses rapier.

mod actuated;
mod base_solver;
mod body;
mod capacity;
mod carrier;
mod coil_gap;
mod compliant;
mod contact;
mod contact_steps;
mod cord;
mod elements;
mod end_loads;
mod engine;
mod error;
mod float;
mod force_law;
mod forces;
mod head;
mod joint;
mod modes;
mod mount;
mod mounted_spring;
mod placement;
mod response;
mod simulation;
mod spec;
mod statics;
mod usual;

pub use actuated::{MotorSpec, TurnSpec};
pub use body::Body;
pub use capacity::{MassLimit, max_head_mass, stands_with_mass};
pub use carrier::CarrierSpec;
pub use coil_gap::{CoilGap, CoilGaps};
pub use compliant::{ElementKind, ElementLoad};
pub use contact::{CoilContact, ContactWatch};
pub use elements::{
    CableSpec, CordSpec, CordStiffnessSpec, ElementSpec, FloatSpec, SpringElementSpec, SpringMassSpec,
    UniversalJointSpec,
};
pub use end_loads::{EndLoad, SpringEndLoads};
pub use error::DynamicsError;
pub use head::HeadModel;
pub use modes::natural_frequencies_hz;
pub use modes::{LinearModel, Mode, ModeKind};
pub use response::{AccelerationKind, FrequencyResponse, GainPoints, Peak};
pub use simulation::{HeadSimulation, HeadState};
pub use spec::{DampingSpec, EndStopSpec, HeadSpec, HoldSpec, InertiaSpec, LinkageSpec, PartSpec, PlacementSpec, load};
