//! The head on its spring.
//!
//! A [`HeadSpec`] says what a head is made of and what holds it; a [`HeadModel`] is that head checked, at rest, with its
//! modes; a [`HeadSimulation`] moves it on a base that moves. The spring's mechanics are [`crate::elasticity`]'s; the body
//! is integrated by rapier (see `engine`), which no other room knows.

mod actuated;
mod body;
mod capacity;
mod carrier;
mod engine;
mod error;
mod head;
mod law;
mod modes;
mod response;
mod simulation;
mod spec;
mod statics;

pub use actuated::{MotorSpec, TurnSpec};
pub use body::Body;
pub use capacity::heaviest_kg;
pub use carrier::CarrierSpec;
pub use error::DynamicsError;
pub use head::HeadModel;
pub use modes::{LinearModel, Mode, ModeKind};
pub use response::{FrequencyResponse, Peak, Points, Quantity};
pub use simulation::{HeadSimulation, HeadState};
pub use spec::{DampingSpec, EndStopSpec, HeadSpec, HoldSpec, InertiaSpec, LinkageSpec, PartSpec, PlacementSpec, load};
