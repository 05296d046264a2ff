//! The head in its linkage: on a spring, several, cords, a float, or in a joint.
//!
//! A [`HeadSpec`] says what a head is made of and what holds it; a [`HeadModel`] is that head checked, at rest, with
//! its modes; a [`HeadSimulation`] moves it on a base that moves. A linkage is the sum of its elements. The springs'
//! mechanics are [`crate::elasticity`]'s; the body is integrated by rapier (see `engine`), which no other room knows.

mod actuated;
mod body;
mod capacity;
mod carrier;
mod cord;
mod elements;
mod engine;
mod error;
mod float;
mod head;
mod joint;
mod law;
mod modes;
mod mounted;
mod push;
mod response;
mod simulation;
mod site;
mod spec;
mod sprung;
mod statics;
mod under;

pub use actuated::{MotorSpec, TurnSpec};
pub use body::Body;
pub use capacity::heaviest_kg;
pub use carrier::CarrierSpec;
pub use elements::{
    CableSpec, CordSpec, CordStiffnessSpec, ElementSpec, FloatSpec, SpringElementSpec, SpringMassSpec,
    UniversalJointSpec,
};
pub use error::DynamicsError;
pub use head::HeadModel;
pub use modes::{LinearModel, Mode, ModeKind};
pub use response::{FrequencyResponse, Peak, Points, Quantity};
pub use simulation::{HeadSimulation, HeadState};
pub use spec::{DampingSpec, EndStopSpec, HeadSpec, HoldSpec, InertiaSpec, LinkageSpec, PartSpec, PlacementSpec, load};
pub use sprung::{Bearing, BearingKind};
