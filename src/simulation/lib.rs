//! Simulation: from a checked scenario to measurements and ground truth.
//!
//! A [`Scenario`] names specs. A [`Run`] holds these specs, a [`Simulation`] the models built from them. [`Simulation::run`] moves the head
//! and passes measurements and ground truth to a sink in order of true time. [`simulate`] is the lower level: it runs
//! the sensors of a [`Rig`] on any [`HeadMotion`] in any scenery.

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
pub use rig::{EPOCH, Outputs, Rig};
pub use run::simulate;
pub use scenario::{Run, Scenario};
pub use summary::SimulationSummary;
pub use zsim_base::spec::{Named, NamedSpec};
