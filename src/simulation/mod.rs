//! From a checked scenario to measurements and truth.
//!
//! A [`Scenario`] names specs; a [`Simulation`] is these specs found, checked and built; [`Simulation::run`] moves the
//! head and gives a sink what the sensors say and what really happened, in the order of true time. Below it stands
//! [`simulate`], the same for sensors on a head ([`Rig`]) that moves in any way ([`HeadMotion`]) through any scenery.

mod deliver;
mod error;
mod faults;
mod measure;
mod motion;
mod prepared;
mod rig;
mod run;
mod scenario;
mod schedule;
mod summary;

pub use error::SimulationError;
pub use faults::{FaultKind, FaultSpec, Faults, FaultsSpec, FaultySensor, MissEncoding};
pub use motion::{HeadMotion, STEP_S};
pub use prepared::{Simulation, carrier_of};
pub use rig::{EPOCH, Rig};
pub use run::simulate;
pub use scenario::{Scenario, Sources, Specs};
pub use summary::SimulationSummary;
